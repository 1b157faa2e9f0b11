"""Threads for tests that compare one with several."""

import numba
import pytest


def several_threads() -> int:
    """As many threads as numba has here; with one alone there is nothing to compare, and the test is skipped."""
    threads = int(numba.config.NUMBA_NUM_THREADS)
    if threads < 2:
        pytest.skip("one thread alone")
    return threads
