"""Parts shared by all commands: one line for a user's error, a progress bar, timing, and the command of a stage.

A stage module ends with ``stage_command("initial", CHOICES)()``; the workflow's rule calls ``python -m sepi.initial``.
"""

from __future__ import annotations

import functools
import os
import signal
import sys
import threading
import time
import warnings
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from importlib import import_module
from pathlib import Path
from types import FrameType
from typing import IO, TYPE_CHECKING, Any

import click

from sepi.errors import SepiError, SepiWarning, one_line
from sepi.registry import added

# every command imports this module, so imports for the commands of stages stand in their function
if TYPE_CHECKING:
    from sepi.stage import Choice, Progress

# sent by a workflow that stops its jobs, and by a closed terminal (not on all systems)
_ENDING = [getattr(signal, name) for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name)]


WORKFLOW_PROCESS = "SEPI_WORKFLOW_PROCESS"
"""Environment variable with the process number of the workflow, with which its jobs end."""

# Linux: option of prctl for the signal that a process gets when its parent ends
_PR_SET_PDEATHSIG = 1
# settings of glibc, by environment variable: number of heaps for threads; least size in bytes of an array that returns
# to the system when freed; least free size at the end of a heap that returns to the system
_HEAP = {
    "MALLOC_ARENA_MAX": (-8, 1),
    "MALLOC_MMAP_THRESHOLD_": (-3, 100_000_000),
    "MALLOC_TRIM_THRESHOLD_": (-1, 100_000_000),
}


class _Shown(click.ClickException):
    """A user's error; click shows ``sepi: MESSAGE`` on stderr, exit code 1."""

    def show(self, file: IO[Any] | None = None) -> None:
        click.echo(f"sepi: {self.format_message()}", file=file, err=file is None)


class SepiCommand(click.Command):
    """A click command that shows a :class:`SepiError` as one line and cleans up when it is terminated."""

    def make_context(
        self, info_name: str | None, args: list[str], parent: click.Context | None = None, **extra: Any
    ) -> click.Context:
        """The context of these words; a flag that the command lacks, and --help, are those of extensions, too."""
        own = {flag for param in self.params for flag in (*param.opts, *param.secondary_opts)}
        more = {word.partition("=")[0] for word in args if word == "-h" or word.startswith("--")} - own
        command = self.extended() if more else self
        return super(SepiCommand, command).make_context(info_name, args, parent, **extra)

    def extended(self) -> SepiCommand:
        """The command with the flags that extensions add."""
        command = self
        with shown_errors():
            for name, module in added("flags").items():
                if name.partition(" ")[0] == self.name:
                    command = import_module(module).extended(command)
        return command

    def invoke(self, ctx: click.Context) -> Any:
        """Run the command."""
        with shown_errors():
            use_memory_again()
            _end_with_the_workflow()
            return super().invoke(ctx)


PATH = click.Path(path_type=Path)
"""Type of an argument or flag that is a path."""

bad_thresholds = click.option(
    "--bad",
    "thresholds",
    type=click.FloatRange(min=0, min_open=True),
    multiple=True,
    metavar="T",
    help="Also score the share of errors above T pixels per view step; repeatable.",
)


class SepiGroup(click.Group):
    """A click group whose subcommands are :class:`SepiCommand`."""

    command_class = SepiCommand


def _end_with_the_workflow() -> None:
    """Let a job of the workflow end with it, on systems that can do this."""
    workflow = os.environ.get(WORKFLOW_PROCESS)
    if workflow is None or sys.platform != "linux":
        return
    import ctypes

    with suppress(OSError, AttributeError):
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGTERM)
    # the workflow may have ended already
    if os.getppid() == 1 and workflow != "1":
        sys.exit(128 + signal.SIGTERM)


def use_memory_again() -> None:
    """Let the C library reuse freed memory, unless environment variables set its behaviour.

    glibc gives each thread its own heap, and other threads do not reuse memory freed there: 40 MB of a benchmark scene.
    It returns large arrays to the system at once, and clearing new pages takes a thirtieth of ``sepi depth``.
    """
    if sys.platform == "linux":
        import ctypes

        with suppress(OSError, AttributeError):
            for name, setting in _HEAP.items():
                if name not in os.environ:
                    ctypes.CDLL(None).mallopt(*setting)


