"""What libraries are told by the environment: how threads wait for each other, and in what pages memory comes."""

from __future__ import annotations

import os

FOR_THREADS = {"OMP_WAIT_POLICY": "PASSIVE", "GOMP_SPINCOUNT": "5000"}
"""How threads wait for work: they look for it for some tenths of a millisecond, then sleep.

They would go on looking for some milliseconds after each loop, which helps nobody where all cores are free, and takes
them from whatever else runs where they are not: the other threads of this process, too. To wake one takes longer than
the solver's loops do.
"""


def wait_asleep() -> None:
    """Have threads that wait for work sleep soon, unless the user's environment says how they wait.

    Before the first compiled loop, hence when the package is imported; processes started from here do likewise.
    """
    if not FOR_THREADS.keys() & os.environ.keys():
        os.environ.update(FOR_THREADS)


FOR_NUMPY = {"OPENBLAS_NUM_THREADS": "1", "NUMPY_MADVISE_HUGEPAGE": "0"}
"""What a process of this package tells NumPy before it is imported.

OpenBLAS starts no threads: products here are small, and its threads would do little but spin. Linux is asked for no
pages of 2 MB: to find and clear them takes a twenty-fifth of the time of ``sepi depth``, and an eighth more memory,
since arrays here are used up as fast as they are made.
"""


def prepare_numpy() -> None:
    """Tell NumPy so, unless the user's environment says otherwise: by the command only, others may have other needs."""
    for name, value in FOR_NUMPY.items():
        os.environ.setdefault(name, value)
