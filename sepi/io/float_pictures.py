"""Maps as pictures of 32-bit floats: OpenEXR, which compositing programs read, and TIFF."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from sepi.io.exr import open_exr
from sepi.io.files import atomic_path, naming
from sepi.lightfield import FloatMap

EXR = (".exr",)
TIFF = (".tif", ".tiff")
"""Ends of names, in small letters."""


def write_exr(path: Path, channels: Mapping[str, FloatMap], comment: str) -> None:
    """Write maps as channels of one OpenEXR file, compressed without loss; equal content gives equal bytes.

    Parameters
    ----------
    path : Path
    channels : mapping of str to ndarray, shape (H, W), float32
        Name to map, all of one shape; NaN and infinity stay. Programs know the names ``Z`` (depth) and ``Y`` (grey).
    comment : str
        What the numbers are.

    Raises
    ------
    SepiError
        If the package OpenEXR is not installed, or the file cannot be written.
    """
    with naming(path):
        exr = open_exr()
    header = {"compression": exr.ZIP_COMPRESSION, "type": exr.scanlineimage, "comments": comment}
    pixels = {name: np.ascontiguousarray(values, np.float32) for name, values in channels.items()}
    with atomic_path(path) as temporary, exr.File(header, pixels) as file:
        file.write(str(temporary))


def write_tiff(path: Path, values: FloatMap, comment: str) -> None:
    """Write a TIFF of 32-bit floats, compressed without loss; equal content gives equal bytes.

    Parameters
    ----------
    path : Path
    values : ndarray, shape (H, W) or (H, W, 3), float32
        NaN and infinity stay.
    comment : str
        What the numbers are; the picture's description.

    Raises
    ------
    SepiError
        If the file cannot be written.
    """
    import tifffile

    with atomic_path(path) as temporary:
        tifffile.imwrite(
            temporary,
            np.ascontiguousarray(values, np.float32),
            photometric="minisblack" if values.ndim == 2 else "rgb",
            compression="zlib",
            description=comment,
            software="sepi",
            metadata=None,
        )
