"""Calibrated cameras of files: a COLMAP model, a ``transforms.json``, a user's table.

- A COLMAP model, text or binary, rigs included, is read by pycolmap.
- ``transforms.json`` of nerfstudio or instant-ngp: poses are from the camera to the world, whose axes point right, up
  and back. Principal points count from the picture's corner. Values that a frame lacks are those of the file.
- A table, CSV or YAML (docs/depth/calibrated_cameras.md): a row, or an entry of ``cameras``, is a picture: ``file``,
  the camera's position, its rotation from the world's axes, and its lens. Values shared by all pictures stand below
  ``shared`` in a YAML file.
"""

from __future__ import annotations

import csv
import json
import math
import signal
import threading
from collections.abc import Mapping
from contextlib import suppress
from math import prod
from pathlib import Path, PureWindowsPath
from typing import Annotated, Any, Literal

import numpy as np
import yaml
from pydantic import Field
from scipy.spatial.transform import Rotation

from sepi.camera.rig import FISHEYE, METRES, MOST_COEFFICIENTS, PINHOLE, Floats, Lens, Shot
from sepi.errors import SepiError
from sepi.extensions.cameras.model import UNITS_OF_MODEL, CameraModel, Picture, Pictures, mask_of
from sepi.io.files import naming, reading
from sepi.validation import require_known
from sepi.validation.models import AS_PAIR, CheckedModel, validated

# largest size of a table, and of a transforms.json, in bytes
_MOST_OF_TABLE, _MOST_OF_JSON = 16 * 2**20, 256 * 2**20
# largest difference of a matrix from a rotation, and of a quaternion's length from 1, for values with few digits
_NEARLY = 1e-2

