"""The folder that a run of the workflow works in: what a run that was killed left there does not stop the next one.

Snakemake locks the folder by files, which outlive a run that ends by force; it cannot tell them from those of a run
that goes on. A lock of the operating system ends with its process, whatever ends that.
"""

from __future__ import annotations

import platform
import sys
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path
from typing import TextIO

from sepi.io.files import is_temporary, remove_temporary

_STATE = Path(".snakemake")
# the operating system's lock is held for as long as this is open: until the process ends
_held: list[TextIO] = []


def take_over(folder: Path, made: Iterable[Path]) -> bool:
    """Put away what a run that was killed here left: its lock, and files that it had begun to write.

    Nothing is done where another run goes on, or may go on: one of another machine, or on a file system that knows no
    locks. To be called once by a run, before it asks Snakemake for the folder.

    Parameters
    ----------
    folder : Path
        Where Snakemake runs.
    made : iterable of Path
        Folders in which the run's files are.

    Returns
    -------
    bool
        Whether there was such a run.
    """
    try:
        import fcntl
    except ImportError:
        # not on this system: its users call snakemake --unlock
        return False
    state = folder / _STATE
    try:
        state.mkdir(exist_ok=True)
        run = (state / "run_of_sepi").open("a+", encoding="utf-8")
    except OSError:
        # what is wrong with the folder, Snakemake says
        return False
    try:
        fcntl.flock(run, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        run.close()
        return False
    _held.append(run)
    run.seek(0)
    before, machine = run.read().strip(), platform.node()
    locks = [path for path in (state / "locks").glob("*.lock") if path.is_file()]
    # without a lock of its own here, the run that locked the folder may be of another machine, or of older code
    killed = bool(locks) and before == machine
    if killed:
        for path in locks:
            path.unlink(missing_ok=True)
        remove_unfinished(made)
    if not locks or killed:
        run.truncate(0)
        run.write(f"{machine}\n")
        run.flush()
    return killed


def say_so() -> None:
    """Tell that a run was killed, and what of it may go on."""
    print(
        "sepi: the last run here was killed; going on where it was (what it submitted to a cluster may still be there: "
        "look with the cluster's tools, such as squeue --me)",
        file=sys.stderr,
        flush=True,
    )


def remove_unfinished(folders: Iterable[Path]) -> None:
    """Remove the files that jobs had begun to write when they were killed; to be called where no job runs."""
    for folder in folders:
        # a folder may go while it is looked at
        with suppress(OSError):
            for path in [path for path in folder.rglob(".*") if is_temporary(path)]:
                remove_temporary(path)
