"""Runs jobs of the workflow as forks of one process with the libraries loaded, since loading takes half of a short job.

A job stays a process of its own with a command of its own, which :mod:`~sepi.workflow.job_client` hands on. For Linux:
elsewhere some libraries do not work in a fork.
"""

from __future__ import annotations

import atexit
import gc
import importlib
import os
import runpy
import selectors
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import NamedTuple

from sepi.variants import STAGES
from sepi.workflow.job_client import TAKEN

# what takes long to import, and stages import when they use it
_LIBRARIES = ("skimage.segmentation.slic_superpixels", "scipy.sparse.linalg", "scipy.ndimage", "pyamg")

# how the work of this process ended
_codes: list[int] = []


class Server(NamedTuple):
    """A process that forks, seen from the one that started it and that it ends with.

    Attributes
    ----------
    address : str
        Its socket, for clients.
    process : subprocess.Popen
    alive : socket
        It waits for this to be closed, as it is when this process ends, whatever ends it.
    """

    address: str
    process: subprocess.Popen[bytes]
    alive: socket.socket

    def end(self) -> None:
        """End it and its forks."""
        self.alive.close()
        self.process.wait()


def start_job_server(python_path: str) -> Server | None:
    """Start a server of the workflow's jobs.

    Parameters
    ----------
    python_path : str
        ``PYTHONPATH`` of the jobs.

    Returns
    -------
    Server or None
        None where jobs cannot be forks.
    """
    if sys.platform != "linux":
        return None
    return start_server([sys.executable, "-m", __name__], {"PYTHONPATH": python_path})


def start_server(command: Sequence[str], environment: Mapping[str, str]) -> Server | None:
    """Start a process that calls :func:`serve`.

    Parameters
    ----------
    command : sequence of str
        Of the process.
    environment : mapping of str to str
        Added to this process's.

    Returns
    -------
    Server or None
        None where there is no place for a socket.
    """
    # in a folder that nobody else can enter: who connects has anything run
    try:
        folder = tempfile.mkdtemp(prefix="sepi-jobs-")
    except OSError:
        return None
    address = str(Path(folder, "socket"))
    alive, given = socket.socketpair()
    with socket.socket(socket.AF_UNIX) as listener, given:
        try:
            listener.bind(address)
        except OSError:
            # no sockets there, or the path is too long for one
            alive.close()
            Path(folder).rmdir()
            return None
        # clients wait until the server is ready
        listener.listen(1024)
        process = subprocess.Popen(
            command,
            stdin=listener.fileno(),
            stdout=given.fileno(),
            # threads do not outlive a fork
            env={**os.environ, **environment, "OPENBLAS_NUM_THREADS": "1"},
            # signals of a terminal reach a fork by its client alone
            start_new_session=True,
        )
    return Server(address, process, alive)


def serve(prepare: Callable[[Job], None] | None = None) -> Job | None:
    """Answer clients, in a process that :func:`start_server` started.

    Parameters
    ----------
    prepare : callable, optional
        What the server does before it forks for a job.

    Returns
    -------
    Job or None
        In each fork, its job; None in the server, at its end.
    """
    with socket.socket(fileno=os.dup(0)) as listener, socket.socket(fileno=os.dup(1)) as alive:
        folder = Path(listener.getsockname()).parent
        job = JobServer(listener, alive, prepare).serve()
    if job is None:
        shutil.rmtree(folder, ignore_errors=True)
    return job


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

    @contextmanager
    def entered(self) -> Iterator[None]:
        """Work with the client's files, folder and environment; how that ends is noted."""
        for number, file in enumerate(self.files):
            os.dup2(file, number)
            os.close(file)
        os.chdir(self.folder)
        os.environ.clear()
        os.environ.update(self.environment)
        try:
            yield
            _codes.append(0)
        except SystemExit as end:
            _codes.append(end.code if isinstance(end.code, int) else int(end.code is not None))
            raise
        except KeyboardInterrupt:
            _codes.append(128 + signal.SIGINT)
            raise


def end_forks_at_once() -> None:
    """Let forks of this process exit without unloading its libraries, which takes longer than many jobs.

    To be called before anything is loaded: what is to be done at a process's end is done first.
    """
    atexit.register(_end_at_once, os.getpid())


def _end_at_once(server: int) -> None:
    if os.getpid() != server:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(_codes[-1] & 0xFF if _codes else 1)


class JobServer:
    """A fork for each client.

    Parameters
    ----------
    listener : socket
        What clients connect to.
    alive : socket
        Its other end is closed when nobody needs the server any longer.
    prepare : callable, optional
        What it does before it forks for a job.
    """

    def __init__(
        self, listener: socket.socket, alive: socket.socket, prepare: Callable[[Job], None] | None = None
    ) -> None:
        # client to its fork
        self._forks: dict[socket.socket, int] = {}
        self._listener, self._alive, self._prepare = listener, alive, prepare
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
        except (OSError, ValueError):
            client.close()
            return None
        if self._prepare is not None:
            self._prepare(job)
        number = os.fork()
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
    for name in (*_LIBRARIES, *(f"sepi.{stage}" for stage in STAGES)):
        importlib.import_module(name)
    # pydantic looks for plugins as it makes its first model
    importlib.import_module("sepi.stage").NoParameters()
    # which every job tells
    importlib.import_module("sepi.machine").versions()
    # forks need not look through all that for what is not used, which would copy it
    gc.freeze()


def _run(job: Job) -> None:
    """Do a job in this process as Python would."""
    _, module, *sys.argv[1:] = job.words
    # run anew as the main one, as ever, where others have imported it
    sys.modules.pop(module, None)
    with job.entered():
        runpy.run_module(module, run_name="__main__", alter_sys=True)


if __name__ == "__main__":
    end_forks_at_once()
    _load()
    job = serve()
    if job is not None:
        _run(job)
