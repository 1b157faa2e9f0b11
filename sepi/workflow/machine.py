"""What measured times depend on: processor, cores, versions of libraries; no names of hosts or users."""

from __future__ import annotations

import platform
from importlib.metadata import version
from pathlib import Path
from typing import Any

from sepi.io.provenance import package_version
from sepi.threads import available_cores

LIBRARIES = ("numpy", "scipy", "numba", "opencv-python-headless", "h5py", "pyamg")
"""Distributions that the stages compute with."""


def this_machine() -> dict[str, Any]:
    """Processor, cores that may be used, and versions."""
    return {
        "processor": _processor(),
        "cores": available_cores(),
        "system": platform.system(),
        "python": platform.python_version(),
        "sepi": package_version(),
        **{library: version(library) for library in LIBRARIES},
    }


def _processor() -> str:
    try:
        for line in Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    except OSError:
        pass
    return platform.processor() or platform.machine()
