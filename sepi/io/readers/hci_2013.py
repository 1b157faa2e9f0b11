"""HDF5 files in the layout of the first HCI light field benchmark [1]_.

``LF (T, S, H, W, 3)`` uint8 holds the views, ``GT_DEPTH (T, S, H, W)`` the depth of every view, or ``(H, W)`` that of
the centre view. With the file's attributes ``dH`` (distance of cameras), ``focalLength`` (pixels) and ``shift``, depth
``Z`` has the disparity ``dH focalLength / Z - shift``.

References
----------
.. [1] S. Wanner, S. Meister, B. Goldluecke, "Datasets and benchmarks for densely sampled 4D light fields", VMV 2013.
       doi:10.2312/PE.VMV.VMV13.225-226
"""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import numpy.typing as npt

from sepi.camera import Camera
from sepi.errors import SepiError
from sepi.io.hdf5 import has_dataset, open_hdf5, read_dataset, require_values_inside
from sepi.io.readers.arrays import light_field_from_array
from sepi.io.readers.options import ReadOptions, arrange_numbers, require_unused
from sepi.lightfield import FloatMap, LightField

VIEWS = "LF"
DEPTH = "GT_DEPTH"

_GEOMETRY = ("dH", "focalLength", "shift")
# attribute to the axis of the views whose size it gives
_SIZES = {"vRes": 0, "hRes": 1, "yRes": 2, "xRes": 3, "channels": 4}


def matches(path: Path) -> bool:
    """Whether ``path`` is a readable HDF5 file with a dataset ``LF``."""
    return has_dataset(path, VIEWS)


def read(path: Path, options: ReadOptions) -> LightField:
    """Read such a file.

    Returns
    -------
    LightField
        With the ground truth of its reference view, NaN where the file's depth is not a positive number, and with the
        camera, where the file gives them.

    Raises
    ------
    SepiError
        If the file is damaged, or views, depth or attributes are not as above; else as
        :func:`sepi.io.readers.arrays.light_field_from_array`.
    """
    require_unused(str(path), options, ("grid", "pattern", "axes", "variable", "follow_links"))
    with open_hdf5(path) as file:
        if VIEWS not in file:
            raise SepiError(f"{path}: not of the first HCI benchmark: dataset '{VIEWS}' is missing")
        views = file[VIEWS]
        require_values_inside(path, views)
        if views.ndim != 5 or views.shape[4] not in (1, 3):
            raise SepiError(
                f"{path}: expected '{VIEWS}' of shape (T, S, H, W, 3), got {views.shape}; if it is a light field of "
                "other axes, write it as .npy and name them with --axes"
            )
        shape = views.shape
        camera, reason = _read_camera(path, file)
        light_field = light_field_from_array(
            read_dataset(path, views),
            name=path.stem,
            source=str(path),
            options=options,
            axes="TSHWC",
            notes=_contradictions(path, file, shape),
        )
        numbers = arrange_numbers(str(path), shape[:2], options)
        number = int(numbers[light_field.reference_position])
        depth = _read_depth(path, file, shape, (number // shape[1], number % shape[1]))
    if camera is None:
        note = f"no metric depth{'' if depth is None else ' and no ground truth'}: {reason}"
        return replace(light_field, notes=(*light_field.notes, note))
    ground_truth = None if depth is None else _disparity(depth, camera)
    return replace(light_field, camera=camera, ground_truth=ground_truth)


def _read_camera(path: Path, file: h5py.File) -> tuple[Camera | None, str]:
    """The camera, or the reason why there is none."""
    missing = [key for key in _GEOMETRY if key not in file.attrs]
    if missing:
        return None, f"the file has no attribute {', '.join(missing)}"
    baseline, focal_length, shift = (_number(path, file, key) for key in _GEOMETRY)
    if not (0 < baseline < math.inf and 0 < focal_length < math.inf and math.isfinite(shift)):
        return None, f"dH {baseline:g}, focalLength {focal_length:g}, shift {shift:g} are no camera's"
    return Camera(baseline * focal_length, shift, focal_length), ""


def _number(path: Path, file: h5py.File, key: str) -> float:
    """An attribute that is a number, or an array or text of one."""
    values = np.ravel(file.attrs[key])
    try:
        if values.size != 1:
            raise ValueError
        return float(values[0])
    except (TypeError, ValueError) as error:
        raise SepiError(f"{path}: expected the attribute '{key}' to be a number, got {file.attrs[key]!r}") from error


def _contradictions(path: Path, file: h5py.File, shape: tuple[int, ...]) -> list[str]:
    """Attributes that say another size than the views have."""
    sizes = {key: _number(path, file, key) for key in _SIZES if key in file.attrs}
    return [
        f"attribute {key} is {size:g}, but the views have {shape[_SIZES[key]]}"
        for key, size in sizes.items()
        if size != shape[_SIZES[key]]
    ]


def _read_depth(
    path: Path, file: h5py.File, shape: tuple[int, ...], view: tuple[int, int]
) -> npt.NDArray[np.float64] | None:
    """Depth of one view of the given grid; None where the file does not have it."""
    if DEPTH not in file:
        return None
    dataset = file[DEPTH]
    require_values_inside(path, dataset)
    if dataset.shape == shape[:4]:
        return np.asarray(dataset[view], np.float64)
    if dataset.shape == shape[2:4]:
        centre = shape[0] // 2, shape[1] // 2
        return np.asarray(dataset[...], np.float64) if view == centre else None
    raise SepiError(
        f"{path}: '{DEPTH}' has shape {dataset.shape}; expected {shape[:4]} like the views, or {shape[2:4]} for the "
        "centre view"
    )


def _disparity(depth: npt.NDArray[np.float64], camera: Camera) -> FloatMap:
    """Disparity of a depth map; NaN where the depth is not a positive number."""
    known = np.isfinite(depth) & (depth > 0)
    with np.errstate(over="ignore"):
        disparity = (camera.scale / np.where(known, depth, 1) - camera.offset).astype(np.float32)
    disparity[~(known & np.isfinite(disparity))] = np.nan
    return disparity
