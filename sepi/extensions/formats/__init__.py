"""Readers of formats that few light fields have."""

from sepi.registry import Extension

EXTENSION = Extension(readers=dict.fromkeys(("mosaic", "tiff-stack", "openlf"), f"{__name__}.readers"))