@contextmanager
def shown_errors() -> Iterator[None]:
    """Turn a user's error into one line without traceback, and a signal into an exit that removes unfinished files.

    Users' errors are :class:`SepiError`, a path that the system refuses, and too little memory. A :class:`SepiWarning`
    becomes a line too, and the command goes on.
    """
    main = threading.current_thread() is threading.main_thread()
    before = {number: signal.signal(number, _exit_on_signal) for number in _ENDING} if main else {}
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("always", SepiWarning)
            warnings.showwarning = functools.partial(_show_warning, warnings.showwarning)
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
        raise _Shown(one_line(f"not enough memory ({str(error) or 'the system has no more'})")) from error
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _is_of_memory(error: Exception) -> bool:
    """Whether an error means too little memory, also for a thread's stack or in OpenCV."""
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
    """Largest memory of this process so far, MB."""
    with suppress(OSError, StopIteration):
        status = Path("/proc/self/status").read_text(encoding="ascii")
        # ru_maxrss below would count the parent's memory
        return next(int(line.split()[1]) for line in status.splitlines() if line.startswith("VmHWM")) / 2**10
    try:
        import resource
    except ImportError:
        # Windows
        import psutil

        memory = psutil.Process().memory_info()
        return float(getattr(memory, "peak_wset", memory.rss)) / 2**20
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / (2**20 if sys.platform == "darwin" else 2**10)


def write_timing(path: Path, started: float, threads: int, **more: Any) -> None:
    """Write JSON with the seconds since ``started`` (``time.perf_counter``), peak memory, machine, and ``more``."""
    import json

    from sepi.io.files import write_whole
    from sepi.process.machine import this_machine

    timing = {
        "seconds": round(time.perf_counter() - started, 3),
        "peak_memory_mb": round(peak_memory_mb(), 1),
        "threads": threads,
        "machine": this_machine(),
        **more,
    }
    write_whole(path, json.dumps(timing) + "\n")


def stage_command(stage: str, own: Mapping[str, Choice]) -> click.Command:
    """The command ``python -m sepi.STAGE``, with the stage's own choices and those of extensions.

    The command reads a light field and the maps of the stage before, runs one choice, and writes one stage file, whole
    or not at all.
    """
    from dataclasses import replace

    from sepi.inspection.coded_views import comparable
    from sepi.io.hdf5 import COMPARABLE, read_attributes, read_light_field, read_stage, write_stage
    from sepi.io.provenance import history_of, stage_attributes
    from sepi.process.threads import use_threads
    from sepi.process.workspace import Workspace
    from sepi.registry import stage_choices
    from sepi.stage import entry
    from sepi.validation import require_known, require_type, value_of
    from sepi.validation.models import validated

    choices = stage_choices(stage, own)

    @click.command(name=f"python -m sepi.{stage}", cls=SepiCommand, help=f"Run the stage '{stage}' on one light field.")
    @click.option("--light-field", "light_field_path", type=PATH, required=True, help="HDF5 file from ingest.")
    @click.option("--previous", type=PATH, help="File of the stage before; not for the first stage.")
    @click.option("--choice", metavar="NAME", required=True, help="Choice of this stage.")
    @click.option("--parameters", default="{}", show_default=True, help="JSON object of parameters.")
    @click.option("--threads", type=click.IntRange(min=1), default=1, show_default=True, help="Threads to use.")
    @click.option("--output", type=PATH, required=True, help="Stage file to write.")
    @click.option("--timing", type=PATH, help="JSON file to write: seconds, peak memory, machine.")
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
        require_known("--choice", [choice], choices)
        chosen = choices[choice]
        given = value_of(parameters)
        require_type("--parameters", given, dict, "a JSON object such as '{}'")
        settings = validated(chosen.parameters, given, f"{stage}.{choice}")
        light_field = read_light_field(light_field_path)
        maps = None if previous is None else read_stage(previous)
        if maps is not None and maps.disparity.shape != light_field.shape:
            expected = f"{light_field.shape}, that of {light_field_path}"
            raise SepiError(f"{previous}: maps have shape {maps.disparity.shape}; expected {expected}")
        known = COMPARABLE in read_attributes(light_field_path, check=False)
        compared = replace(light_field if known else comparable(light_field), workspace=Workspace())
        with progress_bar(f"{light_field.name} {stage}") as progress:
            result = chosen.run(compared, maps, settings, progress)
        history = [*history_of(previous), entry(stage, choice, settings, light_field)]
        write_stage(output, result, stage_attributes(light_field, history))
        if timing is not None:
            write_timing(timing, started, threads, parameters=settings.model_dump(mode="json"))

    return command
