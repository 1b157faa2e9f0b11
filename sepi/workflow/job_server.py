"""Jobs of the workflow as forks of one process that has loaded the libraries, which takes half of a short job.

A job stays a process of its own with a command of its own, which :mod:`~sepi.workflow.job_client` hands on. For Linux:
elsewhere some libraries do not work in a fork.
"""

from __future__ import annotations

import gc
import importlib
import os
import pkgutil
import runpy
import selectors
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

from sepi.openmp import wait_asleep
from sepi.workflow.job_client import TAKEN

# what most jobs import: libraries with parts that they import late, and what the stages have in common
_LIBRARIES = ("cv2", "h5py", "skimage.segmentation", "scipy.sparse.linalg", "pydantic.fields")
_COMMON = ("sepi.command", "sepi.variants", "sepi.io.hdf5", "sepi.io.provenance", "sepi.exposure", "sepi.memory")
_ALGORITHMS = ("sepi.matching", "sepi.boundaries", "sepi.regularization", "sepi.error_bars")

# a server, and what it waits for to be closed, as it is when this process ends, whatever ends it
_servers: dict[str, tuple[subprocess.Popen[bytes], socket.socket]] = {}


def start_job_server(python_path: str) -> str | None:
    """Start a server that ends when this process does, and its jobs with it.

    Parameters
    ----------
    python_path : str
        ``PYTHONPATH`` of the jobs.

    Returns
    -------
    str or None
        Its socket, for :data:`sepi.workflow.job_client.SERVER`; None where jobs cannot be forks.
    """
    if sys.platform != "linux":
        return None
    # in a folder that nobody else can enter: who connects has anything run
    try:
        folder = tempfile.mkdtemp(prefix="sepi-jobs-")
    except OSError:
        return None
    address = str(Path(folder, "socket"))
    own, given = socket.socketpair()
    with socket.socket(socket.AF_UNIX) as listener, given:
        try:
            listener.bind(address)
        except OSError:
            # no sockets there, or the path is too long for one
            own.close()
            Path(folder).rmdir()
            return None
        # jobs wait until the server is ready
        listener.listen(1024)
        server = subprocess.Popen(
            [sys.executable, "-m", __name__, address],
            stdin=listener.fileno(),
            stdout=given.fileno(),
            # threads do not outlive a fork
            env=os.environ | {"PYTHONPATH": python_path, "OPENBLAS_NUM_THREADS": "1"},
            # signals of a terminal reach a job by its client alone
            start_new_session=True,
        )
    _servers[address] = server, own
    return address


def end_job_server(address: str) -> None:
    """End a server and its jobs before this process ends.

    Parameters
    ----------
    address : str
        Its socket.
    """
    server, own = _servers.pop(address)
    own.close()
    server.wait()


class Job(NamedTuple):
    """What a client asks for: Python's words, and where it shall run."""

    words: list[str]
    folder: str
    environment: dict[str, str]
    files: list[int]

    @classmethod
    def received(cls, client: socket.socket) -> Job:
        """The job that a client sends; OSError or ValueError if it ends before it has sent one."""
        head, files, _, _ = socket.recv_fds(client, 8, 3)
        size, request = int.from_bytes(head, "big"), b""
        while len(request) < size:
            part = client.recv(size - len(request))
            if not part:
                raise ValueError
            request += part
        first, *texts = map(os.fsdecode, request.split(b"\0"))
        count = int(first)
        return cls(texts[:count], texts[count], dict(text.split("=", 1) for text in texts[count + 1 :]), files)

    def run(self) -> None:
        """Do in this process what Python would."""
        for number, file in enumerate(self.files):
            os.dup2(file, number)
            os.close(file)
        os.chdir(self.folder)
        os.environ.clear()
        os.environ.update(self.environment)
        wait_asleep()
        importlib.import_module("numba.core.config").reload_config()
        _, module, *sys.argv[1:] = self.words
        # run anew as the main one, as ever, where others have imported it
        sys.modules.pop(module, None)
        runpy.run_module(module, run_name="__main__", alter_sys=True)


