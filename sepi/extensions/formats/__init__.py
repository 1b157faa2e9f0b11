"""Readers of single programs and devices: MATLAB, HCI 2013, lenslet pictures, mosaics, TIFF stacks, OpenLF."""

from sepi.registry import Extension

# MATLAB's files have a header or suffix of their own, and may hold an array of that name and shape
_MODULES = {
    "matlab": "matlab",
    "hci-2013": "hci_2013",
    **dict.fromkeys(("eslf", "mosaic", "tiff-stack", "openlf"), "readers"),
}

EXTENSION = Extension(readers={word: f"{__name__}.{module}" for word, module in _MODULES.items()})
