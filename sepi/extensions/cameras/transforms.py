"""Calibrated cameras in a ``transforms.json`` of nerfstudio or instant-ngp.

Poses are from the camera to the world; the camera's axes point right, up and back. Principal points count from the
picture's corner. Values that a frame lacks are those of the file.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path, PureWindowsPath
from typing import Any

import numpy as np

from sepi.camera.rig import FISHEYE, METRES, PINHOLE, Lens, Shot
from sepi.errors import SepiError
from sepi.extensions.cameras.model import UNITS_OF_MODEL, CameraModel
from sepi.extensions.cameras.pictures import Pictures
from sepi.extensions.cameras.table import rotation_of
from sepi.io.files import naming, reading

_MOST_BYTES = 256 * 2**20
_MODELS = {"OPENCV": PINHOLE, "PINHOLE": PINHOLE, "SIMPLE_PINHOLE": PINHOLE, "OPENCV_FISHEYE": FISHEYE}
_COEFFICIENTS = {PINHOLE: ("k1", "k2", "p1", "p2", "k3", "k4"), FISHEYE: ("k1", "k2", "k3", "k4")}
# right, up, back to right, down, forward
_TURN = np.diag([1.0, -1.0, -1.0])


def read_transforms(path: Path, pictures: Pictures) -> CameraModel:
    """The cameras of a ``transforms.json``.

    Raises
    ------
    SepiError
        If it is damaged, a value is missing or wrong, or a picture is missing.
    """
    with reading(path, "transforms.json"):
        if path.stat().st_size > _MOST_BYTES:
            raise SepiError("not a transforms.json: too long")
        told = json.loads(path.read_bytes())
    frames = told.get("frames") if isinstance(told, dict) else None
    if not isinstance(frames, list) or not frames or not all(isinstance(frame, dict) for frame in frames):
        raise SepiError(f"{path}: no cameras; expected a list 'frames'")
    # nerfstudio's own rotation and scale of the world
    shots, files, masks = [], [], []
    for n, frame in enumerate(frames, 1):
        entry = {**told, **frame}
        name = entry.get("file_path")
        if not isinstance(name, str) or not name:
            raise SepiError(f"{path}: frame {n}: no file_path")
        name = name.removeprefix("./")
        file = _found(pictures, name)
        files.append(file)
        mask = entry.get("mask_path")
        masks.append(_found(pictures, mask) if isinstance(mask, str) and mask else None)
        with naming(f"{path}: {name}"):
            shots.append(_shot(name, entry, pictures, file))
    units = METRES if told.get("units") == METRES else UNITS_OF_MODEL
    return CameraModel(path, tuple(shots), tuple(files), _points(path, told), units, tuple(masks))


def _found(pictures: Pictures, name: str) -> Path:
    # paths may contain the folder of pictures, which may lie elsewhere; NeRF's files leave out the ending
    return pictures.find(name, PureWindowsPath(name).name, f"{name}.png")


def _shot(name: str, entry: Mapping[str, Any], pictures: Pictures, file: Path) -> Shot:
    word = str(entry.get("camera_model", "OPENCV"))
    if word not in _MODELS:
        raise SepiError(f"camera_model '{word[:40]}'; expected one of {', '.join(_MODELS)}")
    kind = _MODELS[word]

    def number(key: str, other: float | None = None) -> float:
        value = entry.get(key, other)
        with suppress(TypeError, ValueError, OverflowError):
            if not isinstance(value, bool) and math.isfinite(found := float(value)):
                return found
        raise SepiError(f"expected a number as {key}, got {str(value)[:40]}")

    size = (number("w"), number("h")) if {"w", "h"} <= entry.keys() else None
    width, height = size or pictures.size(file)
    if "fl_x" not in entry and "camera_angle_x" in entry:
        focal_x = width / 2 / math.tan(min(3.0, max(1e-3, number("camera_angle_x"))) / 2)
    else:
        focal_x = number("fl_x")
    # counted from the picture's corner, not from the middle of the first pixel
    principal = number("cx", width / 2) - 0.5, number("cy", height / 2) - 0.5
    coefficients = tuple(number(key, 0.0) for key in _COEFFICIENTS[kind])
    try:
        matrix = np.array(entry.get("transform_matrix"), np.float64)
    except (ValueError, TypeError):
        matrix = np.zeros(0)
    if matrix.shape not in ((4, 4), (3, 4)) or not np.isfinite(matrix).all():
        raise SepiError("expected 4 rows of 4 numbers as transform_matrix")
    lens = Lens(int(width), int(height), (focal_x, number("fl_y", focal_x)), principal, kind, coefficients)
    return Shot(name, pictures.fitted(file, lens, size), rotation_of((matrix[:3, :3] @ _TURN).T), matrix[:3, 3].copy())


def _points(path: Path, told: Mapping[str, Any]) -> np.ndarray[Any, np.dtype[np.float64]]:
    """Points of the PLY file that it names, if they can be read."""
    name = told.get("ply_file_path")
    if not isinstance(name, str) or Path(name).is_absolute() or ".." in Path(name).parts:
        return np.zeros((0, 3))
    from sepi.io.point_cloud import read_positions

    file = path.parent / name
    return read_positions(file) if file.is_file() else np.zeros((0, 3))
