"""The workflow, killed at random moments: the next run makes what an undisturbed one does.

`make test-system` looks whether a job ends with its workflow, `make faults` does the rest. ``SEPI_FAULTS`` says how
many kills; `make faults` asks for a hundred.
"""

import os
import random
import sys
import time
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import psutil
import pytest
from one_scene import TARGET, healed, made, unlock
from workflow_copy import SLOW_WRITING, Workflow, edited, files_below, wait_for

from sepi.io.files import is_temporary

pytestmark = [pytest.mark.workflow, pytest.mark.slow]

KILLS = int(os.environ.get("SEPI_FAULTS", "3"))
# finished runs of the scene between two whose report is made and killed, too
REPORT_EVERY = 4
# seconds within which a run is killed
LONGEST = 12.0
# what is killed: the workflow, a job's shell, or what that started
VICTIMS = ("workflow", "job", "child")


def victim(run: psutil.Process, kind: str) -> psutil.Process:
    """The process to kill; the workflow itself where it has no job at the moment."""
    jobs = run.children()
    if kind == "workflow" or not jobs:
        return run
    job = random.choice(jobs)
    below = job.children(recursive=True) if kind == "child" else []
    return random.choice(below) if below else job


def killed_runs(workflow: Workflow, target: str, kills: int) -> Iterator[str]:
    """Begin a run as often as it takes for so many to be killed; what was killed of each."""
    for number in range(kills):
        unlock(workflow)
        process = workflow.start(target)
        time.sleep(random.uniform(0.5, LONGEST))
        kind = VICTIMS[number % len(VICTIMS)]
        with suppress(psutil.NoSuchProcess):
            victim(psutil.Process(process.pid), kind).kill()
        # one that only lost a job ends by itself
        process.wait(timeout=120)
        yield kind if process.returncode else "nothing"


@pytest.mark.faults
def test_killed_at_any_moment(undisturbed: Workflow) -> None:
    """However often; and the documented way to go on is to start again."""
    random.seed(KILLS)
    disturbed = replace(undisturbed, folder=undisturbed.folder.with_name("disturbed"))
    expected, left, runs = made(undisturbed), KILLS, 0
    while left:
        # several kills on the way to one finished run, then from the start
        in_a_row = min(left, random.randint(1, 3))
        told = list(killed_runs(disturbed, TARGET, in_a_row))
        healed(disturbed, expected, told=told)
        if runs % REPORT_EVERY == REPORT_EVERY - 1:
            # all that a report needs of the scene is there: what is killed now are the jobs of the report
            told = list(killed_runs(disturbed, "all", 1))
            unlock(disturbed)
            result = disturbed.run("all")
            assert result.returncode == 0, (told, result.stdout)
            assert made(disturbed).items() >= expected.items(), told
            assert disturbed.plan("all") == {}
            left -= 1
        left = max(left - in_a_row, 0)
        runs += 1
        disturbed = replace(disturbed, folder=disturbed.folder.with_name(f"disturbed-{runs}"))


@pytest.mark.system
@pytest.mark.skipif(sys.platform != "linux", reason="only Linux tells a process that its parent is gone")
def test_a_job_ends_with_its_workflow(undisturbed_part: Workflow) -> None:
    """Otherwise it goes on beside the next run, and both write the same files."""
    lonely = replace(undisturbed_part, folder=undisturbed_part.folder.with_name("lonely"))

    def unfinished() -> list[Path]:
        return [path for path in files_below(lonely.folder / "results") if is_temporary(path)]

    with edited(lonely.tree / "sepi" / "io" / "files.py", "temporary.replace(path)", SLOW_WRITING):
        process = lonely.start(TARGET, SLEEP="60")
        wait_for(unfinished)
        process.kill()
        process.wait()
        # what it had begun to write, it removes
        wait_for(lambda: not unfinished(), seconds=15)
