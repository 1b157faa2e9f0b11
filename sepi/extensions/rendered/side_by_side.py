"""Path-traced scenes rendered in parallel, since the start and the end of each use one core only."""

from __future__ import annotations

import json
import math
import os
import subprocess
import sys
import time
from collections.abc import Generator, Sequence
from pathlib import Path

import click

from sepi.errors import SepiError
from sepi.extensions.rendered.options import RenderOptions
from sepi.extensions.rendered.rendering import views_done
from sepi.process.command import WORKFLOW_PROCESS, progress_bar
from sepi.process.threads import available_cores

# number of scenes at a time; each of full size takes 3 GB
_MOST = 2
# seconds between updates of the progress bar
_PAUSE = 0.2


def render_scenes(names: Sequence[str], options: RenderOptions, folder: Path) -> Generator[str]:
    """Render scenes into files ``NAME.h5``, each in its own process, with a progress bar.

    Parameters
    ----------
    names : sequence of str
        Keys of :data:`sepi.extensions.rendered.RENDERED`.
    options : RenderOptions
    folder : Path
        Folder of the files. Finished views lie in folders beside them until a scene is complete.

    Yields
    ------
    str
        Name of each scene as soon as it is finished.

    Raises
    ------
    SepiError
        If a scene cannot be rendered; the others stop, and a later run continues them.
    """
    waiting, running = list(names), dict[str, subprocess.Popen[str]]()
    cores, done = available_cores(), 0
    most = min(_MOST, cores, len(waiting))
    try:
        while waiting or running:
            while waiting and len(running) < most:
                name = waiting.pop(0)
                # the last scene soon has the cores to itself
                running[name] = _started(name, options, folder, cores // most if waiting else cores)
            with progress_bar(", ".join(running)) as progress:
                while all(process.poll() is None for process in running.values()):
                    part = sum(views_done(folder / f"{name}.h5") for name in running) / math.prod(options.grid)
                    progress((done + part) / len(names))
                    time.sleep(_PAUSE)
            name = next(name for name, process in running.items() if process.poll() is not None)
            _require_done(name, running.pop(name))
            done += 1
            yield name
    finally:
        for process in running.values():
            process.terminate()
        for process in running.values():
            process.communicate()


def _started(name: str, options: RenderOptions, folder: Path, threads: int) -> subprocess.Popen[str]:
    """A process that renders one scene, and ends when this one does."""
    settings = [f"--set={key}={json.dumps(value)}" for key, value in options.model_dump(mode="json").items()]
    words = [name, f"--threads={threads}", *settings, f"--output={folder / name}.h5"]
    return subprocess.Popen(
        [sys.executable, "-m", "sepi.extensions.rendered.command", *words],
        env={**os.environ, WORKFLOW_PROCESS: str(os.getpid())},
        stderr=subprocess.PIPE,
        text=True,
    )


def _require_done(name: str, process: subprocess.Popen[str]) -> None:
    """Raise the error of a process that has ended, or print its warnings."""
    told = process.communicate()[1].strip()
    if process.returncode < 0:
        raise SepiError(f"{name}: signal {-process.returncode} ended its process; the next run continues from here")
    if process.returncode:
        raise SepiError(told.removeprefix("sepi: ") or f"{name}: exit code {process.returncode}")
    if told:
        click.echo(told, err=True)
