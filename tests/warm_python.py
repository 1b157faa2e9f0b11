"""Python processes that wait for no library: forks of one that has loaded them.

A job of the workflow is a process of its own, which mostly waits for numba, and Snakemake takes seconds to be imported.
What is tested is loaded after the fork, from ``PYTHONPATH`` as ever. Not for tests of how processes begin or are
killed: a fork outlives its caller's SIGKILL.
"""

from __future__ import annotations

import atexit
import importlib
import json
import os
import runpy
import select
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
import traceback
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path

# what takes the place of Python: it hands its words and files to the server, and ends as the fork does
_PROGRAM = """#!{python} -IS
import json, os, signal, socket, sys
words = sys.argv[1:]
if words[:1] == ["-m"] or words and words[0].endswith(".py"):
    server = socket.socket(socket.AF_UNIX)
    server.connect({address!r})
    message = json.dumps([words, dict(os.environ), os.getcwd()]).encode()
    socket.send_fds(server, [len(message).to_bytes(8, "big")], [0, 1, 2])
    server.sendall(message)
    fork = int.from_bytes(server.recv(8), "big")
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, lambda number, _: os.kill(fork, number))
    sys.exit(int.from_bytes(server.recv(1) or b"\\xff", "big"))
os.execv({python!r}, [{python!r}, *words])
"""

