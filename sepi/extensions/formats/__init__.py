"""Readers of formats of single programs and devices: MATLAB, lenslet pictures, mosaics, TIFF stacks, OpenLF."""

from sepi.registry import Extension

_MODULES = {"matlab": "matlab", **dict.fromkeys(("eslf", "mosaic", "tiff-stack", "openlf"), "readers")}

EXTENSION = Extension(readers={word: f"{__name__}.{module}" for word, module in _MODULES.items()})
