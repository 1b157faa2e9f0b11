"""Runs calls that may hang or crash the program in a process of their own."""

from __future__ import annotations

import os
import signal
import warnings
from collections.abc import Callable

CAN_TRY = hasattr(os, "fork")
"""Whether this system can; where it cannot, a call is risked."""


def outcome(call: Callable[[], object], seconds: float) -> bool | None:
    """Whether a call returns something true rather than raising an exception; None if it does not return.

    Parameters
    ----------
    call : callable
        Of nothing that other threads may have locked, but for HDF5, where h5py minds it. What it changes is lost.
    seconds : float
        What it may take of the processor: a busy machine is no reason to give up.
    """
    if not CAN_TRY:
        return _is_true(call)
    with warnings.catch_warnings(action="ignore"):
        # of threads, which Python warns of
        child = os.fork()
    if child == 0:
        found = False
        try:
            signal.signal(signal.SIGPROF, signal.SIG_DFL)
            signal.setitimer(signal.ITIMER_PROF, seconds)
            found = _is_true(call)
        finally:
            os._exit(0 if found else 1)
    status = os.waitpid(child, 0)[1]
    return os.WEXITSTATUS(status) == 0 if os.WIFEXITED(status) else None


def _is_true(call: Callable[[], object]) -> bool:
    try:
        return bool(call())
    except Exception:
        return False
