"""Readers of single programs and devices, from MATLAB to OpenLF, and writers that a command asks for."""

from sepi.registry import Extension

# MATLAB's files have a header or suffix of their own, and may hold an array of that name and shape
_MODULES = {
    "matlab": "matlab",
    "hci-2013": "hci_2013",
    **dict.fromkeys(("eslf", "mosaic", "tiff-stack", "openlf"), "readers"),
}

EXTENSION = Extension(
    readers={word: f"{__name__}.{module}" for word, module in _MODULES.items()},
    commands={
        "convert": (f"{__name__}.convert", "Write a map of a result as OpenEXR, TIFF or PFM."),
        "export": (f"{__name__}.export", "Save the light field INPUT as read, so that it needs no flags."),
        "points": (f"{__name__}.convert", "Write the point cloud of a result."),
    },
)
