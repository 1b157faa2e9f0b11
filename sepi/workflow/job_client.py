"""What stands between Python and a job's module where there is a :mod:`~sepi.workflow.job_server`.

``python -IS job_client.py -m MODULE WORD ...`` has a fork of the server do what Python would, and ends as that does. It
imports only the standard library, which is its whole saving. If no server answers, it becomes Python.
"""

from __future__ import annotations

import os
import signal
import socket
import sys

SERVER = "SEPI_JOB_SERVER"
"""Environment variable: the socket of the server; empty for none."""

TAKEN = b"t"
"""What the server says when a fork has begun."""

_ENDING = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


def call(address: str, words: list[str]) -> int | None:
    """Have a fork run Python with these words, and this process's folder, environment and files.

    Parameters
    ----------
    address : str
        The server's socket.
    words : list of str
        ``-m``, a module, and its words.

    Returns
    -------
    int or None
        The code that the fork ended with; None where no fork has begun.
    """
    environment = [f"{name}={value}" for name, value in os.environ.items()]
    request = b"\0".join(map(os.fsencode, [str(len(words)), *words, os.getcwd(), *environment]))
    with socket.socket(socket.AF_UNIX) as server:
        try:
            # what comes before the fork can be told of it waits
            signal.pthread_sigmask(signal.SIG_BLOCK, _ENDING)
            server.connect(address)
            socket.send_fds(server, [len(request).to_bytes(8, "big")], [0, 1, 2])
            server.sendall(request)
            if server.recv(1) != TAKEN:
                return None
            # the fork is told what this process is told; should this one be killed, the server sees it
            for number in _ENDING:
                signal.signal(number, lambda number, _: server.sendall(bytes([number])))
        except OSError:
            return None
        finally:
            signal.pthread_sigmask(signal.SIG_UNBLOCK, _ENDING)
        # nothing where the server was killed: its forks go with it
        return (server.recv(1) or b"\1")[0]


if __name__ == "__main__":
    code = call(os.environ[SERVER], sys.argv[1:])
    if code is None:
        os.execv(sys.executable, [sys.executable, *sys.argv[1:]])
    sys.exit(code)
