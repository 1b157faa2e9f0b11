"""A copy of the workflow and the package that a test may run, and change, in a folder of its own."""

import os
import re
import shutil
import signal
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any
from unittest import mock

import yaml
from snakemake_runs import run_snakemake

from sepi.variants import STAGES

REPOSITORY = Path(__file__).parents[1]
SIZE = 64
# few candidates: the result does not matter here
TINY = {
    "builtin": {"scenes": ["dots"], "size": SIZE},
    "stages": {
        "initial": {choice: {"num_disparities": 21} for choice in ("sepi", "semi_global")},
        "occlusion": {choice: {"num_disparities": 21} for choice in ("half_sepi", "wang")}
        | {"visibility": {"num_disparities": 21, "passes": 1}},
    },
}

# in place of what renames a finished file: as many seconds later as the environment says, and not while a file is there
SLOW_WRITING = """import os, time
        is_result = path.suffix == ".h5"
        time.sleep(is_result * float(os.environ.get("SLEEP", "0")))
        while is_result and os.path.exists(os.environ.get("HOLD", "")):
            time.sleep(0.05)
        temporary.replace(path)"""
# what makes maps
_STAGE_RULES = ("ingest", *STAGES)


@dataclass(frozen=True)
class Workflow:
    """A copy of the workflow and the package, and a folder to run it in."""

    tree: Path
    folder: Path
    config: dict[str, Any]

    def words(self, *targets: str, flags: tuple[str, ...] = ()) -> list[str]:
        """What Snakemake is called with for this configuration."""
        self.folder.mkdir(exist_ok=True)
        config = self.folder / "config.yaml"
        config.write_text(yaml.safe_dump(self.config, sort_keys=False))
        return ["--snakefile", str(self.tree / "Snakefile"), "--configfile", str(config), *flags, "--", *targets]

    def command(self, *targets: str, flags: tuple[str, ...] = ()) -> list[str]:
        """Snakemake with this configuration, as a program."""
        return [sys.executable, "-m", "snakemake", *self.words(*targets, flags=flags)]

    @property
    def environment(self) -> dict[str, str]:
        """Environment in which the copy of the package is the one imported."""
        return os.environ | {"PYTHONPATH": str(self.tree)}

    def run(
        self, *targets: str, flags: tuple[str, ...] = (), python: str = sys.executable, **environment: str
    ) -> subprocess.CompletedProcess[str]:
        """Run Snakemake to its end, jobs by some Python; stdout holds its messages too."""
        return run_snakemake(self.words(*targets, flags=flags), self.folder, self.environment | environment, python)

    def start(self, *targets: str, flags: tuple[str, ...] = (), **environment: str) -> subprocess.Popen[bytes]:
        """Run Snakemake beside the test, in a session of its own, as a terminal does."""
        return subprocess.Popen(
            self.command(*targets, flags=flags),
            cwd=self.folder,
            env=self.environment | environment,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
            # a background process of a shell ignores SIGINT; a user's does not
            preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
        )

    def plan(self, *targets: str) -> dict[str, int]:
        """Rule to number of jobs that a run would have; asked in this process where the package is the tests' own."""
        if self.tree == REPOSITORY:
            return dict(Counter(job.rule.name for job in self.jobs(*targets)))
        result = self.run(*targets, flags=("--dry-run",))
        assert result.returncode == 0, result.stdout
        return planned(result.stdout)

    @contextmanager
    def _read(self) -> Iterator[Any]:
        """Snakemake's own object for the workflow, for a dry run."""
        from snakemake.api import SnakemakeApi
        from snakemake.settings.types import ConfigSettings, OutputSettings, Quietness, ResourceSettings

        self.folder.mkdir(exist_ok=True)
        before = Path.cwd()
        output = OutputSettings(quiet={Quietness.ALL}, dryrun=True)
        # what the rules set for their jobs ends with them
        with mock.patch.dict(os.environ), SnakemakeApi(output) as api:
            try:
                yield api.workflow(
                    ResourceSettings(cores=2),
                    ConfigSettings(config=self.config),
                    snakefile=self.tree / "Snakefile",
                    workdir=self.folder,
                )
            finally:
                os.chdir(before)

    def read(self) -> Any:
        """The rules, and the functions and settings of their files ("globals"), as Snakemake reads them."""
        with self._read() as workflow:
            return workflow._workflow

    def jobs(self, *targets: str) -> list[Any]:
        """The jobs that a run would have, as Snakemake plans them in this process."""
        from snakemake.settings.types import DAGSettings, ExecutionSettings, SchedulingSettings

        with self._read() as workflow:
            workflow.dag(DAGSettings(targets=set(targets))).execute_workflow(
                executor="dryrun",
                execution_settings=ExecutionSettings(),
                scheduling_settings=SchedulingSettings(scheduler="greedy"),
            )
            return list(workflow._workflow.dag.needrun_jobs(exclude_finished=False))

    def stage_plan(self, *targets: str) -> dict[str, int]:
        """The plan without what comes after the stages (scores, tables, maps)."""
        return of_stages(self.plan(*targets))

    def with_config(self, **values: Any) -> "Workflow":
        """The same workflow with other values of some keys."""
        return replace(self, config=self.config | values)


def planned(stdout: str) -> dict[str, int]:
    """Rule to number of jobs, of what a dry run prints."""
    if "Nothing to be done" in stdout:
        return {}
    table = stdout.split("Job stats:")[1].split("total")[0]
    return {rule: int(count) for rule, count in re.findall(r"^(\w+) +(\d+)$", table, re.MULTILINE)}


def of_stages(plan: dict[str, int]) -> dict[str, int]:
    """A plan without what comes after the stages."""
    return {rule: count for rule, count in plan.items() if rule in _STAGE_RULES}


def copy_of_the_project(folder: Path) -> Path:
    """Snakefile, rules and package; the package's kernels as they were built."""
    for name in ("sepi", "rules", "profiles"):
        shutil.copytree(REPOSITORY / name, folder / name)
    for name in ("Snakefile", "config.yaml"):
        shutil.copy2(REPOSITORY / name, folder / name)
    return folder


@contextmanager
def edited(path: Path, old: str, new: str) -> Iterator[None]:
    """A file with a replacement, for a while."""
    text, times = path.read_text(), path.stat()
    assert old in text
    path.write_text(text.replace(old, new, 1))
    try:
        yield
    finally:
        path.write_text(text)
        os.utime(path, ns=(times.st_atime_ns, times.st_mtime_ns))


def files_below(folder: Path) -> list[Path]:
    """Every file, hidden ones too."""
    return [path for path in folder.rglob("*") if path.is_file()]


def wait_for(condition: Any, seconds: float = 60) -> None:
    """Wait until a condition holds."""
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "timed out"
        time.sleep(0.05)
