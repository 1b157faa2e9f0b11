"""The workflow as a module of another one: the documentation's example, word for word, and what may go wrong."""

import os
import re
import shutil
import subprocess
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from snakemake_runs import run_snakemake
from workflow_copy import REPOSITORY, copy_of_the_project

from sepi.scenes import render

pytestmark = pytest.mark.workflow

DOCUMENT = REPOSITORY / "docs/reproduce/module.md"
QUICK = "depth/results/own/flowers/quick"


def block(language: str) -> str:
    """The only block in a language in the document."""
    (found,) = re.findall(rf"```{language}\n(.+?)```", DOCUMENT.read_text(), re.DOTALL)
    return str(found)


@dataclass(frozen=True)
class User:
    """Another workflow in a folder of its own, beside a checkout of this one."""

    folder: Path

    def write(self, snakefile: str, config: str) -> None:
        self.folder.mkdir(exist_ok=True)
        (self.folder / "Snakefile").write_text(snakefile)
        (self.folder / "config.yaml").write_text(config)

    @property
    def environment(self) -> dict[str, str]:
        """As outside any run of this workflow."""
        kept = {name: value for name, value in os.environ.items() if not name.startswith("SEPI_")}
        return kept | {"PYTHONPATH": str(REPOSITORY)}

    def run(self, *words: str) -> subprocess.CompletedProcess[str]:
        """Snakemake as the user calls it; stdout holds its messages too."""
        return run_snakemake(["--cores", "1", *words], self.folder, self.environment)

    def told(self) -> str:
        """The one line with which this workflow ends a run that it cannot do."""
        result = self.run()
        assert result.returncode == 1, result.stdout
        assert "Traceback" not in result.stdout
        (line,) = (line for line in result.stdout.splitlines() if line.startswith("sepi: "))
        return line


@pytest.fixture(scope="module")
def user(tmp_path_factory: pytest.TempPathFactory) -> User:
    """The document's example and its light field, not yet run."""
    root = tmp_path_factory.mktemp("module")
    copy_of_the_project(root / "sepi")
    found = User(root / "mine")
    found.write(block("python"), block("yaml"))
    np.save(found.folder / "flowers.npy", render("dots", size=64, views=5).views)
    return found


@pytest.fixture(scope="module")
def finished(user: User) -> User:
    """The same after a run."""
    result = user.run()
    assert result.returncode == 0, result.stdout
    (user.folder / "stdout").write_text(result.stdout)
    return user


@pytest.fixture
def beside(user: User, tmp_path: Path) -> Callable[..., User]:
    """Makes another workflow with a copy of the example's Snakefile, changed, and a configuration."""

    def make(config: str, *changes: tuple[str, str]) -> User:
        text = block("python").replace('"../sepi/Snakefile"', repr(str(user.folder.parent / "sepi/Snakefile")))
        for old, new in changes:
            assert old in text
            text = text.replace(old, new)
        made = User(tmp_path / "other")
        made.write(text, config)
        return made

    return make


def test_the_documents_example_runs_as_it_stands(finished: User) -> None:
    """Who copies it gets a map by this workflow, and their own rule reads it."""
    disparity = np.load(finished.folder / QUICK / "disparity.npy")
    assert disparity.shape == (64, 64)
    assert float((finished.folder / "nearest.txt").read_text()) == pytest.approx(float(disparity.max()))
    stdout = (finished.folder / "stdout").read_text()
    assert f"Maps written:\n  {QUICK}/\n" in stdout
    assert "localrules" not in stdout
    assert sorted(path.name for path in finished.folder.iterdir()) == sorted(
        [".snakemake", "Snakefile", "config.yaml", "depth", "flowers.npy", "nearest.txt", "stdout"]
    )


def test_tables_and_page_go_below_the_prefix(finished: User) -> None:
    """All of it is planned, with what the user's configuration asks for; what is there is not made again, as every run
    of a workflow that goes on from the maps would do.
    """
    result = finished.run("--dry-run", "sepi_all", "nearest")
    assert result.returncode == 0, result.stdout
    table = dict(re.findall(r"^(\w+) +(\d+)$", result.stdout.split("Job stats:")[1], re.MULTILINE))
    assert table.keys().isdisjoint({"sepi_ingest", "nearest"})
    assert not re.search(f"output: .*{QUICK}", result.stdout)
    assert {"sepi_numbers", "sepi_page", "sepi_maps", "sepi_all"} <= set(table)
    assert re.search(r"Missing output files: depth/reports/index.html", result.stdout)
    assert " reports/" not in result.stdout


