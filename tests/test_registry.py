"""Extensions: found by their entry points, imported when they are used, and not missed by the core."""

import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from workflow_copy import REPOSITORY, TINY, Workflow, planned

from sepi import registry
from sepi.cli.main import main
from sepi.errors import SepiError
from sepi.io.disparity_maps import read_pfm
from sepi.scenes import render
from sepi.variants import STAGES

EXAMPLE = REPOSITORY / "docs/example_extension"


@pytest.fixture
def no_extensions() -> Iterator[None]:
    """Nothing is remembered of what is installed, before and after."""
    registry.extensions.cache_clear()
    registry.added.cache_clear()
    yield
    registry.extensions.cache_clear()
    registry.added.cache_clear()


def installed(folder: Path, name: str, entry_points: str) -> None:
    """A distribution with these entry points, as pip leaves it."""
    metadata = folder / f"{name}-1.0.dist-info"
    metadata.mkdir(parents=True)
    (metadata / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n")
    (metadata / "entry_points.txt").write_text(entry_points)


def run(*words: str, path: Path, cwd: Path) -> subprocess.CompletedProcess[str]:
    environment = os.environ | {"PYTHONPATH": os.pathsep.join([str(path), str(REPOSITORY)])}
    words = (sys.executable, *words)
    return subprocess.run(words, env=environment, cwd=cwd, capture_output=True, text=True, check=False)


@pytest.mark.workflow
def test_the_documented_extension_adds_all_that_it_says(tmp_path: Path) -> None:
    """A method, a reader, a command and a dataset of another package: in the command, and in jobs of the workflow."""
    target, source = tmp_path / "installed", tmp_path / "source"
    shutil.copytree(EXAMPLE, source)
    words = ["pip", "install", "--quiet", "--no-index", "--no-deps", "--no-build-isolation", "--target", str(target)]
    done = run("-m", *words, str(source), path=target, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    views = render("dots", size=64, views=3).views
    (tmp_path / "shot.views").write_bytes(views.tobytes())

    def cli(*words: str) -> str:
        done = run("-m", "sepi", *words, path=target, cwd=tmp_path)
        assert done.returncode == 0, done.stderr
        return done.stdout

    assert "Print the mean of a light field." in cli("--help")
    assert cli("brightness", "shot.views") == f"{views.mean():.1f}\n"
    for variant in ("median", "fast"):
        cli("depth", "shot.views", "--variant", variant, "-o", variant, "--disparity-range", "-2", "2")
    maps = [read_pfm(tmp_path / variant / "disparity.pfm") for variant in ("median", "fast")]
    assert not np.array_equal(*maps)
    assert "\nshots:\n" in run("-m", "sepi.workflow.config_file", path=target, cwd=tmp_path).stdout

    values = {"builtin": {"scenes": []}, "shots": {"folder": str(tmp_path)}, "stages": TINY["stages"]}
    flow = Workflow(REPOSITORY, tmp_path / "run", values)
    done = flow.run("results/shots/shot/median/disparity.pfm", PYTHONPATH=f"{target}{os.pathsep}{REPOSITORY}")
    assert done.returncode == 0, done.stdout
    assert (flow.folder / "results/shots/shot/median/disparity.pfm").is_file()
    edited = target / "sepi_example/method.py"
    edited.write_text(edited.read_text().replace("parameters.size", "5"))
    plan = flow.run(
        "results/shots/shot/median/disparity.pfm", flags=("-n",), PYTHONPATH=f"{target}{os.pathsep}{REPOSITORY}"
    )
    assert planned(plan.stdout).keys() & set(STAGES) == {"optimize"}


def test_an_extension_that_cannot_load_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, no_extensions: None
) -> None:
    """One whose files are gone, as after a checkout of another branch, is none at all."""
    installed(tmp_path, "gone", "[sepi.extensions]\ngone = no_such_package.inner:EXTENSION\n")
    installed(tmp_path, "broken", "[console_scripts]\nx = y:z\n[sepi.extensions]\nbroken = broken_one:EXTENSION\n")
    (tmp_path / "broken_one.py").write_text("import no_such_library\n")
    monkeypatch.syspath_prepend(tmp_path)
    done = CliRunner().invoke(main, ["--help"])
    assert done.exit_code == 1
    assert done.stderr == (
        "sepi: extension broken: cannot be loaded from broken_one:EXTENSION: No module named 'no_such_library'\n"
    )


def test_two_of_one_name_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, no_extensions: None) -> None:
    installed(tmp_path, "one", "[sepi.extensions]\none = alike:EXTENSION\ntwo = alike:EXTENSION\n")
    (tmp_path / "alike.py").write_text(
        "from sepi.registry import Extension\nEXTENSION = Extension(variants={'mine': {'base': 'fast'}})\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(SepiError, match="extensions one and two: both add 'mine' to variants"):
        registry.added("variants")


# not of the core: extensions and what measures or documents them; the checkout around it; other machines
_ELSEWHERE = ("extensions", "bench", "docs", "fuzz", "cluster", "faults", "test_release.py")
# what is installed is imported from where it is, even if it is gone here
_ALONE = """
import sys
sys.meta_path[:] = [one for one in sys.meta_path if "editable" not in f"{one!r}"]
import pytest
sys.exit(pytest.main(sys.argv[1:]))
"""


@pytest.mark.system
def test_the_core_passes_its_tests_without_extensions(tmp_path: Path) -> None:
    """A part of the core that leans on an extension fails where that is not installed, and nowhere else."""
    copied = ("sepi", "rules", "profiles", "tests", "config", "bench", "tools")
    for name in copied:
        shutil.copytree(REPOSITORY / name, tmp_path / name, ignore=shutil.ignore_patterns("__pycache__"))
    for name in ("Snakefile", "pyproject.toml", ".snakemake-workflow-catalog.yml"):
        shutil.copy2(REPOSITORY / name, tmp_path)
    shutil.rmtree(tmp_path / "sepi/extensions")
    installed(tmp_path, "sepi", "")
    text = run("-m", "sepi.workflow.config_file", path=tmp_path, cwd=tmp_path).stdout
    assert "rendered" not in text
    for name in ("config.yaml", "config/config.yaml"):
        (tmp_path / name).write_text(text)
    ignored = [f"--ignore=tests/{name}" for name in _ELSEWHERE]
    quick = "not real and not workflow and not browser and not slow and not system and not faults and not long"
    words = ("-c", _ALONE, "-q", "-p", "no:cacheprovider", "-m", quick, *ignored, "tests")
    done = run(*words, path=tmp_path, cwd=tmp_path)
    assert done.returncode == 0, done.stdout[-3000:]
