"""Description of the machine for files of times: processor, cores, versions; no names of hosts or users."""

from __future__ import annotations

import os
import platform
from pathlib import Path
from typing import Any

from sepi.io.provenance import package_version, version_of
from sepi.process.threads import available_cores

LIBRARIES = ("numpy", "scipy", "scikit-image", "opencv-python-headless", "h5py", "pydantic", "matplotlib", "snakemake")
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


def versions() -> dict[str, str]:
    """Versions of the package, ``"unknown"`` if it is not installed, and of its libraries."""
    found = {name: version_of(name) for name in LIBRARIES}
    return {"sepi": package_version()} | {name: told for name, told in found.items() if told}


def _processor() -> str:
    try:
        for line in Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    except OSError:
        pass
    return platform.processor() or platform.machine()
