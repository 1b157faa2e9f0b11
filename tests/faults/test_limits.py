"""Commands that get too little of what a machine has: one clear line, and nothing half written."""

import os
import resource
import subprocess
import sys
from pathlib import Path

import pytest

from sepi.scenes import render, write_hci

pytestmark = pytest.mark.system

COMMAND = [sys.executable, "-c", "import sys; from sepi.cli.main import main; sys.exit(main())", "depth"]


@pytest.mark.parametrize(
    "limit", [420, 460, 500, 700, *(pytest.param(n, marks=pytest.mark.faults) for n in (400, 440, 480, 600))]
)
@pytest.mark.real
@pytest.mark.skipif(sys.platform != "linux", reason="needs a limit on the address space that is kept")
def test_too_little_memory_is_one_line(hci: Path, tmp_path: Path, limit: int) -> None:
    """Not a traceback from inside a library, nor its abort; and a script sees that it failed.

    ``limit`` is of the address space, in MB: enough to start, not for the maps of a benchmark scene.
    """
    allowed = limit * 10**6
    result = subprocess.run(
        [*COMMAND, str(hci / "cotton"), "-o", str(tmp_path / "maps")],
        env=os.environ | {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"},
        capture_output=True,
        text=True,
        check=False,
        timeout=120,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (allowed, allowed)),
    )
    assert result.returncode == 1
    assert "Traceback" not in result.stderr
    assert result.stderr.splitlines()[-1].startswith("sepi: not enough memory")
    assert list(tmp_path.iterdir()) == []


KERNEL = """
import resource
import numpy as np
from sepi.kernels import coarse_sweep
pictures, out = np.zeros((3, 512, 512), np.float32), np.zeros((4, 512, 512), np.float32)
offsets, candidates = np.ones((2, 2), np.float32), np.linspace(-1, 1, 200).astype(np.float32)
used = int(open("/proc/self/statm").read().split()[0]) * resource.getpagesize()
resource.setrlimit(resource.RLIMIT_AS, (used + 10**5,) * 2)
try:
    coarse_sweep.coarse_sweep(pictures[0], pictures[1:], offsets, candidates, 0.1, 1, out)
except MemoryError:
    print("told")
"""


@pytest.mark.parametrize("level", ["baseline", "of this processor"])
@pytest.mark.skipif(sys.platform != "linux", reason="needs a limit on the address space that is kept")
def test_a_kernel_without_memory_says_so(level: str) -> None:
    """An exception of one module must not be taken for one of the other, which knows none of its types."""
    env = os.environ | {"SEPI_KERNELS": level}
    result = subprocess.run([sys.executable, "-c", KERNEL], env=env, capture_output=True, text=True, check=False)
    assert result.stdout == "told\n", result.stderr


def test_few_file_handles_are_enough(tmp_path: Path) -> None:
    """A grid has hundreds of pictures, of which a system may let only few be open."""
    write_hci(render("dots", size=64, views=9), tmp_path / "dots")
    result = subprocess.run(
        [*COMMAND, "dots", "-o", "maps"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
        timeout=120,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_NOFILE, (16, 16)),
    )
    assert result.returncode == 0, result.stderr
