"""Memory that OpenBLAS and glibc take, and how to get it first or return it."""

from __future__ import annotations

import ctypes
import sys
from contextlib import suppress

import numpy as np

BLAS_BUFFER = 64_000_000
"""Bytes that must be free for OpenBLAS, which takes 32 MB at its first call."""


def require_memory(number: int) -> None:
    """Raise if a limit on the process's address space (``ulimit -v``) leaves less memory than this.

    At the limit, OpenBLAS would ask for its buffer again without end.

    Parameters
    ----------
    number : int
        Bytes.

    Raises
    ------
    MemoryError
    """
    try:
        # allocated without being written to, and freed at once
        np.empty(number, np.uint8)
    except MemoryError as error:
        raise MemoryError(f"{number // 10**6} MB more are needed than the limit on this process allows") from error


def take_blas_buffer() -> None:
    """Let OpenBLAS take its buffer while there is memory.

    Raises
    ------
    MemoryError
    """
    require_memory(BLAS_BUFFER)
    np.linalg.solve(np.eye(1), np.ones(1))


def give_back_memory() -> None:
    """Let the C library return freed memory to the system, with glibc.

    glibc keeps free memory below memory in use, and later arrays mostly do not fit into it.
    """
    if sys.platform == "linux":
        with suppress(AttributeError, OSError):
            ctypes.CDLL(None).malloc_trim(0)
