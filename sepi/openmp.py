"""How the threads of compiled loops wait for each other."""

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
