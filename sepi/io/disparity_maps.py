"""Disparity maps of any program, read from files of any supported kind, and written as portable float maps (PFM).

PFM is the benchmark's format for disparity: one channel, rows stored bottom-up.
"""

from __future__ import annotations

import math
import re
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from sepi.camera import Part
from sepi.errors import SepiError
from sepi.io.codecs import TIFF
from sepi.io.files import reading, write_whole
from sepi.io.hdf5 import has_dataset, open_hdf5, read_dataset
from sepi.io.images import picture_header, png_texts, read_picture
from sepi.io.readers.array_files import numpy_arrays
from sepi.io.readers.view_grid import cut_like_views
from sepi.lightfield import FloatMap, full_scale
from sepi.validation import described, is_finite, require_map, require_path

# magic, width, height, scale (its sign gives the byte order), each ended by one white space
_HEADER = re.compile(rb"\A(P[fF])\s+(\d{1,9})\s+(\d{1,9})\s+([-+]?[0-9.]+(?:[eE][-+]?\d+)?)\s")


def read_pfm(path: str | Path) -> FloatMap:
    """Read a one-channel PFM of either byte order.

    Parameters
    ----------
    path : str or Path

    Returns
    -------
    ndarray, shape (H, W), float32
        Top row first. Values are as stored: of the header's scale only the sign counts, which gives the byte order.

    Raises
    ------
    SepiError
        If the file is missing, not a PFM, of three channels, or damaged.

    Examples
    --------
    >>> from pathlib import Path
    >>> import numpy as np
    >>> from sepi.io.disparity_maps import read_pfm
    >>> rows = np.array([[3.0, 4.0], [1.0, 2.0]])  # a file begins with the bottom row
    >>> big_endian = b"Pf\\n2 2\\n1.0\\n" + rows.astype(">f4").tobytes()
    >>> size = Path("map.pfm").write_bytes(big_endian)
    >>> read_pfm(Path("map.pfm")).tolist()
    [[1.0, 2.0], [3.0, 4.0]]
    """
    path = require_path("PFM to read", path)
    with reading(path, "one-channel PFM"):
        data = path.read_bytes()
        header = _HEADER.match(data[:256])
        if header is None or header[1] != b"Pf":
            raise SepiError("not a one-channel PFM (expected a header 'Pf WIDTH HEIGHT SCALE')")
        width, height, scale = int(header[2]), int(header[3]), float(header[4])
        body = memoryview(data)[header.end() :]
        if not scale or not 0 < 4 * width * height == len(body):
            raise SepiError(f"damaged PFM: expected {4 * width * height} bytes after the header, got {len(body)}")
        return np.frombuffer(body, "<f4" if scale < 0 else ">f4").reshape(height, width)[::-1].astype(np.float32)


def write_pfm(path: str | Path, values: FloatMap) -> None:
    """Write a map as a one-channel little-endian PFM, whole or not at all.

    Parameters
    ----------
    path : str or Path
        Its folder is made if missing.
    values : ndarray, shape (H, W), float32
        Top row first.

    Raises
    ------
    SepiError
        If the file cannot be written.

    Examples
    --------
    >>> from pathlib import Path
    >>> import numpy as np
    >>> from sepi.io.disparity_maps import read_pfm, write_pfm
    >>> write_pfm(Path("maps/cotton.pfm"), np.array([[0.25, np.nan]], np.float32))
    >>> read_pfm(Path("maps/cotton.pfm")).tolist()
    [[0.25, nan]]
    """
    path = require_path("PFM to write", path)
    require_map(str(path), values)
    height, width = values.shape
    write_whole(path, f"Pf\n{width} {height}\n-1\n".encode() + values[::-1].astype("<f4").tobytes())


_HDF5 = (".h5", ".hdf5")

_NUMPY = (".npy", ".npz")

SUFFIXES: tuple[str, ...] = (".pfm", *_NUMPY, ".png", ".pgm", *TIFF, *_HDF5)
"""Suffixes of the files that are read, in lower case."""

