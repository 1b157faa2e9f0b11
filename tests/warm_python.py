"""Python processes that wait for no library: forks of one that has loaded them, as the workflow's jobs are.

A job of the workflow is a process of its own, which mostly waits for
its imports, and Snakemake takes seconds to be imported.
What is tested is loaded after the fork, from ``PYTHONPATH`` as ever. Not for tests of how processes begin or are
killed.
"""

from __future__ import annotations

import atexit
import gc
import importlib
import os
import runpy
import signal
import socket
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path

from sepi.workflow import job_client
from sepi.workflow.job_server import Job, Server, end_forks_at_once, serve, start_server

# what takes the place of Python
_PROGRAM = """#!{python} -IS
import os, sys
words = sys.argv[1:]
code = None
if words[:1] == ["-m"] or words and words[0].endswith(".py"):
    sys.path.insert(0, {client!r})
    from job_client import call
    code = call({address!r}, words)
if code is None:
    os.execv({python!r}, [{python!r}, *words])
sys.exit(code)
"""

# by the first part of a module's name, or the ending of a file
_LIBRARIES = {
    "sepi": (
        *("numpy", "h5py", "cv2", "click", "pydantic", "yaml", "psutil", "PIL.Image"),
        *("scipy.sparse.linalg", "scipy.ndimage", "skimage.segmentation"),
    ),
    "sepi.report": ("matplotlib.backends.backend_agg", "matplotlib.backends.backend_pdf", "jinja2"),
    "snakemake": (
        *("snakemake.cli", "snakemake.report", "pulp", "pydantic.dataclasses", "psutil", "yaml"),
        *("numpy", "h5py", "cv2", "click", "jinja2", "requests", "PIL.Image"),
    ),
    ".py": ("matplotlib.pyplot",),
}

# this module, as the name of a program
_SERVER = "warm_python"
_servers: list[Server] = []


@cache
def warm_python() -> str:
    """Path of a program that stands for Python where it is called as ``-m MODULE`` or with a file.

    The measurement of coverage, which a fork would lose, gets Python itself.
    """
    if "COVERAGE_RCFILE" in os.environ:
        return sys.executable
    # it ends with this process; forks draw without a display
    server = _started([sys.executable, __file__], {"MPLBACKEND": "agg"})
    program = _program_for(server)
    _servers.append(server)
    atexit.register(server.end)
    return program


def _started(command: list[str], environment: dict[str, str]) -> Server:
    server = start_server(command, environment)
    assert server is not None
    return server


def _program_in(folder: Path) -> Path:
    return folder / "python"


def _program_for(server: Server) -> str:
    """Write the program that asks a server, beside its socket: it goes with that."""
    program = _program_in(Path(server.address).parent)
    client = str(Path(job_client.__file__).parent)
    program.write_text(_PROGRAM.format(python=sys.executable, client=client, address=server.address))
    program.chmod(0o700)
    return str(program)


@contextmanager
def python_that_has_read(tree: Path) -> Iterator[str]:
    """Such a program that has read, once, the code of a folder's package, of which each run of Snakemake makes digests.

    Not for runs after a change of that code.
    """
    if "COVERAGE_RCFILE" in os.environ:
        yield sys.executable
        return
    here = str(Path(__file__).parent)
    server = _started([warm_python(), "-m", _SERVER, str(tree)], {"PYTHONPATH": here})
    program = _program_for(server)
    try:
        yield program
    finally:
        server.end()


def forks_cpu_seconds() -> float:
    """What the server of this process has taken, with all its forks that have ended."""
    import psutil

    return sum(sum(psutil.Process(server.process.pid).cpu_times()[:4]) for server in _servers)


def _serve(tree: str = "") -> None:
    """Answer each call by a fork that becomes what was called."""
    end_forks_at_once()
    # what is tested may be another copy of the package than the one whose server this is
    for name in [name for name in sys.modules if name.partition(".")[0] == "sepi"]:
        del sys.modules[name]
    if tree:
        _read(Path(tree))
    # the folder of this file, and what only the tests' own process was told to import from
    own = [str(Path(__file__).parent), *os.environ.get("PYTHONPATH", "").split(os.pathsep)]
    path = [entry for entry in sys.path if entry not in own]
    with socket.socket(fileno=os.dup(0)) as listener:
        program = _program_in(Path(listener.getsockname()).parent)
    job = serve(_load)
    if job is not None:
        _become(job, path, program)


@cache
def _loaded(name: str) -> None:
    for library in _LIBRARIES[name]:
        importlib.import_module(library)
    gc.freeze()


def _read(tree: Path) -> None:
    """Have in memory what digests of a package's code are made of."""
    sys.path.insert(0, str(tree))
    digests = importlib.import_module("sepi.workflow.code_digest")
    sys.path.remove(str(tree))
    assert tree == digests.ROOT
    files = (path.relative_to(tree).with_suffix("") for path in (tree / "sepi").rglob("*.py"))
    digests.code_digest(*(".".join(file.parts) for file in files if file.name != "__init__"))


def _load(job: Job) -> None:
    words = job.words
    if words[0] != "-m":
        _loaded("sepi")
        _loaded(".py")
        return
    for name in _LIBRARIES:
        if words[1] == _SERVER or f"{words[1]}.".startswith(f"{name}."):
            _loaded(name)


def _become(job: Job, path: list[str], program: Path) -> None:
    """Run what was called as Python would, in this process."""
    signal.signal(signal.SIGINT, signal.default_int_handler)
    sys.dont_write_bytecode = False
    sys.executable = str(program)
    with job.entered():
        start = job.folder if job.words[0] == "-m" else str(Path(job.words[0]).parent)
        sys.path[:] = [start, *filter(None, os.environ.get("PYTHONPATH", "").split(os.pathsep)), *path]
        importlib.invalidate_caches()
        if job.words[0] == "-m":
            sys.argv = job.words[1:]
            runpy.run_module(job.words[1], run_name="__main__", alter_sys=True)
        else:
            sys.argv = job.words
            runpy.run_path(job.words[0], run_name="__main__")


if __name__ == "__main__":
    _serve(*sys.argv[1:])
