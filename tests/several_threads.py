"""Threads for tests that compare one with several, and back to one."""

from collections.abc import Iterator
from contextlib import contextmanager

from sepi import kernels

SEVERAL = 3
"""Loops share their turns among so many threads on any machine."""


@contextmanager
def threads(count: int) -> Iterator[None]:
    """Let compiled loops use so many threads."""
    before = kernels.thread_count()
    kernels.set_thread_count(count)
    try:
        yield
    finally:
        kernels.set_thread_count(before)
