"""Memory that a direct solver needs beside its factors."""

from __future__ import annotations

import numpy as np

# OpenBLAS takes 32 MB at its first call; bytes, with some to spare
_BLAS_BUFFER = 64_000_000


def require_blas_memory() -> None:
    """See that there is memory for the buffer of OpenBLAS; to be called before SciPy's SuperLU is.

    OpenBLAS asks for it again and again, without end, where a limit on the process's memory is reached.

    Raises
    ------
    MemoryError
    """
    # taken, not written to, and given back at once
    np.empty(_BLAS_BUFFER, np.uint8)
