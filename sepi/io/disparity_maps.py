"""One disparity map of any program: the place where a file of any kind becomes an array."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from sepi.errors import SepiError
from sepi.io.hdf5 import has_dataset, open_hdf5, read_dataset
from sepi.io.images import picture_header, png_texts, read_picture
from sepi.io.pfm import read_pfm
from sepi.io.readers.numpy_files import read_array
from sepi.lightfield import FloatMap
from sepi.validation import described, is_finite, require_path

_HDF5 = (".h5", ".hdf5")

_TIFF = (".tif", ".tiff")

SUFFIXES: tuple[str, ...] = (".pfm", ".npy", ".png", *_TIFF, *_HDF5)
"""Ends of names of the files that are read, in small letters."""

_DATASET = "disparity"
# colour type of a PNG, the 26th byte of its header
_GREY = 0
# text chunks of `disparity_16bit.png`
_SCALE, _OFFSET = "scale", "offset"


def map_file(path: Path) -> Path:
    """The file with the map: ``path`` itself, or ``disparity.pfm`` in a folder that ``sepi depth`` wrote."""
    return path / "disparity.pfm" if path.is_dir() else path


def is_disparity(path: Path) -> bool:
    """Whether ``path`` is one disparity map rather than a light field.

    Of a PNG, whether its text chunks say so; of a TIFF, whether it is grey, of floats.
    """
    if path.is_dir():
        return map_file(path).is_file()
    suffix = path.suffix.lower()
    if suffix in _HDF5:
        return has_dataset(path, _DATASET)
    if suffix == ".png":
        return {_SCALE, _OFFSET} <= set(png_texts(path))
    if suffix in _TIFF:
        return _is_float_tiff(path)
    return suffix in SUFFIXES


def read_disparity(path: str | Path, *, scale: float | None = None, offset: float = 0.0) -> FloatMap:
    """Read one disparity map.

    Parameters
    ----------
    path : str or Path
        A one-channel PFM; a NumPy file (``.npy``) with an array of numbers of shape (H, W); an HDF5 file with such a
        dataset ``disparity``; a grey TIFF of 32-bit floats; a grey PNG of 8 or 16 bit; or a folder that ``sepi depth``
        wrote. A PNG with the text chunks ``scale`` and ``offset``, as ``disparity_16bit.png`` has them, holds what
        these say, 0 being unknown.
    scale, offset : float
        What the file holds is multiplied by ``scale`` (1 unless given), then ``offset`` is added: -1 turns a map of
        opposite sign. A PNG without these text chunks needs a scale; its values are levels, and none means unknown.

    Returns
    -------
    ndarray, shape (H, W), float32
        Disparity in pixels per view step, top row first; NaN where it is unknown.

    Raises
    ------
    SepiError
        If there is no such file, it is damaged or no such map, or a PNG does not say what its levels mean.

    Examples
    --------
    Another program's map, whose disparities are larger for what is farther, in pixels between the outermost of nine
    views:

    >>> from pathlib import Path
    >>> import numpy as np
    >>> from sepi.io.disparity_maps import read_disparity
    >>> np.save("other.npy", np.array([[-8.0, -2.0, 4.0]]))
    >>> read_disparity(Path("other.npy"), scale=-1 / 8).tolist()
    [[1.0, 0.25, -0.5]]
    """
    path = map_file(require_path("disparity map", path))
    if not path.is_file():
        raise SepiError(f"{path}: no such file")
    for name, value in (("scale", 1 if scale is None else scale), ("offset", offset)):
        if not is_finite(value):
            raise SepiError(f"{path}: {name}: expected a finite number, got {described(value)}")
    # numbers beyond float32 become infinite, and count as unknown
    with np.errstate(over="ignore", invalid="ignore"):
        values = _read(path, scaled=scale is not None)
        if scale is None and offset == 0:
            return values
        return np.asarray(values.astype(np.float64) * (1 if scale is None else scale) + offset, np.float32)


def _read(path: Path, scaled: bool) -> FloatMap:
    suffix = path.suffix.lower()
    if suffix == ".pfm":
        return read_pfm(path)
    if suffix == ".png":
        return _read_png(path, scaled)
    if suffix in _TIFF:
        return _read_tiff(path)
    if suffix == ".npy":
        values = read_array(path)
    elif suffix in _HDF5:
        with open_hdf5(path) as file:
            values = read_dataset(path, file[_DATASET])
    else:
        raise _no_map(path)
    if values.ndim != 2 or values.dtype.kind not in "fiu":
        raise SepiError(f"{path}: expected an array of numbers of shape (H, W), got {values.dtype} {values.shape}")
    return np.asarray(values, np.float32)


def _is_float_tiff(path: Path) -> bool:
    try:
        header = picture_header(path)
    except SepiError:
        return False
    return header.kind == "TIFF" and header.grey and header.pixel_bytes == 4


def _read_tiff(path: Path) -> FloatMap:
    values = read_picture(path, any_floats=True)
    if values.dtype != np.float32 or values.shape[2] != 1:
        raise _no_map(path)
    return np.asarray(values[:, :, 0], np.float32)


def _read_png(path: Path, scaled: bool) -> FloatMap:
    levels = read_picture(path)[:, :, 0].astype(np.float64)
    with path.open("rb") as file:
        head = file.read(26)
    # levels of fewer bits would have been stretched to 8
    if not head.startswith(b"\x89PNG") or head[24] not in (8, 16) or head[25] != _GREY:
        raise _no_map(path)
    texts = png_texts(path)
    if {_SCALE, _OFFSET} <= set(texts):
        own_scale, own_offset = (_number(path, key, texts[key]) for key in (_SCALE, _OFFSET))
        return np.where(levels > 0, (levels - 1) * own_scale + own_offset, np.nan).astype(np.float32)
    if not scaled:
        raise SepiError(
            f"{path}: a PNG without the text chunks 'scale' and 'offset' does not say what its levels mean; give a "
            "scale (disparity = level * scale + offset) where it is configured, or write the map as .pfm or .npy"
        )
    return levels.astype(np.float32)


def _number(path: Path, key: str, text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise SepiError(f"{path}: text chunk '{key}' must be a number, got {text[:40]!r}")
    return value


def _no_map(path: Path) -> SepiError:
    kinds = "as .pfm, .h5 or .npy, or as grey .png of 8 or 16 bit, or as grey .tiff of 32-bit floats"
    return SepiError(f"{path}: expected a disparity map {kinds}")
