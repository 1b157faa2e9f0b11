"""Shared fixtures: real light fields and a browser, and whether their absence is an error; a small report."""

import os
import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from remembered_scenes import FOLDER, remembered

import sepi.scenes
from sepi import kernels
from sepi.process.threads import available_cores
from sepi.registry import extensions

if TYPE_CHECKING:
    from page_example import Example

pytest_plugins = ("cpu_budget",)

# before the tests import it
sepi.scenes.render = remembered(sepi.scenes.render)

# beside a checkout, unless the environment names another place
DATA = Path(os.environ.get("SEPI_DATA", Path(__file__).parents[2] / "shared" / "data"))


# what a test is marked with for a fixture that it uses
_MARKS = {"real_data": "real", "browser": "browser", "slurm": "slurm"}
# what takes longest is begun first, so that several processes end at about the same time
_FIRST = ("slurm", "real", "system", "workflow", "slow", "browser", "long")
# written by `make long-tests`
_LONG_TESTS = Path(__file__).with_name("long_tests.txt")
# files whose tests share what takes long to make: real maps, the workflow, a report, kernels for other types
_TOGETHER = {
    **dict.fromkeys(["test_real", "test_real_formats", "test_real_methods"], "real"),
    **dict.fromkeys(["test_compare", "test_packing", "test_page", "test_page_browser"], "page"),
    **dict.fromkeys(["test_page_cloud", "test_page_pixels", "test_page_viewer"], "page"),
    "test_pipeline": "types",
    "test_error_bars": "error bars",
    "test_geometries": "geometries",
    "test_calibration": "calibration",
    "test_workflow": "workflow",
    "test_module": "module",
    "test_commands": "commands",
    "test_slurm": "slurm",
    **dict.fromkeys(["test_kills", "test_machine"], "faults"),
}

# files whose tests of one variant or light field, the last word of their names, share what takes long to make
_BY_LAST_WORD = ("test_missing_views", "test_real_sets", "test_relations")


def pytest_configure(config: pytest.Config) -> None:
    """Several processes of one run share the scenes that they draw."""
    if FOLDER not in os.environ:
        os.environ[FOLDER] = tempfile.mkdtemp(prefix="sepi-scenes-")
        config.add_cleanup(lambda: shutil.rmtree(os.environ.pop(FOLDER)))


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark tests by the fixtures that they use and by how long they take, and put those first that take longest."""
    long = set(_LONG_TESTS.read_text(encoding="utf-8").split()) if _LONG_TESTS.is_file() else set()
    for item in items:
        if item.nodeid.partition("[")[0] in long:
            item.add_marker("long")
        for needed in item.iter_markers("extension"):
            if needed.args[0] not in extensions():
                item.add_marker(pytest.mark.skip(f"the extension {needed.args[0]} is not installed"))
        for fixture, mark in _MARKS.items():
            if fixture in getattr(item, "fixturenames", ()):
                item.add_marker(mark)
    items.sort(key=lambda item: min((n for n, mark in enumerate(_FIRST) if item.get_closest_marker(mark)), default=9))


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_auto_num_workers() -> int:
    """One process more than there are cores, since those of a cluster and of the workflow mostly wait."""
    return available_cores() + 1


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> Any:
    """Where several processes run the tests, those of :data:`_TOGETHER` stay in one; the others go where there is time.

    Marks for groups (``--dist loadgroup``) are lost between pytest 9 and pytest-xdist 3.8.
    """
    from xdist.scheduler import LoadScopeScheduling

    class Scheduler(LoadScopeScheduling):
        def _split_scope(self, nodeid: str) -> str:
            file = Path(nodeid.partition("::")[0]).stem
            if file in _BY_LAST_WORD:
                return f"{file} {nodeid.rpartition('-')[2].rpartition('[')[2]}"
            return _TOGETHER.get(file, nodeid)

    config.option.loadscopereorder = False
    return Scheduler(config, log)


@pytest.fixture(autouse=True)
def one_thread() -> None:
    """One thread for each of several processes; a command under test, or a test of threads, asks for more by itself."""
    if "PYTEST_XDIST_WORKER" in os.environ:
        kernels.set_thread_count(1)


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty folder, which is the current one."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


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
