"""Measuring: a case in a process of its own, its median time and its peak memory."""

from __future__ import annotations

import json
import multiprocessing
import os
import signal
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field
from typing import Annotated, Any

from pydantic import Field

from sepi.command import megabytes, peak_memory_mb
from sepi.errors import SepiError
from sepi.threads import use_threads

Figures = dict[str, float]


@dataclass(frozen=True)
class Prepared:
    """A case whose inputs are available.

    Attributes
    ----------
    call : callable
        What is timed.
    figures : callable
        Takes what the last call returned; what is to be said of it (scores, residual, size). Not timed.
    """

    call: Callable[[], Any]
    figures: Callable[[Any], Figures] = lambda _: {}


@dataclass(frozen=True)
class Case:
    """Something to measure.

    Attributes
    ----------
    group, name : str
        Where its figures stand; together unique.
    prepare : callable
        A function of a module, called with ``arguments`` in the process of the case; returns a :class:`Prepared`.
    arguments : tuple
    figures : mapping of str to number
        What is known beforehand, such as the number of samples.
    threads : int
    once : bool
        Too long to be repeated: timed at its first call, which loads the compiled kernels too.
    """

    group: str
    name: str
    prepare: Callable[..., Prepared]
    arguments: tuple[Any, ...] = ()
    figures: Figures = field(default_factory=dict)
    threads: int = 1
    once: bool = False


@dataclass(frozen=True)
class Measurement:
    """What was measured of a case.

    Attributes
    ----------
    group, name : str
    seconds : tuple of float
        Of each repetition.
    peak_memory_mb : float
        Of the whole process: interpreter, libraries and inputs included.
    figures : mapping of str to number
        What was known beforehand, and what the case itself found (scores, residual, size).
    """

    group: str
    name: str
    seconds: Annotated[tuple[float, ...], Field(min_length=1)]
    peak_memory_mb: float
    figures: Figures = field(default_factory=dict)

    @property
    def median(self) -> float:
        """Median seconds."""
        return statistics.median(self.seconds)


def measured(case: Case, repeats: int) -> Measurement:
    """Measure a case in a fresh process: one call to load what is loaded once, then ``repeats`` timed ones.

    Raises
    ------
    SepiError
        If the case fails; the message is that of its error.
    """
    # forked from a process that has imported what all cases need and done nothing: none inherits another's memory
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(
        ["bench.plan", "sepi.matching.plane_sweep_kernels", "sepi.image.mean_shift", "skimage.segmentation"]
    )
    try:
        with ProcessPoolExecutor(1, context) as pool:
            future = pool.submit(_measure, case, repeats)
            try:
                seconds, memory, figures = future.result()
            except KeyboardInterrupt:
                for process in multiprocessing.active_children():
                    process.terminate()
                raise
    except Exception as error:
        reason = " ".join(f"{type(error).__name__}: {error}".split())
        raise SepiError(f"benchmark {case.group}, {case.name}: {reason}") from error
    return Measurement(case.group, case.name, tuple(seconds), memory, {**case.figures, **figures})


def _measure(case: Case, repeats: int) -> tuple[list[float], float, Figures]:
    """In the new process: prepare and call; seconds of each call, peak memory in MB and figures."""
    use_threads(case.threads)
    prepared = case.prepare(*case.arguments)
    if not case.once:
        prepared.call()
    seconds, result = [], None
    for _ in range(1 if case.once else repeats):
        started = time.perf_counter()
        result = prepared.call()
        seconds.append(time.perf_counter() - started)
    return seconds, peak_memory_mb(), prepared.figures(result)


# a process of its own, since a new process inherits the peak memory of the one that starts it
_STARTER = """
import json, resource, subprocess, sys, time
started = time.perf_counter()
code = subprocess.run(sys.argv[1:], stdout=subprocess.DEVNULL).returncode
seconds = time.perf_counter() - started
print(json.dumps([seconds, resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss, code]))
"""


def measured_command(group: str, name: str, arguments: Sequence[str], repeats: int) -> Measurement:
    """Measure a Python command as a user would: the whole process from start to end; once before, to warm the disk.

    Raises
    ------
    SepiError
        If it fails; the message holds its last words.
    """
    seconds, peaks = [], []
    for _ in range(repeats + 1):
        command = [sys.executable, "-I", "-S", "-c", _STARTER, sys.executable, *arguments]
        said, complained = _output(command)
        taken, peak, code = json.loads(said)
        if code:
            raise SepiError(f"benchmark {group}, {name}: {' '.join(complained.split()[-40:])}")
        seconds.append(taken)
        peaks.append(megabytes(peak))
    return Measurement(group, name, tuple(seconds[1:]), max(peaks))


def _output(command: Sequence[str]) -> tuple[str, str]:
    """What a command prints and complains; nothing that it started is left running when this is interrupted."""
    process = subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True
    )
    try:
        return process.communicate()
    except BaseException:
        os.killpg(process.pid, signal.SIGKILL)
        process.communicate()
        raise
