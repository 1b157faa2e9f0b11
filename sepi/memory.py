"""Memory that must be there before a library takes it that does not know how to do without."""

from __future__ import annotations

import ctypes
import sys
from contextlib import suppress

import numpy as np

BLAS_BUFFER = 64_000_000
"""OpenBLAS takes 32 MB at its first call; bytes, with some to spare."""


def require_memory(number: int) -> None:
    """See that there is memory where a limit on the process's address space is set (``ulimit -v``).

    OpenBLAS asks for its buffer again and again, without end, where the limit is reached.

    Parameters
    ----------
    number : int
        Bytes.

    Raises
    ------
    MemoryError
    """
    try:
        # taken, not written to, and given back at once
        np.empty(number, np.uint8)
    except MemoryError as error:
        raise MemoryError(f"{number // 10**6} MB more are needed than a limit on this process leaves") from error


def take_blas_buffer() -> None:
    """Have OpenBLAS take its buffer, while there is memory for it.

    Raises
    ------
    MemoryError
    """
    require_memory(BLAS_BUFFER)
    np.linalg.solve(np.eye(1), np.ones(1))


def give_back_memory() -> None:
    """Have the C library give back what arrays have freed, as far as the system's can.

    glibc keeps free what lies below something that is in use, and what is made next mostly does not fit in there.
    """
    if sys.platform == "linux":
        with suppress(AttributeError, OSError):
            ctypes.CDLL(None).malloc_trim(0)