_DATASET = "disparity"
# text chunks of `disparity_16bit.png`
_SCALE, _OFFSET = "scale", "offset"


def map_file(path: Path) -> Path:
    """File of the map: ``path`` itself, or ``disparity.pfm`` in a folder that ``sepi depth`` wrote."""
    return path / "disparity.pfm" if path.is_dir() else path


def is_disparity(path: Path) -> bool:
    """Whether ``path`` is one disparity map rather than a light field.

    A PNG says so in its text chunks. A TIFF is a map if it is grey with floats, a NumPy file if its arrays have two
    axes.
    """
    if path.is_dir():
        return map_file(path).is_file()
    suffix = path.suffix.lower()
    if suffix in _HDF5:
        return has_dataset(path, _DATASET)
    if suffix == ".png":
        return {_SCALE, _OFFSET} <= set(png_texts(path))
    with suppress(SepiError):
        if suffix in TIFF:
            header = picture_header(path)
            return header.kind == "TIFF" and header.grey and header.pixel_bytes == 4
        if suffix in _NUMPY:
            return all(len(one.shape) == 2 for one in numpy_arrays(path).values())
    return suffix in SUFFIXES and suffix not in TIFF


def read_disparity(path: str | Path, *, scale: float | None = None, offset: float = 0.0) -> FloatMap:
    """Read one disparity map.

    Parameters
    ----------
    path : str or Path
        A one-channel PFM; a NumPy file (``.npy``, ``.npz``) with one array of numbers of shape (H, W); an HDF5 file
        with such a dataset ``disparity``; a grey TIFF of 32-bit floats; a grey PNG, TIFF or PGM of 8 or 16 bit; or a
        folder that ``sepi depth`` wrote. A PNG with the text chunks ``scale`` and ``offset``, as
        ``disparity_16bit.png`` has them, is decoded by these; 0 is unknown.
    scale, offset : float
        The disparity is the stored value times ``scale`` (default 1) plus ``offset``; a scale of -1 turns the sign.
        Images of 8 or 16 bit without these text chunks need a scale; none of their values means unknown.

    Returns
    -------
    ndarray, shape (H, W), float32
        Disparity in pixels per view step, top row first; NaN where it is unknown.

    Raises
    ------
    SepiError
        If the file is missing, damaged or no disparity map, or an image of levels has no scale.

    Examples
    --------
    A map of another program, whose disparity grows with distance, in pixels between the outermost of nine views:

    >>> from pathlib import Path
    >>> import numpy as np
    >>> from sepi.io.disparity_maps import read_disparity
    >>> np.save("other.npy", np.array([[-8.0, -2.0, 4.0]]))
    >>> read_disparity(Path("other.npy"), scale=-1 / 8).tolist()
    [[1.0, 0.25, -0.5]]
    """
    path = map_file(require_path("disparity map", path))
    for name, value in (("scale", 1 if scale is None else scale), ("offset", offset)):
        if not is_finite(value):
            raise SepiError(f"{path}: {name}: expected a finite number, got {described(value)}")
    return _scaled(_stored(path, scale is not None), scale, offset)


@dataclass(frozen=True)
class TruthFile:
    """A file of ground truth that a user gives for a light field.

    Attributes
    ----------
    path : Path
        As for :func:`read_disparity`. In whole numbers 0 is unknown, in floats what is not finite.
    scale : float or None
        Pixels per view step of a stored value of 1, above 0; default: 1.
    """

    path: Path
    scale: float | None = None

    def read(self, shape: tuple[int, int] | None = None, part: Part | None = None) -> FloatMap:
        """Disparity in pixels per view step, (H, W) float32, top row first; NaN where unknown.

        Ground truth of the whole image is cropped to views of this ``shape`` as ``part`` says.

        Raises
        ------
        SepiError
            If it cannot be read, does not have the views' ``shape``, or all its pixels are unknown.
        """
        path = map_file(self.path)
        stored = _stored(path, self.scale is not None)
        stored = stored if shape is None else cut_like_views(stored, shape, part)
        truth = _scaled(stored, self.scale)
        known = np.isfinite(truth) if stored.dtype.kind == "f" else stored != 0
        if shape not in (None, truth.shape):
            raise SepiError(f"{path}: ground truth is {truth.shape}, the views are {shape} (height, width)")
        if not known.any():
            raise SepiError(f"{path}: no pixel is known; 0 in whole numbers, NaN and infinity in others are unknown")
        return np.where(known, truth, np.float32(np.nan))

    @property
    def step(self) -> float:
        """Quantisation step of the disparity, pixels per view step; 0 if the file holds floats."""
        return 0.0 if _stored(map_file(self.path), self.scale is not None).dtype.kind == "f" else self.scale or 1.0


