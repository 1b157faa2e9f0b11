"""The workflow on a real Slurm: as few submissions as scenes, the bytes of a local run, its faults told and mended."""

import os
import re
import shutil
import signal
import subprocess
import tempfile
from collections.abc import Iterator
from dataclasses import replace
from datetime import datetime
from hashlib import sha256
from pathlib import Path

import pytest
from one_node import one_node_slurm, queue, why_not
from workflow_copy import SIZE, SLOW_WRITING, TINY, Workflow, copy_of_the_project, edited, files_below, wait_for

from sepi.scenes import render, write_hci

pytestmark = [pytest.mark.workflow, pytest.mark.slow]

CORES = 2
SCENES = ("one", "two")
TARGETS = tuple(f"results/hci/{scene}/paper/result.h5" for scene in SCENES)
# a part of them, of two jobs
SHORT_TARGETS = tuple(f"results/hci/{scene}/stages/sepi/initial.h5" for scene in SCENES)
# the executor waits 10 seconds longer each time that it has looked at what was submitted: it looks after 5, 20 and 45
# seconds at all jobs of a scene, after 2, 14 and 36 at a few
ALL_JOBS = ("--slurm-init-seconds-before-status-checks", "5")
# what a run writes anew each time it makes a file
TIMES = ".time.json"


@pytest.fixture(scope="module")
def slurm() -> Iterator[None]:
    """A Slurm of one node; where it cannot be, a skipped test, or a failed one where it is required."""
    lacking = why_not()
    if lacking is not None:
        if os.environ.get("SEPI_REQUIRE_SLURM"):
            pytest.fail(f"a one-node Slurm is required here (SEPI_REQUIRE_SLURM): {lacking}")
        pytest.skip(f"no one-node Slurm: {lacking}")
    # the path of a socket may be no longer than 107 bytes, and only root may write on the way to it
    folder = Path(tempfile.mkdtemp(prefix="slurm-", dir="/run"))
    try:
        with one_node_slurm(folder / "node", CORES):
            yield
    finally:
        shutil.rmtree(folder)


@pytest.fixture(scope="module")
def workflow(tmp_path_factory: pytest.TempPathFactory) -> Workflow:
    """Two tiny scenes, and a copy of the workflow."""
    root = tmp_path_factory.mktemp("cluster")
    for name in SCENES:
        write_hci(render("dots", size=SIZE, views=3), root / "scenes" / name)
    config = TINY | {"builtin": {"scenes": []}, "hci_root": str(root / "scenes")}
    return Workflow(copy_of_the_project(root / "tree"), root / "cluster", config)


@pytest.fixture(scope="module")
def local(workflow: Workflow) -> Workflow:
    """A run on this machine, without Slurm."""
    local = replace(workflow, folder=workflow.folder.with_name("local"))
    result = local.run(*TARGETS)
    assert result.returncode == 0, result.stdout
    return local


@pytest.fixture(scope="module")
def expected(local: Workflow) -> dict[str, str]:
    """What it made."""
    return digests(local)


def flags(workflow: Workflow) -> tuple[str, ...]:
    """The profile, on a cluster without accounting, and looking sooner at what was submitted."""
    return (
        *("--workflow-profile", str(workflow.tree / "profiles" / "slurm"), "--cores", str(CORES)),
        *("--resources", "mem_mb=4000", "--retries", "0", "--slurm-status-command", "squeue"),
        *("--slurm-init-seconds-before-status-checks", "2"),
    )


def on_slurm(workflow: Workflow, *targets: str, more: tuple[str, ...] = ()) -> subprocess.CompletedProcess[str]:
    return workflow.run(*targets, flags=(*flags(workflow), *more))


def digests(workflow: Workflow) -> dict[str, str]:
    """File below results/ to what it holds."""
    results = workflow.folder / "results"
    files = [path for path in files_below(results) if not path.name.endswith(TIMES)]
    return {str(path.relative_to(results)): sha256(path.read_bytes()).hexdigest() for path in files}


def seconds_until_told(workflow: Workflow, stdout: str) -> float:
    """From the last words of the one job that failed to when the run tells of it; logs of others are not kept."""
    (log,) = (workflow.folder / ".snakemake" / "slurm_logs").rglob("*.log")
    told = re.search(r"\[(.+)\]\n.*Error in group", stdout)
    assert told, stdout
    return datetime.strptime(told[1], "%a %b %d %H:%M:%S %Y").timestamp() - log.stat().st_mtime


@pytest.mark.system
def test_a_scene_is_one_submission_with_a_local_runs_bytes(
    slurm: None, workflow: Workflow, expected: dict[str, str]
) -> None:
    """Submitted one by one, six jobs of a second each take minutes in a queue."""
    result = on_slurm(workflow, *TARGETS, more=ALL_JOBS)
    assert result.returncode == 0, result.stdout
    assert len(re.findall("has been submitted with SLURM jobid", result.stdout)) == len(SCENES)
    assert digests(workflow) == expected
    assert "Nothing to be done" in on_slurm(workflow, *TARGETS).stdout


@pytest.mark.system
def test_a_failing_job_is_told_within_a_minute(slurm: None, workflow: Workflow) -> None:
    """Otherwise one waits for a run that cannot end well; the other scene is made all the same."""
    picture = Path(workflow.config["hci_root"]) / "one" / "input_Cam004.png"
    whole = picture.read_bytes()
    failing = replace(workflow, folder=workflow.folder.with_name("failing"))
    try:
        picture.write_bytes(whole[: len(whole) // 2])
        result = on_slurm(failing, *SHORT_TARGETS)
    finally:
        picture.write_bytes(whole)
    assert result.returncode != 0
    assert f"sepi: {picture}: not a PNG, or damaged or cut off" in result.stdout
    assert seconds_until_told(failing, result.stdout) < 60
    assert [(failing.folder / target).exists() for target in SHORT_TARGETS] == [False, True]
    mended = on_slurm(failing, *SHORT_TARGETS)
    assert mended.returncode == 0, mended.stdout


@pytest.mark.faults
def test_a_killed_run_goes_on_where_it_was(slurm: None, workflow: Workflow, expected: dict[str, str]) -> None:
    """What was submitted is still in the queue; taken from it as documented, nothing of it disturbs the next run."""
    killed = replace(workflow, folder=workflow.folder.with_name("killed"))
    files = killed.tree / "sepi" / "io" / "files.py"
    with edited(files, "temporary.replace(path)", SLOW_WRITING):
        process = killed.start(*TARGETS, flags=flags(killed), SLEEP="3")
        wait_for(lambda: list((killed.folder / "results").rglob("lightfield.h5")))
        process.send_signal(signal.SIGKILL)
        process.wait()
        assert queue() != []
        subprocess.run(["scancel", *(f"--name={name}" for name in set(queue()))], check=True)
        wait_for(lambda: queue() == [])
        on_slurm(killed, *TARGETS, more=("--unlock",))
        result = on_slurm(killed, *TARGETS)
    assert result.returncode == 0, result.stdout
    assert digests(killed) == expected
