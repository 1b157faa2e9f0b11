"""The workflow on a machine with faults: a clear line, nothing half written, and the next run heals.

`make test-system` fills a disk, `make faults` does the rest.
"""

import os
import re
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import pytest
from one_scene import PART, TARGET, healed, made, nothing_half_written
from workflow_copy import SIZE, Workflow, edited, files_below

from sepi.io.files import is_temporary
from sepi.scenes import render, write_hci

pytestmark = [pytest.mark.workflow, pytest.mark.slow]

# kilobytes of address space that the stages take before any of them has done anything
IMPORTS = """
import sepi.ingest, sepi.initial, sepi.occlusion, sepi.textureless, sepi.optimize
from sepi.process.command import stage_command
stage_command("initial", sepi.initial.CHOICES)
print(next(line.split()[1] for line in open("/proc/self/status") if line.startswith("VmPeak")))
"""


@contextmanager
def disk(folder: Path, kilobytes: int) -> Iterator[None]:
    """A disk of its own for a folder."""
    folder.mkdir()
    mount("-t", "tmpfs", "-o", f"size={kilobytes}k", "tmpfs", str(folder))
    try:
        yield
    finally:
        # also while a job that was ended still has it open
        subprocess.run(["umount", "--lazy", str(folder)], check=True)


def mount(*words: str) -> None:
    """Mount; where that is not allowed the test is skipped."""
    if sys.platform != "linux":
        pytest.skip("mounts a small disk, as Linux does it")
    result = subprocess.run(["mount", *words], check=False, capture_output=True, text=True)
    if result.returncode:
        pytest.skip(f"a small disk cannot be mounted here (as root it can): {result.stderr.strip()}")


def kilobytes_of(workflow: Workflow) -> int:
    """What a whole run takes of a disk."""
    return sum(-(-path.stat().st_size // 4096) * 4 for path in files_below(workflow.folder))


@pytest.mark.parametrize(
    ("percent", "run", "target"),
    [
        pytest.param(30, "undisturbed_part", PART, marks=pytest.mark.system, id="30"),
        pytest.param(80, "undisturbed", TARGET, marks=pytest.mark.faults, id="80"),
    ],
)
def test_a_disk_that_is_full(request: pytest.FixtureRequest, percent: int, run: str, target: str) -> None:
    """Half of a file under its own name would be taken for the whole by the next run."""
    undisturbed: Workflow = request.getfixturevalue(run)
    full = replace(undisturbed, folder=undisturbed.folder.with_name(f"full-{percent}"))
    whole = kilobytes_of(undisturbed)
    expected = made(undisturbed)
    with disk(full.folder, whole * percent // 100):
        result = full.run(target)
        assert result.returncode != 0
        assert "No space left on device" in result.stdout
        assert "Traceback" not in result.stdout
        assert nothing_half_written(full, expected)
        mount("-o", f"remount,size={4 * whole}k", str(full.folder))
        healed(full, expected, target)
        assert made(full) == expected


@pytest.mark.faults
def test_jobs_that_get_too_little_memory(undisturbed: Workflow, tmp_path: Path) -> None:
    """One line says so, not a traceback from inside a library; and with more memory the run goes on."""
    write_hci(render("curved_occluders", size=3 * SIZE, views=9), tmp_path / "scenes" / "box")
    config = undisturbed.config | {"hci_root": str(tmp_path / "scenes")}
    poor = replace(undisturbed, folder=tmp_path / "poor", config=config)
    one_thread = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
    imports = subprocess.run(
        [sys.executable, "-c", IMPORTS], env=os.environ | one_thread, check=True, capture_output=True, text=True
    )
    # and some for small maps
    limit = int(imports.stdout) + 20_000
    first = 'include: "rules/common.smk"'
    target = "results/hci/box/best/result.h5"
    with edited(poor.tree / "Snakefile", first, f"shell.prefix('ulimit -v {limit}; ')\n\n\n{first}"):
        result = poor.run(target, flags=("--cores", "1"), **one_thread)
    assert result.returncode != 0
    assert re.search("^sepi: not enough memory", result.stdout, re.MULTILINE), result.stdout
    assert "Traceback" not in result.stdout
    assert not [path for path in poor.folder.rglob(".*") if is_temporary(path)]
    again = poor.run(target, flags=("--cores", "1"))
    assert again.returncode == 0, again.stdout
