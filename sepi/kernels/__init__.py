"""Compiled loops: a submodule for each file ``kernels/NAME.cpp`` of a folder, built for the kind of processor this is.

Kernels look at arrays where they are: a wrong type, number of axes or memory order is a ``TypeError``, sizes are the
caller's care. They run outside Python's lock, on as many threads as :func:`sepi.process.threads.use_threads` says, to
the same bytes on any number of threads and on any processor.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from importlib import import_module
from importlib.util import find_spec

from sepi.kernels import checkout

LEVEL = "SEPI_KERNELS"
"""Environment variable: ``baseline`` for kernels that all processors can run, to compare them with this one's."""

if not checkout.is_current():
    checkout.build(only_if_changed=True)

_native = import_module(f"{__name__}.baseline._native")
if os.environ.get(LEVEL) != "baseline" and _native.has_x86_64_v3() and find_spec(f"{__name__}.x86_64_v3"):
    _native = import_module(f"{__name__}.x86_64_v3._native")
globals().update({name: part for name, part in vars(_native).items() if not name.startswith("__")})

LANES: int = _native.LANES
"""Numbers in a vector: as many lie behind arrays that kernels read as vectors."""

thread_count: Callable[[], int] = _native.thread_count
"""Threads of a loop, the caller's among them."""

set_thread_count: Callable[[int], None] = _native.set_thread_count
"""Have each loop use so many threads."""


def available_cores() -> int:
    """Number of cores that this process may use, which a container or a scheduler may limit."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


set_thread_count(available_cores())
if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_native.forget_threads)
