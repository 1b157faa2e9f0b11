"""Measurement of a case in its own process: median time and peak memory; and the file of all results."""

from __future__ import annotations

import multiprocessing
import signal
import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple

from pydantic import Field, TypeAdapter, ValidationError

from sepi.errors import SepiError
from sepi.process.command import peak_memory_mb, use_memory_again
from sepi.process.threads import use_threads

Figures = dict[str, float]

PEAK_MEMORY = "peak_memory_mb"
"""Figure of a case whose work is done by a process that it starts."""


class Prepared(NamedTuple):
    """A case whose inputs are available.

    Attributes
    ----------
    call : callable
        The timed function.
    figures : callable
        Function from the last call's result to figures (scores, residual, size); not timed.
    """

    call: Callable[[], Any]
    figures: Callable[[Any], Figures] = lambda _: {}


@dataclass(frozen=True)
class Case:
    """A case to measure.

    Attributes
    ----------
    group, name : str
        Names of its figures; together unique.
    prepare : callable
        A function of a module, called with ``arguments`` in the process of the case; returns a :class:`Prepared`.
    arguments : tuple
    figures : mapping of str to number
        Figures known beforehand, such as the number of candidates.
    threads : int or None
        None: those of the run.
    most : int
        Most timed calls. With 1, the first call is timed, for cases too long to be repeated.
    """

    group: str
    name: str
    prepare: Callable[..., Prepared]
    arguments: tuple[Any, ...] = ()
    figures: Figures = field(default_factory=dict)
    threads: int | None = None
    most: int = 1000


@dataclass(frozen=True)
class Measurement:
    """Measurements of a case.

    Attributes
    ----------
    group, name : str
    seconds : tuple of float
        Seconds of each repetition.
    peak_memory_mb : float
        Peak memory of the whole process, with interpreter, libraries and inputs.
    figures : mapping of str to number
        Figures known beforehand, and those of the case (scores, residual, size).
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


@dataclass(frozen=True)
class Result:
    """Result of a run, the content of ``bench.json``.

    Attributes
    ----------
    machine : mapping
        Processor, cores and versions; no names of hosts or users.
    settings : mapping
        Scene, size, views, num_disparities, threads, repeats.
    measurements : tuple of Measurement
    format : int
        Version of the file's format.
    """

    machine: dict[str, Any]
    settings: dict[str, Any]
    measurements: tuple[Measurement, ...]
    format: Literal[1] = 1

    def group(self, name: str) -> dict[str, Measurement]:
        """Measurements of one group by name."""
        return {m.name: m for m in self.measurements if m.group == name}

    def as_json(self) -> str:
        """The text of the file."""
        return _RESULT.dump_json(self, indent=1).decode() + "\n"


_RESULT = TypeAdapter(Result)


def read_result(path: Path) -> Result:
    """The result in a file.

    Raises
    ------
    SepiError
        If the file is not a benchmark's result.
    """
    try:
        return _RESULT.validate_json(path.read_bytes())
    except ValidationError as error:
        reason = error.errors()[0]["msg"]
        raise SepiError(f"{path}: not a benchmark's result (expected the JSON that `run` wrote): {reason}") from error


def measured(case: Case, repeats: int, threads: int = 1) -> Measurement:
    """Measurements of a case in a new process: an untimed call to load modules, then ``repeats`` timed ones.

    Raises
    ------
    SepiError
        If the case fails; the message is that of its error.
    """
    # forked from a process that has only imported modules, so that no case inherits another's memory
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(["bench.cases", "sepi.kernels", "sepi.image.mean_shift", "skimage.segmentation"])
    try:
        with ProcessPoolExecutor(1, context) as pool:
            try:
                # the case may run before this returns
                return pool.submit(_measure, case, repeats, threads).result()
            except KeyboardInterrupt:
                for process in multiprocessing.active_children():
                    process.terminate()
                raise
    except Exception as error:
        reason = " ".join(f"{type(error).__name__}: {error}".split())
        raise SepiError(f"benchmark {case.group}, {case.name}: {reason}") from error


def _measure(case: Case, repeats: int, threads: int) -> Measurement:
    """Prepare and call a case, in the new process."""
    # as in the command
    use_memory_again()
    use_threads(case.threads or threads)
    prepared = case.prepare(*case.arguments)
    if case.most > 1:
        prepared.call()
    seconds, result = [], None
    for _ in range(min(repeats, case.most)):
        started = time.perf_counter()
        result = prepared.call()
        seconds.append(time.perf_counter() - started)
    memory = peak_memory_mb()
    figures = {**case.figures, **prepared.figures(result)}
    return Measurement(case.group, case.name, tuple(seconds), figures.pop(PEAK_MEMORY, memory), figures)


# runs the named module like `python -m`, and prints its peak memory at the end
_MODULE = """
import atexit, runpy, sys
from sepi.process.command import peak_memory_mb
atexit.register(lambda: print(peak_memory_mb(), file=sys.stderr))
del sys.argv[0]
runpy.run_module(sys.argv[0], run_name="__main__", alter_sys=True)
"""


def command(*arguments: str) -> Prepared:
    """A Python module with arguments, run as a whole process."""
    # an exception on interruption also ends the process that it waits for
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))

    def call() -> str:
        done = subprocess.run([sys.executable, "-c", _MODULE, *arguments], capture_output=True, text=True, check=False)
        if done.returncode:
            raise SepiError(" ".join(done.stderr.split()[-40:]))
        return done.stderr

    return Prepared(call, lambda said: {PEAK_MEMORY: float(said.split()[-1])})
