"""Description of the machine for files of times: processor, cores, versions; no names of hosts or users."""

from __future__ import annotations

import functools
import platform
from contextlib import suppress
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import psutil

from sepi.io.provenance import package_version
from sepi.process.threads import available_cores

LIBRARIES = (
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
        "memory_gb": round(psutil.virtual_memory().total / 2**30, 1),
        "system": platform.system(),
        "python": platform.python_version(),
        **versions(),
    }


@functools.cache
def versions() -> dict[str, str]:
    """Versions of the package and its libraries; takes 50 ms."""
    found = {"sepi": package_version()}
    for name in LIBRARIES:
        with suppress(PackageNotFoundError):
            found[name] = version(name)
    return found


def _processor() -> str:
    try:
        for line in Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    except OSError:
        pass
    return platform.processor() or platform.machine()
