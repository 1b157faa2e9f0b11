"""Shared fixtures: real light fields and a browser, and whether their absence is an error; a small report."""

import os
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from page_example import Example

# beside a checkout, unless the environment names another place
DATA = Path(os.environ.get("SEPI_DATA", Path(__file__).parents[2] / "shared" / "data"))


# fixtures that take long to make, and what their tests are marked with
_MARKS = {"real_data": "real", "browser": "browser"}
# tests that share what takes long to make run in one process; each kind in one of its own
_GROUPS = {"real_data": "real", "example": "page", "browser": "page", "workflow": "workflow"}


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark tests by what they need, and keep those together that share it when several processes run the tests."""
    for item in items:
        needed = getattr(item, "fixturenames", ())
        for fixture, mark in _MARKS.items():
            if fixture in needed:
                item.add_marker(mark)
        group = next((group for fixture, group in _GROUPS.items() if fixture in needed), None)
        if group is not None:
            item.add_marker(pytest.mark.xdist_group(group))


@pytest.fixture(scope="session")
def real_data() -> Path:
    """Folder of the real light fields; absent data skips the test, or fails it where they are required."""
    if (DATA / "hci_new").is_dir():
        return DATA
    if os.environ.get("SEPI_REQUIRE_DATA"):
        pytest.fail(f"{DATA}/hci_new: real light fields are required here (SEPI_REQUIRE_DATA) but absent")
    pytest.skip(f"real light fields not found at {DATA}/hci_new (set SEPI_DATA to their folder)")


@pytest.fixture(scope="session")
def hci(real_data: Path) -> Path:
    """Folder of HCI 4D benchmark scenes (cotton, antinous)."""
    return real_data / "hci_new"


@pytest.fixture(scope="session")
def browser() -> Iterator[Any]:
    """A headless Chromium; absent, it skips the test, or fails it where it is required."""
    from browser import launched

    with launched() as found:
        yield found


@pytest.fixture(scope="session")
def example(tmp_path_factory: pytest.TempPathFactory) -> "Example":
    """A small report, computed for real, and its page."""
    from page_example import make_example

    return make_example(tmp_path_factory.mktemp("example"))


@pytest.fixture
def page(browser: Any, example: "Example") -> Iterator[Any]:
    """The page of the small report at desktop width, light; nothing may complain or leave the page."""
    from browser import opened

    with opened(browser, example.page, color_scheme="light") as found:
        yield found