class JobServer:
    """A fork for each client.

    Parameters
    ----------
    listener : socket
        What clients connect to.
    alive : socket
        Its other end is closed when nobody needs the server any longer.
    """

    def __init__(self, listener: socket.socket, alive: socket.socket) -> None:
        # client to its fork
        self._forks: dict[socket.socket, int] = {}
        self._listener, self._alive = listener, alive
        # readable when a fork has ended
        self._ended, self._waker = socket.socketpair()
        self._waker.setblocking(False)
        self._selector = selectors.DefaultSelector()
        for file in (listener, alive, self._ended):
            self._selector.register(file, selectors.EVENT_READ)

    def serve(self) -> Job | None:
        """Answer clients.

        Returns
        -------
        Job or None
            In each fork, its job; None in the server, at its end.
        """
        signal.signal(signal.SIGCHLD, lambda *_: None)
        signal.set_wakeup_fd(self._waker.fileno(), warn_on_full_buffer=False)
        while True:
            ready = [key.fileobj for key, _ in self._selector.select()]
            if self._alive in ready:
                for number in self._forks.values():
                    os.kill(number, signal.SIGTERM)
                return None
            if self._ended in ready:
                self._ended.recv(4096)
                self._reap()
            for client in [client for client in self._forks if client in ready]:
                self._hand_on(client)
            if self._listener in ready:
                job = self._fork()
                if job is not None:
                    return job

    def _fork(self) -> Job | None:
        """Fork for the next client; its job, in the fork."""
        client, _ = self._listener.accept()
        try:
            job = Job.received(client)
            number = os.fork()
        except (OSError, ValueError):
            client.close()
            return None
        if number == 0:
            signal.set_wakeup_fd(-1)
            signal.signal(signal.SIGCHLD, signal.SIG_DFL)
            self._selector.close()
            for file in (self._listener, self._alive, self._ended, self._waker, client, *self._forks):
                file.close()
            return job
        for descriptor in job.files:
            os.close(descriptor)
        self._forks[client] = number
        self._selector.register(client, selectors.EVENT_READ)
        with suppress(OSError):
            client.sendall(TAKEN)
        return None

    def _hand_on(self, client: socket.socket) -> None:
        """Send a fork the signals that its client got, and one where the client was killed."""
        try:
            numbers = client.recv(64)
        except OSError:
            numbers = b""
        if not numbers:
            self._selector.unregister(client)
        for number in numbers or [signal.SIGTERM]:
            os.kill(self._forks[client], number)

    def _reap(self) -> None:
        """Tell clients that their forks have ended."""
        for client, number in list(self._forks.items()):
            ended, status = os.waitpid(number, os.WNOHANG)
            if not ended:
                continue
            code = os.waitstatus_to_exitcode(status)
            with suppress(OSError):
                client.sendall(bytes([code if code >= 0 else 128 - code]))
            with suppress(KeyError):
                self._selector.unregister(client)
            client.close()
            del self._forks[client]


def _load() -> None:
    """Import what jobs share, and start no thread, which would not outlive a fork."""
    for name in (*_LIBRARIES, *_COMMON):
        importlib.import_module(name)
    for name in _ALGORITHMS:
        for module in pkgutil.iter_modules(importlib.import_module(name).__path__, f"{name}."):
            importlib.import_module(module.name)
    importlib.import_module("sepi.compiled").prepare_loading()
    # pydantic looks for plugins as it makes its first model
    importlib.import_module("sepi.stage").NoParameters()
    # forks need not look through all that for what is not used, which would copy it
    gc.freeze()


if __name__ == "__main__":
    with socket.socket(fileno=os.dup(0)) as listener, socket.socket(fileno=os.dup(1)) as alive:
        _load()
        job = JobServer(listener, alive).serve()
    if job is not None:
        job.run()
    else:
        shutil.rmtree(Path(sys.argv[1]).parent, ignore_errors=True)
