"""What every command has in common: one clear line for a user's error, a progress bar, and the command of a stage.

A stage module ends with ``stage_command("initial", CHOICES)()``: ``python -m sepi.initial`` is the command that the
workflow's rule calls.
"""

from __future__ import annotations

import functools
import json
import os
import signal
import sys
import threading
import time
import warnings
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path
from types import FrameType
from typing import IO, TYPE_CHECKING, Any

import click

from sepi.errors import SepiError, SepiWarning, one_line

# what only the commands of stages need is imported there: every command imports this module
if TYPE_CHECKING:
    from sepi.stage import Choice, Progress

# a workflow that stops its jobs; a terminal that is closed, which not all systems tell of
_ENDING = [getattr(signal, name) for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name)]


WORKFLOW_PROCESS = "SEPI_WORKFLOW_PROCESS"
"""Environment variable: number of the process that a command ends with; the workflow sets its own for its jobs."""

# Linux: the signal that a process gets when its parent is gone
_PR_SET_PDEATHSIG = 1
# glibc's settings, by their environment variables: how many heaps threads have; from how many bytes on what is freed
# goes back to the system at once; from how many on what is free at the end of a heap does
_HEAP = {
    "MALLOC_ARENA_MAX": (-8, 1),
    "MALLOC_MMAP_THRESHOLD_": (-3, 100_000_000),
    "MALLOC_TRIM_THRESHOLD_": (-1, 100_000_000),
}


class _Shown(click.ClickException):
    """A user's error as click shows it: ``sepi: MESSAGE`` on stderr, exit code 1."""

    def show(self, file: IO[Any] | None = None) -> None:
        click.echo(f"sepi: {self.format_message()}", file=file, err=file is None)


class SepiCommand(click.Command):
    """A click command that shows a :class:`SepiError` as one line and cleans up when it is terminated."""

    def invoke(self, ctx: click.Context) -> Any:
        """Run the command."""
        with shown_errors():
            use_memory_again()
            _end_with_the_workflow()
            return super().invoke(ctx)


bad_thresholds = click.option(
    "--bad",
    "thresholds",
    type=click.FloatRange(min=0, min_open=True),
    multiple=True,
    metavar="T",
    help="Score the pixels with a larger error than T pixels per view step, too; repeatable.",
)


class SepiGroup(click.Group):
    """A click group whose subcommands are :class:`SepiCommand`."""

    command_class = SepiCommand


def _end_with_the_workflow() -> None:
    """Where this is a job of the workflow, and the system can, ask to be ended when the workflow is."""
    workflow = os.environ.get(WORKFLOW_PROCESS)
    if workflow is None or sys.platform != "linux":
        return
    import ctypes

    with suppress(OSError, AttributeError):
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGTERM)
    # it may be gone already
    if os.getppid() == 1 and workflow != "1":
        sys.exit(128 + signal.SIGTERM)


def use_memory_again() -> None:
    """Have the C library give again what was freed, as far as it can and the user's environment does not say otherwise.

    glibc gives each thread a heap of its own, and what one has freed the others do not take again: 40 MB of a benchmark
    scene. Arrays it gives back at once, and to clear the pages of others takes a thirtieth of ``sepi depth``.
    """
    if sys.platform == "linux":
        import ctypes

        with suppress(OSError, AttributeError):
            for name, setting in _HEAP.items():
                if name not in os.environ:
                    ctypes.CDLL(None).mallopt(*setting)


@contextmanager
def shown_errors() -> Iterator[None]:
    """Turn :class:`SepiError` into a line without traceback, and signals into an exit that removes unfinished files.

    So does a path that the system refuses: a name that is too long, a folder that may not be read. A
    :class:`SepiWarning` becomes a line too, and the command goes on.
    """
    main = threading.current_thread() is threading.main_thread()
    before = {number: signal.signal(number, _exit_on_signal) for number in _ENDING} if main else {}
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("always", SepiWarning)
            shown = warnings.showwarning
            warnings.showwarning = functools.partial(_show_warning, shown)
            yield
    except SepiError as error:
        raise _Shown(str(error)) from error
    except OSError as error:
        if error.filename is None:
            raise
        raise _Shown(one_line(f"{error.filename}: {error.strerror}")) from error
    except Exception as error:
        if not _is_of_memory(error):
            raise
        raise _Shown(one_line(f"not enough memory ({str(error) or 'no more is to be had'})")) from error
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _is_of_memory(error: Exception) -> bool:
    """Whether there was too little memory, also for the stack of a thread, or within OpenCV."""
    cv2 = sys.modules.get("cv2")
    within_opencv = cv2 is not None and isinstance(error, cv2.error) and error.code == cv2.Error.StsNoMem
    return isinstance(error, MemoryError) or within_opencv or str(error) == "can't start new thread"


def _show_warning(
    shown: Callable[..., None], message: Warning | str, category: type[Warning], *where: Any, **more: Any
) -> None:
    if issubclass(category, SepiWarning):
        click.echo(f"sepi: warning: {message}", err=True)
    else:
        shown(message, category, *where, **more)


