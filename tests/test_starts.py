"""What a command loads before it does anything: a job of the workflow is often shorter than an import."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from sepi.scenes import render, write_hci

# what takes longer to import than many a job takes, and is not there in a help that must come at the speed of typing
SLOW = ("numpy", "scipy", "skimage", "matplotlib", "snakemake", "jinja2", "pandas")


def test_help_waits_for_no_library() -> None:
    """A list of the commands, or a flag looked up, at the speed of typing."""
    for words in (["--help"], ["depth", "--help"]):
        program = f"import sys\nfrom sepi.cli.main import main\nmain({words!r}, standalone_mode=False)\n"
        run_without_limits(f"{program}assert not {{*{SLOW!r}}} & {{*sys.modules}}")


# what a scheduler does, or a container
NARROW = "import os\nos.sched_setaffinity(0, {min(os.sched_getaffinity(0))})\n"
needs_affinity = pytest.mark.skipif(not hasattr(os, "sched_setaffinity"), reason="this system knows no affinity")


def run_without_limits(program: str, **environment: str) -> None:
    """Run a program that asserts something, with none of the limits on threads that these tests run under."""
    free = {name: value for name, value in os.environ.items() if not name.endswith("_NUM_THREADS")}
    free |= {"PYTHONPATH": str(Path(__file__).parents[1]), **environment}
    done = subprocess.run([sys.executable, "-c", program], env=free, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


@needs_affinity
def test_no_more_threads_than_were_given() -> None:
    """A scheduler gives a job one core of many: with more threads than that, its neighbours wait."""
    run_without_limits(
        f"{NARROW}from sepi.process.threads import threads_used, use_threads\n"
        "assert threads_used() == 1, threads_used()\n"
        "use_threads(64)\nassert threads_used() == 1, threads_used()"
    )


@pytest.mark.parametrize("before", ["", "import cv2\n"])
def test_threads_are_kept_to_whether_or_not_libraries_are_there(before: str) -> None:
    """Asked for one thread, a job must not take the cores of the jobs beside it."""
    run_without_limits(
        f"{before}from sepi.process.threads import threads_used, use_threads\nuse_threads(1)\nimport cv2\n"
        "assert (threads_used(), cv2.getNumThreads()) == (1, 1)"
    )


def test_the_api_can_be_imported_where_a_system_lacks_signals_and_limits() -> None:
    """Windows has no module ``resource``, no SIGHUP, no affinity and no /proc."""
    program = (
        "import os, signal, sys, psutil\n"
        "from pathlib import Path\n"
        "sys.modules['resource'] = None\n"
        "del signal.SIGHUP, os.sched_getaffinity\n"
        "import numpy, sepi, sepi.cli.main\n"
        "from sepi.process.command import peak_memory_mb, shown_errors\n"
        "from sepi.process.threads import available_cores\n"
        "field = sepi.LightField(numpy.zeros((3, 3, 8, 8, 3), numpy.uint8), 'a', "
        "disparity_range=sepi.DisparityRange(-1, 1, 'given'))\n"
        "with shown_errors():\n"
        "    assert sepi.estimate_depth(field, 'no_occlusion_no_textureless').disparity.shape == (8, 8)\n"
        "Path.read_text = lambda *_, **__: (_ for _ in ()).throw(OSError())\n"
        "assert peak_memory_mb() > 20\n"
        "assert available_cores() >= 1\n"
    )
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[1])}
    subprocess.run([sys.executable, "-c", program], env=environment, check=True)


@needs_affinity
def test_commands_take_the_cores_that_they_were_given(tmp_path: Path) -> None:
    """Without --threads, too; each library would take what it thinks that the machine has."""
    write_hci(render("dots", size=64, views=3), tmp_path / "dots")
    scene, out = str(tmp_path / "dots"), str(tmp_path / "out")
    program = (
        f"{NARROW}import sys\nfrom sepi.cli.main import main\n"
        f"for words in ['info', {scene!r}], ['check', {scene!r}], ['depth', {scene!r}, '-o', {out!r}]:\n"
        "    main(words, standalone_mode=False)\n"
        "    import cv2\n    from sepi.process.threads import threads_used\n"
        "    assert (threads_used(), cv2.getNumThreads()) == (1, 1), words"
    )
    run_without_limits(program)
