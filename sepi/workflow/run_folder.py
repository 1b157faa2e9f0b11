"""The folder that a run of the workflow works in; a run that was killed there does not block the next one.

Snakemake locks the folder by files, which outlive a run that ends by force; it cannot tell them from those of a run
that goes on. A lock of the operating system ends with its process, whatever ends that.

Snakemake also refuses inputs dated in the future, as a clock leaves them that was ahead and was set right.
"""

from __future__ import annotations

import os
import platform
import shutil
import sys
import time
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path
from typing import TextIO

from sepi.io.files import is_temporary, remove_temporary

_STATE = Path(".snakemake")
# bytes
_NEARLY_FULL = 100_000_000
# second line of the file that each run holds
_WELL = "ended well"
# the operating system's lock is held for as long as this is open, until the process ends: shared with runs of --nolock
_held: list[TextIO] = []


def take_over(folder: Path, made: Iterable[Path]) -> bool:
    """Put away what the last run here left if it did not end well: its lock, and files that it had begun to write.

    Files of the future, of a clock that was ahead, become of the present. Nothing is done where another run goes on, or
    may go on: one of another machine, or on a file system that knows no locks. To be called once by a run, before it
    asks Snakemake for the folder.

    Parameters
    ----------
    folder : Path
        Where Snakemake runs.
    made : iterable of Path
        Folders in which the run's files are.

    Returns
    -------
    bool
        Whether the last run was killed.
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
    _held.append(run)
    try:
        fcntl.flock(run, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        # not alone, but others shall know of this one
        _share(run)
        return False
    run.seek(0)
    before, machine = run.read().splitlines(), platform.node()
    locks = [path for path in (state / "locks").glob("*.lock") if path.is_file()]
    # without a lock of its own here, the run that locked the folder may be of another machine, or of older code
    killed = bool(locks) and before[:1] == [machine]
    if killed:
        for path in locks:
            path.unlink(missing_ok=True)
    if not locks or killed:
        # each job ends with a change of the metadata: to look at all files takes long where there are many
        now = time.time()
        if _WELL not in before or any(_is_to_come(state / name, now) for name in ("metadata", "run_of_sepi")):
            tidy_up(made)
        note_run(well=True)
    _share(run)
    return killed


def _share(run: TextIO) -> None:
    """Let other runs hold the folder, too; no one else may then put files away."""
    import fcntl

    try:
        fcntl.flock(run, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except OSError:
        _held.remove(run)
        run.close()


def put_away(made: Iterable[Path]) -> None:
    """Tidy up after a run that failed, unless another one goes on in the folder, or may."""
    for run in list(_held):
        import fcntl

        with suppress(OSError):
            fcntl.flock(run, fcntl.LOCK_EX | fcntl.LOCK_NB)
            tidy_up(made)
        _share(run)


def note_run(well: bool) -> None:
    """Record the owner of this run, and whether it has so far left nothing to clean up."""
    for run in _held:
        run.truncate(0)
        run.write(f"{platform.node()}\n{_WELL if well else ''}\n")
        run.flush()


def say_so() -> None:
    """Tell that a run was killed, and what of it may go on."""
    print(
        "sepi: the last run here was killed; going on where it was (what it submitted to a cluster may still be there: "
        "look with the cluster's tools, such as squeue --me)",
        file=sys.stderr,
        flush=True,
    )


def _is_to_come(path: Path, now: float) -> bool:
    """Whether a file or folder was changed at a time that is yet to come: the clock was set back since."""
    return os.path.lexists(path) and path.lstat().st_mtime > now


def say_if_full(folder: Path) -> None:
    """Tell that a disk is nearly full: a job may have failed of that, and found no room to say so."""
    free = shutil.disk_usage(folder).free
    if free < _NEARLY_FULL:
        print(f"sepi: {folder.resolve()}: only {free / 1e6:.0f} MB are free on this disk", file=sys.stderr, flush=True)


def tidy_up(folders: Iterable[Path]) -> None:
    """Remove the files that jobs had begun to write when they were killed, and let no file be of the future.

    Those that were become all of one time, so that none is older than what it was made of. To be called where no job
    runs.
    """
    now = time.time()
    for folder in folders:
        # a folder may go while it is looked at
        with suppress(OSError):
            for path in list(folder.rglob("*")):
                if is_temporary(path):
                    remove_temporary(path)
                elif _is_to_come(path, now):
                    os.utime(path, (now, now), follow_symlinks=False)