def _exit_on_signal(number: int, _: FrameType | None) -> None:
    # an exception, so that context managers remove their temporary files
    sys.exit(128 + number)


@contextmanager
def progress_bar(label: str) -> Iterator[Progress]:
    """A bar from 0 to 100 % on a terminal, silence elsewhere; yields the function to call with the fraction done."""
    if not sys.stderr.isatty():
        from sepi.stage import no_progress

        yield no_progress
        return
    from tqdm import tqdm

    with tqdm(total=100, desc=label, leave=False, bar_format="{desc} {percentage:3.0f}% |{bar}|") as bar:

        def progress(fraction: float) -> None:
            bar.update(round(100 * min(max(fraction, 0.0), 1.0)) - bar.n)

        yield progress


def peak_memory_mb() -> float:
    """The most memory that this process has held so far, MB."""
    with suppress(OSError, StopIteration):
        status = Path("/proc/self/status").read_text(encoding="ascii")
        # ru_maxrss below would start at what the parent held
        return next(int(line.split()[1]) for line in status.splitlines() if line.startswith("VmHWM")) / 2**10
    try:
        import resource

        return megabytes(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
    except ImportError:
        # Windows
        import psutil

        memory = psutil.Process().memory_info()
        return float(getattr(memory, "peak_wset", memory.rss)) / 2**20


def megabytes(maxrss: int) -> float:
    """A peak memory as the system states it (``ru_maxrss``), in MB."""
    return maxrss / (2**20 if sys.platform == "darwin" else 2**10)


def write_timing(path: Path, started: float, threads: int, **more: Any) -> None:
    """Write as JSON seconds since ``started`` (of ``time.perf_counter``), peak memory, machine, and what is given."""
    from sepi.io.files import atomic_path
    from sepi.machine import this_machine

    timing = {
        "seconds": round(time.perf_counter() - started, 3),
        "peak_memory_mb": round(peak_memory_mb(), 1),
        "threads": threads,
        "machine": this_machine(),
        **more,
    }
    with atomic_path(path) as temporary:
        temporary.write_text(json.dumps(timing) + "\n", encoding="utf-8")


def stage_command(stage: str, own: Mapping[str, Choice]) -> click.Command:
    """The command ``python -m sepi.STAGE`` of a stage with its own choices and those of the compared methods.

    It reads a light field and the maps of the stage before, runs one choice, and writes one stage file, whole or not at
    all.
    """
    from sepi.compared.methods import StageChoices
    from sepi.exposure import equally_bright
    from sepi.io.hdf5 import read_light_field, read_stage, write_stage
    from sepi.io.provenance import history_of, stage_attributes
    from sepi.models import validated
    from sepi.stage import entry
    from sepi.threads import use_threads
    from sepi.workspace import Workspace

    existing = click.Path(path_type=Path)
    choices = StageChoices(stage, own)

    @click.command(name=f"python -m sepi.{stage}", cls=SepiCommand, help=f"Run the stage '{stage}' on one light field.")
    @click.option("--light-field", "light_field_path", type=existing, required=True, help="HDF5 file from ingest.")
    @click.option("--previous", type=existing, help="File of the stage before; the first stage has none.")
    @click.option("--choice", type=click.Choice(list(choices)), required=True, help="Algorithm of this stage.")
    @click.option("--parameters", default="{}", show_default=True, help="JSON object; the rest has its default.")
    @click.option("--threads", type=click.IntRange(min=1), default=1, show_default=True, help="Threads to use.")
    @click.option("--output", type=existing, required=True, help="Stage file to write.")
    @click.option("--timing", type=existing, help="JSON file to write: what it took, and where.")
    def command(
        light_field_path: Path,
        previous: Path | None,
        choice: str,
        parameters: str,
        threads: int,
        output: Path,
        timing: Path | None,
    ) -> None:
        started = time.perf_counter()
        use_threads(threads)
        chosen = choices[choice]
        settings = validated(chosen.parameters, _json_object(parameters), f"{stage}.{choice}")
        light_field = read_light_field(light_field_path)
        maps = None if previous is None else read_stage(previous)
        if maps is not None and maps.disparity.shape != light_field.shape:
            raise SepiError(
                f"{previous}: maps of {maps.disparity.shape} do not belong to {light_field_path} of {light_field.shape}"
            )
        compared = replace(equally_bright(light_field), workspace=Workspace())
        with progress_bar(f"{light_field.name} {stage}") as progress:
            result = chosen.run(compared, maps, settings, progress)
        history = [*history_of(previous), entry(stage, choice, settings, light_field)]
        write_stage(output, result, stage_attributes(light_field, history))
        if timing is not None:
            write_timing(timing, started, threads, parameters=settings.model_dump(mode="json"))

    return command


def _json_object(text: str) -> dict[str, Any]:
    with suppress(ValueError, RecursionError):
        value = json.loads(text)
        if isinstance(value, dict):
            return value
    raise SepiError(f"--parameters: expected a JSON object such as '{{}}', got {text!r}")