def _scaled(stored: npt.NDArray[Any], scale: float | None, offset: float = 0.0) -> FloatMap:
    # numbers beyond float32 become infinite: unknown
    with np.errstate(over="ignore", invalid="ignore"):
        if scale is None and offset == 0:
            return np.asarray(stored, np.float32)
        # float32 first, so that all formats give the same numbers
        held = stored.astype(np.float32).astype(np.float64)
        return np.asarray(held * (1 if scale is None else scale) + offset, np.float32)


def _stored(path: Path, scaled: bool) -> npt.NDArray[Any]:
    """The stored numbers of a file, (H, W), integers or floats."""
    if not path.is_file():
        raise SepiError(f"{path}: no such file")
    suffix = path.suffix.lower()
    if suffix == ".pfm":
        return read_pfm(path)
    if suffix in (".png", ".pgm", *TIFF):
        return _read_levels(path, scaled)
    if suffix in _NUMPY:
        arrays = numpy_arrays(path)
        if len(arrays) != 1:
            raise SepiError(f"{path}: expected one array of shape (H, W), found {', '.join(arrays) or 'none'}")
        (values,) = (one.read() for one in arrays.values())
    elif suffix in _HDF5:
        with open_hdf5(path) as file:
            values = read_dataset(path, file[_DATASET])
    else:
        raise _no_map(path)
    if values.ndim != 2 or values.dtype.kind not in "fiu":
        raise SepiError(f"{path}: expected an array of numbers of shape (H, W), got {values.dtype} {values.shape}")
    return values


def _read_levels(path: Path, scaled: bool) -> npt.NDArray[Any]:
    levels, header = read_picture(path, any_floats=True)[:, :, 0], picture_header(path)
    if levels.dtype == np.float32 and header.grey and header.kind == "TIFF":
        return levels
    # decoding stretches fewer than 8 bits
    if not header.grey or not (header.white or header.kind == "TIFF"):
        raise _no_map(path)
    texts = png_texts(path)
    if {_SCALE, _OFFSET} <= set(texts):
        own_scale, own_offset = (_number(path, key, texts[key]) for key in (_SCALE, _OFFSET))
        values = (levels.astype(np.float64) - 1) * own_scale + own_offset
        return np.where(levels > 0, values, np.nan).astype(np.float32)
    if not scaled:
        kind = "a PNG without the text chunks 'scale' and 'offset'" if header.kind == "PNG" else f"a {header.kind}"
        raise SepiError(f"{path}: {kind} does not say what its levels mean; give a scale, or write it as .pfm or .npy")
    # the levels of a PGM end at a white of its own
    return np.rint(levels * (header.white / full_scale(levels.dtype))).astype(int) if header.white else levels


def _number(path: Path, key: str, text: str) -> float:
    with suppress(ValueError):
        if math.isfinite(value := float(text)):
            return value
    raise SepiError(f"{path}: text chunk '{key}' must be a number, got {text[:40]!r}")


def _no_map(path: Path) -> SepiError:
    kinds = "as .pfm, .h5 or .npy, or as grey .png of 8 or 16 bit, .pgm or .tiff"
    return SepiError(f"{path}: expected a disparity map {kinds}")