# by the first part of a module's name, or the ending of a file
_LIBRARIES = {
    "sepi": (
        *("numpy", "numba", "h5py", "cv2", "click", "pydantic", "yaml", "psutil", "PIL.Image"),
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
_servers: list[int] = []


@cache
def warm_python() -> str:
    """Path of a program that stands for Python where it is called as ``-m MODULE`` or with a file.

    The measurement of coverage, which a fork would lose, gets Python itself.
    """
    if "COVERAGE_RCFILE" in os.environ:
        return sys.executable
    folder, address, program = _new_program()
    # it ends with this process, which holds the other end of its input
    server = subprocess.Popen(
        [sys.executable, __file__, address, program],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        # forks draw without a display
        env=os.environ | {"MPLBACKEND": "agg"},
    )
    assert server.stdin is not None
    assert server.stdout is not None
    assert server.stdout.readline().split() == [b"ready", str(server.pid).encode()]
    _servers.append(server.pid)
    atexit.register(_end, server, folder)
    return program


def _new_program() -> tuple[Path, str, str]:
    """A folder, and in it an address for a server and the program that asks it."""
    folder = Path(tempfile.mkdtemp(prefix="sepi-python-"))
    address, program = str(folder / "socket"), folder / "python"
    program.write_text(_PROGRAM.format(python=sys.executable, address=address))
    program.chmod(0o700)
    return folder, address, str(program)


@contextmanager
def python_that_has_read(tree: Path) -> Iterator[str]:
    """Such a program that has read, once, the code of a folder's package, of which each run of Snakemake makes digests.

    Not for runs after a change of that code.
    """
    if "COVERAGE_RCFILE" in os.environ:
        yield sys.executable
        return
    folder, address, program = _new_program()
    here = Path(__file__).parent
    server = subprocess.Popen(
        [warm_python(), "-m", _SERVER, address, program, str(tree)],
        cwd=here,
        env=os.environ | {"PYTHONPATH": str(here)},
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
    )
    assert server.stdout is not None
    ready, pid = server.stdout.readline().split()
    assert ready == b"ready"
    _servers.append(int(pid))
    try:
        yield program
    finally:
        _end(server, folder)
        # its time is told by the server that it is a fork of as soon as that has seen its end
        while Path("/proc", pid.decode()).exists():
            time.sleep(0.01)
        _servers.remove(int(pid))


def _end(server: subprocess.Popen[bytes], folder: Path) -> None:
    server.communicate()
    for path in folder.iterdir():
        path.unlink()
    folder.rmdir()


def forks_cpu_seconds() -> float:
    """What the server of this process has taken, with all its forks that have ended."""
    import psutil

    return sum(sum(psutil.Process(pid).cpu_times()[:4]) for pid in _servers)


def _serve(address: str, program: str, tree: str = "") -> None:
    """Answer each connection by a fork that becomes what was called, until the input ends."""
    if tree:
        _read(Path(tree))
    # the folder of this file, and what only the tests' own process was told to import from
    own = [str(Path(__file__).parent), *os.environ.get("PYTHONPATH", "").split(os.pathsep)]
    path = [entry for entry in sys.path if entry not in own]
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGCHLD, lambda *_: _reap())
    with socket.socket(socket.AF_UNIX) as listener:
        listener.bind(address)
        listener.listen(64)
        print("ready", os.getpid(), flush=True)
        # a second at a time: a fork's end just before a wait does not end it, and who waits for the fork calls no other
        while sys.stdin not in (ready := select.select([listener, sys.stdin], [], [], 1.0)[0]):
            if not ready:
                continue
            called, _ = listener.accept()
            head, files, _, _ = socket.recv_fds(called, 8, 3)
            message = b""
            while len(message) < int.from_bytes(head, "big"):
                message += called.recv(1 << 20)
            words, environment, folder = json.loads(message)
            _load(words)
            if not os.fork():
                listener.close()
                fork = os.getpid()
                called.send(fork.to_bytes(8, "big"))
                code = _become(words, environment, folder, files, path, program)
                # not a fork of the fork
                if os.getpid() == fork:
                    called.send(bytes([code]))
                os._exit(code)
            for file in (called.detach(), *files):
                os.close(file)


def _reap() -> None:
    with suppress(ChildProcessError):
        while os.waitpid(-1, os.WNOHANG)[0]:
            pass


@cache
def _loaded(name: str) -> None:
    for library in _LIBRARIES[name]:
        importlib.import_module(library)
    if name == "sepi":
        # the compiler's own start
        sys.modules["numba"].njit(lambda x: x)(1.0)


def _read(tree: Path) -> None:
    """Have in memory what digests of a package's code are made of."""
    sys.path.insert(0, str(tree))
    digests = importlib.import_module("sepi.workflow.code_digest")
    sys.path.remove(str(tree))
    assert tree == digests.ROOT
    files = (path.relative_to(tree).with_suffix("") for path in (tree / "sepi").rglob("*.py"))
    digests.code_digest(*(".".join(file.parts) for file in files if file.name != "__init__"))


def _load(words: list[str]) -> None:
    if words[0] != "-m":
        _loaded("sepi")
        _loaded(".py")
        return
    for name in _LIBRARIES:
        if words[1] == _SERVER or f"{words[1]}.".startswith(f"{name}."):
            _loaded(name)


def _become(
    words: list[str], environment: dict[str, str], folder: str, files: list[int], path: list[str], program: str
) -> int:
    """Run what was called as Python would, in this process; the code with which it ends."""
    signal.signal(signal.SIGCHLD, signal.SIG_DFL)
    signal.signal(signal.SIGINT, signal.default_int_handler)
    for number, file in enumerate(files):
        os.dup2(file, number)
        os.close(file)
    os.chdir(folder)
    os.environ.clear()
    os.environ.update(environment)
    if "numba" in sys.modules:
        importlib.import_module("numba.core.config").reload_config()
    sys.dont_write_bytecode = False
    sys.executable = program
    start = folder if words[0] == "-m" else str(Path(words[0]).parent)
    sys.path[:] = [start, *filter(None, environment.get("PYTHONPATH", "").split(os.pathsep)), *path]
    importlib.invalidate_caches()
    try:
        if words[0] == "-m":
            sys.argv = words[1:]
            runpy.run_module(words[1], run_name="__main__", alter_sys=True)
        else:
            sys.argv = words
            runpy.run_path(words[0], run_name="__main__")
        code = 0
    except SystemExit as end:
        code = end.code if isinstance(end.code, int) else int(end.code is not None)
        if isinstance(end.code, str):
            print(end.code, file=sys.stderr)
    except BaseException:
        traceback.print_exc()
        code = 1
    threading._shutdown()  # type: ignore[attr-defined]
    atexit._run_exitfuncs()
    sys.stdout.flush()
    sys.stderr.flush()
    return code & 0xFF


if __name__ == "__main__":
    _serve(*sys.argv[1:])