def test_without_prefix_and_names_of_its_own(beside: Callable[..., User]) -> None:
    """The other way to write it: the user's first rule is what `snakemake` makes, and sees nothing of this one."""
    shown = """rule shown:
    input:
        "results/builtin/dots/lightfield.h5",
    output:
        "shown.txt",
    shell:
        "env > {output}"
"""
    plain = beside(
        "samples: [a]",
        ("module sepi:", f"{shown}\n\nmodule sepi:"),
        ('config["sepi"]', '{"builtin": {"scenes": ["dots"], "size": 64}}'),
        ('    prefix:\n        "depth"\n', ""),
        ("use rule * from sepi as sepi_*", "use rule * from sepi exclude all"),
        ("    default_target: True\n", ""),
    )
    result = plain.run()
    assert result.returncode == 0, result.stdout
    seen = dict(line.partition("=")[::2] for line in (plain.folder / "shown.txt").read_text().splitlines())
    assert seen["PYTHONPATH"] == str(REPOSITORY)
    assert seen["PATH"] == os.environ["PATH"]


class TestFromElsewhere:
    """A Snakefile that Snakemake fetches, as it does from GitHub: without the package beside it."""

    @pytest.fixture
    def repository(self, tmp_path: Path) -> Path:
        """A repository with the Snakefile and the rules alone, in a folder, as Snakemake reads local repositories."""
        inside = tmp_path / "repository" / "sepi"
        shutil.copytree(REPOSITORY / "rules", inside / "rules")
        shutil.copy2(REPOSITORY / "Snakefile", inside)
        return inside.parent

    def fetching(self, repository: Path, beside: Callable[..., User]) -> User:
        """A workflow that takes its module from the repository as it is now."""
        git = ["git", "-C", str(repository), "-c", "user.name=nobody", "-c", "user.email=nobody@example.org"]
        for words in (["init", "--quiet"], ["add", "--all"], ["commit", "--quiet", "--message=all"], ["tag", "v1"]):
            subprocess.run([*git, *words], check=True)
        source = f'"git+file://{repository}/sepi/Snakefile@v1"'
        made = beside("sepi: {}")
        text = (made.folder / "Snakefile").read_text()
        made.write(re.sub(r"snakefile:\s+\S+", f"snakefile: {source}", text), "sepi: {}")
        return made

    def test_a_file_of_the_module_is_fetched_once(self, repository: Path, beside: Callable[..., User]) -> None:
        """A job reads a template of the remote workflow, and does not run again because Snakemake copied it anew."""
        fetched, target = self.fetching(repository, beside), "depth/reports/page/plan.json"
        result = fetched.run(target)
        assert result.returncode == 0, result.stdout
        assert "dots" in (fetched.folder / target).read_text()
        assert "Nothing to be done" in fetched.run("-n", target).stdout

    def test_another_version_is_told(self, repository: Path, beside: Callable[..., User]) -> None:
        """Rules of one version with commands of another would fail in the middle, or compute something else."""
        rules = repository / "sepi/rules/package.smk"
        rules.write_text(re.sub(r"^VERSION = .+$", 'VERSION = "99.1"', rules.read_text(), flags=re.MULTILINE))
        line = self.fetching(repository, beside).told()
        assert "/repository/sepi is of version 99.1, the installed package of version " in line
        assert "pip install sepi==99.1" in line

    def test_a_missing_package_is_told(self, repository: Path, beside: Callable[..., User]) -> None:
        """The first thing that someone meets who takes the module from GitHub."""
        fetched = self.fetching(repository, beside)
        snakefile = fetched.folder / "Snakefile"
        snakefile.write_text(f"import sys\n\nsys.modules['sepi'] = None\n\n{snakefile.read_text()}")
        line = fetched.told()
        assert "the Python package is not installed where Snakemake runs; pip install sepi==" in line
