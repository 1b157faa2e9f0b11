"""Description of the machine for files of times: processor, cores, versions; no names of hosts or users."""

from __future__ import annotations

import functools
import os
import platform
import re
from contextlib import suppress
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path
from typing import Any

from sepi.process.threads import available_cores

LIBRARIES = (
    "sepi",
    "numpy",
    "scipy",
    "scikit-image",
    "opencv-python-headless",
    "h5py",
    "pydantic",
    "matplotlib",
    "snakemake",
)
"""Distributions whose versions are listed, if installed."""


def this_machine() -> dict[str, Any]:
    """Processor, usable cores, memory in GiB, and versions."""
    return {
        "processor": _processor(),
        "cores": available_cores(),
        "memory_gb": round(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 2**30, 1),
        "system": platform.system(),
        "python": platform.python_version(),
        **versions(),
    }


@functools.cache
def versions() -> dict[str, str]:
    """Versions of the package, ``"unknown"`` if it is not installed, and of its libraries."""
    found = {"sepi": "unknown"}
    for name in LIBRARIES:
        with suppress(PackageNotFoundError):
            # the first lines alone: to read the others takes every job as long as a small stage
            told = re.search(r"^Version: (.+)$", distribution(name).read_text("METADATA") or "", re.MULTILINE)
            found |= {} if told is None else {name: told[1]}
    return found


def _processor() -> str:
    try:
        for line in Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    except OSError:
        pass
    return platform.processor() or platform.machine()
