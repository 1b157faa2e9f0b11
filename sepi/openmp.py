"""How the threads of compiled loops and of linear algebra wait for each other."""

from __future__ import annotations

import os

VARIABLE = "OMP_WAIT_POLICY"


def wait_asleep() -> None:
    """Have threads that wait for work sleep, unless the user's environment says otherwise.

    They would go on spinning for some milliseconds after each loop, which helps nobody where all cores are free, and
    takes them from whatever else runs where they are not: the other threads of this process, too. Before the first
    compiled loop, hence when the package is imported; processes started from here do likewise.
    """
    os.environ.setdefault(VARIABLE, "PASSIVE")


def one_thread_of_blas() -> None:
    """Have OpenBLAS start no threads, unless the user's environment says otherwise.

    Its products here are small: its threads would do little but spin. Before NumPy is imported, and by the command
    only: who imports the package may have large ones.
    """
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
