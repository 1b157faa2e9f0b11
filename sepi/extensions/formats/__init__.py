"""Readers of formats that few light fields have."""

from sepi.registry import Extension

_MODULES = {"matlab": "matlab", **dict.fromkeys(("eslf", "mosaic", "tiff-stack", "openlf"), "readers")}

EXTENSION = Extension(readers={word: f"{__name__}.{module}" for word, module in _MODULES.items()})
