"""HDF5 files of the first HCI benchmark [1]_.

``LF (T, S, H, W, 3)`` uint8 holds the views. ``GT_DEPTH`` is the depth of every view, ``(T, S, H, W)``, or of the
centre view, ``(H, W)``. With the file's attributes ``dH`` (camera distance), ``focalLength`` (pixels) and ``shift``,
depth ``Z`` has the disparity ``dH focalLength / Z - shift``.

References
----------
.. [1] S. Wanner, S. Meister, B. Goldluecke, "Datasets and benchmarks for densely sampled 4D light fields", VMV 2013.
       doi:10.2312/PE.VMV.VMV13.225-226
"""

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import numpy.typing as npt

from sepi.camera import Camera
from sepi.errors import SepiError
from sepi.io.hdf5 import attribute, has_dataset, open_hdf5, read_dataset
from sepi.io.readers.arrays import light_field_from_array
from sepi.io.readers.formats import Format, size_in_hdf5
from sepi.io.readers.options import ReadOptions
from sepi.io.readers.view_grid import arrange_numbers
from sepi.lightfield import FloatMap, LightField

DepthMap = npt.NDArray[Any]

_VIEWS = "LF"
_DEPTH = "GT_DEPTH"

_GEOMETRY = ("dH", "focalLength", "shift")


def matches(path: Path) -> bool:
    """Whether ``path`` is a readable HDF5 file with a dataset ``LF`` of that shape."""
    return has_dataset(path, _VIEWS, lambda one: isinstance(one, h5py.Dataset) and _is_layout(one.shape or ()))


def read(path: Path, options: ReadOptions) -> LightField:
    """Read an HDF5 file of the first benchmark.

    Returns
    -------
    LightField
        With the camera and the ground truth of the reference view if the file has them; NaN where the file's depth is
        not a positive number.
    """
    with open_hdf5(path, "file of the first HCI benchmark") as file:
        if isinstance(file.get(_VIEWS), h5py.Group):
            raise SepiError(f"{path}: '{_VIEWS}' is a group, not an array; see --format openlf")
        views = read_dataset(path, file[_VIEWS])
        shape = views.shape
        if not _is_layout(shape):
            raise SepiError(f"{path}: expected '{_VIEWS}' (T, S, H, W, 3), got {shape}; as .npy, --axes tells")
        camera, reason = _read_camera(file)
        light_field = light_field_from_array(views, path, options, axes="TSHWC")
        number = int(arrange_numbers(str(path), shape[:2], options)[light_field.reference_position])
        depth = _read_depth(path, file, shape, divmod(number, shape[1])) if _DEPTH in file else None
    if camera is None:
        note = f"no metric depth{'' if depth is None else ' and no ground truth'}: {reason}"
        return replace(light_field, notes=(*light_field.notes, note))
    ground_truth = None if depth is None else _disparity(depth, camera)
    return replace(light_field, camera=camera, ground_truth=ground_truth)


def number_of(holder: h5py.Group, key: str) -> float:
    """Number in an attribute, even as text or in an array of one; NaN if there is no such attribute.

    Raises
    ------
    SepiError
        If the attribute is not one number.
    """
    given = attribute(holder, key) if key in holder.attrs else math.nan
    try:
        (value,) = np.ravel(given).astype(float)
        return float(value)
    except (TypeError, ValueError) as error:
        raise SepiError(f"expected the attribute '{key}' to be a number, got {given!r}") from error


def _is_layout(shape: tuple[int, ...]) -> bool:
    return len(shape) == len("TSHWC") and shape[4] in (1, 3)


def _read_camera(file: h5py.File) -> tuple[Camera | None, str]:
    """Camera, or the reason why there is none."""
    missing = [key for key in _GEOMETRY if key not in file.attrs]
    if missing:
        return None, f"the file has no attribute {', '.join(missing)}"
    baseline, focal_length, shift = (number_of(file, key) for key in _GEOMETRY)
    if not (0 < baseline < math.inf and 0 < focal_length < math.inf and math.isfinite(shift)):
        return None, f"dH {baseline:g}, focalLength {focal_length:g}, shift {shift:g} are not valid for a camera"
    return Camera(baseline * focal_length, shift, focal_length), ""


def _read_depth(path: Path, file: h5py.File, shape: tuple[int, ...], view: tuple[int, int]) -> DepthMap | None:
    """Depth of one view of the given grid; None if the file does not have it."""
    dataset = file[_DEPTH]
    if dataset.shape == shape[2:4]:
        centre = shape[0] // 2, shape[1] // 2
        return read_dataset(path, dataset) if view == centre else None
    if dataset.shape == shape[:4]:
        return read_dataset(path, dataset, view)
    raise SepiError(f"{path}: '{_DEPTH}' has shape {dataset.shape}; expected {shape[:4]}, or the centre view's")


def _disparity(depth: DepthMap, camera: Camera) -> FloatMap:
    """Disparity of a depth map; NaN where the depth is not a positive number."""
    # NaN may be a signalling one, of which NumPy warns
    with np.errstate(over="ignore", invalid="ignore"):
        depth = depth.astype(np.float64)
        known = np.isfinite(depth) & (depth > 0)
        disparity = (camera.scale / np.where(known, depth, 1) - camera.offset).astype(np.float32)
    disparity[~(known & np.isfinite(disparity))] = np.nan
    return disparity


_FORM = "HCI 2013 HDF5", "with LF (T, S, H, W, 3)"
FORMATS = {"hci-2013": Format(*_FORM, matches, read, truth_files=lambda path: (path,), size_of=size_in_hdf5)}
