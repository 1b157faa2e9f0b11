"""Readers of formats that few light fields have."""

from sepi.registry import Extension

EXTENSION = Extension(
    readers={
        "mosaic": f"{__name__}.mosaic",
        "tiff-stack": f"{__name__}.tiff_stack",
        "openlf": f"{__name__}.open_lf",
    }
)
