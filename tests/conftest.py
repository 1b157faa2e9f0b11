"""Shared fixtures: where the real light fields are, and whether their absence is an error."""

import os
from pathlib import Path

import pytest

# beside a checkout, unless the environment names another place
DATA = Path(os.environ.get("SEPI_DATA", Path(__file__).parents[2] / "shared" / "data"))


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