# numbers may be text, since YAML reads 1e-4 as text
_Number = Annotated[float, Field(allow_inf_nan=False, strict=False)]
_Positive = Annotated[float, Field(gt=0, allow_inf_nan=False, strict=False)]
_PLACE = ("x", "y", "z")
_ROTATION = ("qw", "qx", "qy", "qz")
_DISTORTION = {PINHOLE: ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"), FISHEYE: ("k1", "k2", "k3", "k4")}
_COLUMNS = ("file", *_PLACE, *_ROTATION, "fx", "fy", "cx", "cy", "w", "h", "lens", *_DISTORTION[PINHOLE])

_LENSES = {"OPENCV": PINHOLE, "PINHOLE": PINHOLE, "SIMPLE_PINHOLE": PINHOLE, "OPENCV_FISHEYE": FISHEYE}
"""Lens models of a ``transforms.json``."""
# right, up, back to right, down, forward
_TURN = np.diag([1.0, -1.0, -1.0])

_COLMAP: dict[str, tuple[str, tuple[int, int, int, int], tuple[int, ...]]] = {
    "SIMPLE_PINHOLE": (PINHOLE, (0, 0, 1, 2), ()),
    "PINHOLE": (PINHOLE, (0, 1, 2, 3), ()),
    "SIMPLE_RADIAL": (PINHOLE, (0, 0, 1, 2), (3,)),
    "RADIAL": (PINHOLE, (0, 0, 1, 2), (3, 4)),
    "OPENCV": (PINHOLE, (0, 1, 2, 3), (4, 5, 6, 7)),
    "FULL_OPENCV": (PINHOLE, (0, 1, 2, 3), (4, 5, 6, 7, 8, 9, 10, 11)),
    "OPENCV_FISHEYE": (FISHEYE, (0, 1, 2, 3), (4, 5, 6, 7)),
    "SIMPLE_RADIAL_FISHEYE": (FISHEYE, (0, 0, 1, 2), (3,)),
    "RADIAL_FISHEYE": (FISHEYE, (0, 0, 1, 2), (3, 4)),
}
"""COLMAP's models: lens, and indices of its parameters: fx, fy, cx, cy, then OpenCV's coefficients."""
LENS_MODELS = tuple(_COLMAP)
"""COLMAP's names of the lens models that can be read."""


class _Camera(CheckedModel):
    file: str = Field(min_length=1)
    position: tuple[_Number, _Number, _Number]
    rotation: list[_Number] | list[list[_Number]] = Field([1.0, 0.0, 0.0, 0.0])
    focal: _Positive | tuple[_Positive, _Positive]
    principal: tuple[_Number, _Number] | None = None
    size: tuple[_Positive, _Positive] | None = None
    lens: Literal["pinhole", "fisheye"] = "pinhole"
    distortion: list[_Number] = Field([], max_length=MOST_COEFFICIENTS[PINHOLE])

    def shot(self, pictures: Pictures, file: Path) -> Shot:
        focal = self.focal if isinstance(self.focal, tuple) else (self.focal, self.focal)
        width, height = map(int, self.size or pictures.size(file))
        principal = self.principal or ((width - 1) / 2, (height - 1) / 2)
        lens = Lens(width, height, focal, principal, self.lens, tuple(self.distortion))
        fitted = pictures.fitted(file, lens, self.size)
        return Shot(self.file, fitted, rotation_of(self.rotation), np.array(self.position))


class _Table(CheckedModel):
    units: Literal["metres", "unknown"] = "unknown"
    grid: Annotated[tuple[int, int] | None, AS_PAIR] = None
    shared: dict[str, Any] = Field({})
    cameras: list[dict[str, Any]] = Field(min_length=1)


def read_table(path: Path, pictures: Pictures) -> CameraModel:
    """The cameras of a table.

    Raises
    ------
    SepiError
        If it is damaged, a key is missing, unknown or not a number, or a picture is missing.
    """
    with reading(path, "table of cameras"):
        if path.stat().st_size > _MOST_OF_TABLE:
            raise SepiError("not a table of cameras: too long")
        text = path.read_text(encoding="utf-8-sig")
        told = {"cameras": _rows(text)} if path.suffix.lower() == ".csv" else yaml.safe_load(text)
        if not isinstance(told, dict):
            raise SepiError("expected a key 'cameras' with a list of cameras, and optional keys 'shared' and 'units'")
    table = validated(_Table, told, str(path))
    if table.grid is not None and prod(table.grid) != len(table.cameras):
        raise SepiError(f"{path}: a grid of {prod(table.grid)} cameras, but {len(table.cameras)} are listed")
    entries = [{**table.shared, **entry} for entry in table.cameras]
    cameras = [validated(_Camera, entry, f"{path}: camera {n}") for n, entry in enumerate(entries, 1)]
    found = []
    for camera, file in [(camera, pictures.find(camera.file)) for camera in cameras]:
        with naming(f"{path}: {camera.file}"):
            found.append(Picture(camera.shot(pictures, file), file))
    return CameraModel(path, tuple(found), units=METRES if table.units == "metres" else UNITS_OF_MODEL)


def _rows(text: str) -> list[dict[str, Any]]:
    lines = text.splitlines()
    # separators of spreadsheets in countries with decimal commas
    separator = next((mark for mark in ";\t" if lines and mark in lines[0]), ",")
    rows = csv.DictReader(lines, delimiter=separator, skipinitialspace=True)
    rows.fieldnames = [name.strip() for name in rows.fieldnames or ()]
    require_known("columns", rows.fieldnames, _COLUMNS)
    for name in ("file", *_PLACE, "fx"):
        if name not in rows.fieldnames:
            raise SepiError(f"no column '{name}'; expected {', '.join(_COLUMNS)}; columns from qw on are optional")
    return [_entry(row) for row in rows]


def _entry(row: Mapping[str, Any]) -> dict[str, Any]:
    def numbers(*names: str, least: int = 1) -> list[str] | None:
        told = [str(row.get(name) or "").strip().replace(",", ".") for name in names]
        return [value or "0" for value in told] if sum(map(bool, told)) >= least else None

    lens = (row.get("lens") or PINHOLE).strip()
    entry = {
        "file": (row["file"] or "").strip(),
        "position": numbers(*_PLACE, least=0),
        "rotation": numbers(*_ROTATION),
        "focal": numbers("fx", "fy" if (row.get("fy") or "").strip() else "fx", least=0),
        "principal": numbers("cx", "cy", least=2),
        "size": numbers("w", "h", least=2),
        "lens": lens,
        "distortion": numbers(*_DISTORTION.get(lens, _DISTORTION[PINHOLE]), least=0),
    }
    return {key: value for key, value in entry.items() if value is not None}


def rotation_of(told: Any) -> Floats:
    """A rotation matrix from a quaternion ``(w, x, y, z)`` or a matrix, both with few digits."""
    values = np.array(told, np.float64) if len({np.size(row) for row in told}) == 1 else np.zeros(0)
    if values.shape == (4,) and abs(np.linalg.norm(values) - 1) < _NEARLY:
        return np.asarray(Rotation.from_quat(values, scalar_first=True).as_matrix(), np.float64)
    if values.shape == (3, 3) and np.abs(values @ values.T - np.eye(3)).max() < _NEARLY and np.linalg.det(values) > 0:
        left, _, right = np.linalg.svd(values)
        return np.asarray(left @ right, np.float64)
    raise SepiError(
        "rotation: expected a quaternion w x y z of length 1, or a 3x3 rotation matrix (no reflection), "
        "from the world's axes to the camera's"
    )


def read_transforms(path: Path, pictures: Pictures) -> CameraModel:
    """The cameras of a ``transforms.json``.

    Raises
    ------
    SepiError
        If it is damaged, a value is missing or wrong, or a picture is missing.
    """
    with reading(path, "transforms.json"):
        if path.stat().st_size > _MOST_OF_JSON:
            raise SepiError("not a transforms.json: too long")
        told = json.loads(path.read_bytes())
    frames = told.get("frames") if isinstance(told, dict) else None
    if not isinstance(frames, list) or not frames or not all(isinstance(frame, dict) for frame in frames):
        raise SepiError(f"{path}: no cameras; expected a list 'frames'")
    # nerfstudio's own rotation and scale of the world
    found = []
    for n, frame in enumerate(frames, 1):
        entry = {**told, **frame}
        name, mask = entry.get("file_path"), entry.get("mask_path")
        if not isinstance(name, str) or not name:
            raise SepiError(f"{path}: frame {n}: no file_path")
        name = name.removeprefix("./")
        file = _found(pictures, name)
        covered = _found(pictures, mask) if isinstance(mask, str) and mask else None
        with naming(f"{path}: {name}"):
            found.append(Picture(_shot_of_frame(name, entry, pictures, file), file, covered))
    units = METRES if told.get("units") == METRES else UNITS_OF_MODEL
    return CameraModel(path, tuple(found), _points(path, told), units)


def _found(pictures: Pictures, name: str) -> Path:
    # paths may contain the folder of pictures, which may lie elsewhere; NeRF's files leave out the ending
    return pictures.find(name, PureWindowsPath(name).name, f"{name}.png")


def _shot_of_frame(name: str, entry: Mapping[str, Any], pictures: Pictures, file: Path) -> Shot:
    word = str(entry.get("camera_model", "OPENCV"))
    if word not in _LENSES:
        raise SepiError(f"camera_model '{word[:40]}'; expected one of {', '.join(_LENSES)}")
    kind = _LENSES[word]

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
    coefficients = tuple(number(key, 0.0) for key in _DISTORTION[kind][:6])
    try:
        matrix = np.array(entry.get("transform_matrix"), np.float64)
    except (ValueError, TypeError):
        matrix = np.zeros(0)
    if matrix.shape not in ((4, 4), (3, 4)) or not np.isfinite(matrix).all():
        raise SepiError("expected 4 rows of 4 numbers as transform_matrix")
    lens = Lens(int(width), int(height), (focal_x, number("fl_y", focal_x)), principal, kind, coefficients)
    return Shot(name, pictures.fitted(file, lens, size), rotation_of((matrix[:3, :3] @ _TURN).T), matrix[:3, 3].copy())


def _points(path: Path, told: Mapping[str, Any]) -> Floats:
    """Points of the PLY file that it names, if they can be read."""
    name = told.get("ply_file_path")
    if not isinstance(name, str) or Path(name).is_absolute() or ".." in Path(name).parts:
        return np.zeros((0, 3))
    from sepi.io.point_cloud import read_positions

    file = path.parent / name
    return read_positions(file) if file.is_file() else np.zeros((0, 3))


def read_colmap(path: Path, pictures: Pictures) -> CameraModel:
    """The cameras of a COLMAP model.

    Raises
    ------
    SepiError
        If pycolmap is not installed, the model is damaged or empty, a lens is of another kind, or a picture is missing.
    """
    pycolmap = require_pycolmap(str(path))
    with reading(path, "COLMAP model"):
        try:
            model = pycolmap.Reconstruction(str(path))
            # names that are not text are errors, too
            images = sorted((image for image in model.images.values() if image.has_pose), key=lambda image: image.name)
        except (ValueError, RuntimeError, IndexError, KeyError) as error:
            raise SepiError(f"not a COLMAP model, or damaged ({str(error).splitlines()[0][:120]})") from error
    if not images:
        raise SepiError(f"{path}: a COLMAP model without pictures")
    points = np.array([point.xyz for point in model.points3D.values()], np.float64).reshape(-1, 3)
    found = []
    for image in images:
        file = pictures.find(image.name)
        with naming(f"{path}: {image.name}"):
            shot = _shot_of_image(pictures, file, image, model.cameras[image.camera_id])
        found.append(Picture(shot, file, mask_of(file, image.name)))
    return CameraModel(path, tuple(found), points)


def require_pycolmap(where: str) -> Any:
    """The module pycolmap, or an error that tells how to install it."""
    # if loaded before OpenCV, it makes OpenCV crash when writing PNG
    import cv2  # noqa: F401

    try:
        import pycolmap
    except ImportError as error:
        raise SepiError(f"{where}: reading a COLMAP model needs pycolmap: pip install 'sepi[colmap]'") from error
    # its signal handlers would end the program, and leave unfinished files
    before = signal.getsignal(signal.SIGTERM)
    if before is not None and threading.current_thread() is threading.main_thread():
        signal.signal(signal.SIGTERM, before)
    # it logs everything to standard error
    pycolmap.logging.minloglevel = pycolmap.logging.Level.FATAL  # type: ignore[assignment]
    return pycolmap


def _shot_of_image(pictures: Pictures, file: Path, image: Any, camera: Any) -> Shot:
    word = camera.model.name
    if word not in _COLMAP:
        raise SepiError(f"camera model {word}; expected one of {', '.join(_COLMAP)}")
    kind, (fx, fy, cx, cy), places = _COLMAP[word]
    values = [float(value) for value in camera.params]
    # COLMAP counts from the picture's corner, a lens from the middle of the first pixel
    principal = values[cx] - 0.5, values[cy] - 0.5
    size, distortion = (camera.width, camera.height), tuple(values[place] for place in places)
    lens = pictures.fitted(file, Lens(*size, (values[fx], values[fy]), principal, kind, distortion), size)
    pose = image.cam_from_world()
    rotation = np.array(pose.rotation.matrix(), np.float64)
    return Shot(image.name, lens, rotation, -rotation.T @ np.array(pose.translation, np.float64))
