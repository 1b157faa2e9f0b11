"""Calibrated cameras of files: a COLMAP model, a ``transforms.json``, a user's table.

- A COLMAP model, text or binary, rigs included, is read by pycolmap.
- ``transforms.json`` of nerfstudio or instant-ngp: poses are from the camera to the world, whose axes point right, up
  and back. Principal points count from the picture's corner. Values that a frame lacks are those of the file.
- A table, CSV or YAML (docs/depth/calibrated_cameras.md): a row, or an entry of ``cameras``, is a picture: ``file``,
  the camera's position, its rotation from the world's axes, and its lens. Values shared by all pictures stand below
  ``shared`` in a YAML file.
"""

import csv
import json
import math
import signal
import threading
from collections.abc import Mapping, Sequence
from contextlib import suppress
from math import prod
from pathlib import Path, PureWindowsPath
from typing import Annotated, Any, Literal

import numpy as np
import yaml
from pydantic import Field
from scipy.spatial.transform import Rotation

from sepi.camera.rig import FISHEYE, METRES, PINHOLE, Floats, Lens, Shot
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
_REQUIRED = ("file", "x", "y", "z", "fx")
# key of a table, its columns in a CSV file, and how many of them must be given for the key to be given
_PARTS = (
    ("position", ("x", "y", "z"), 0),
    ("rotation", ("qw", "qx", "qy", "qz"), 1),
    ("focal", ("fx", "fy"), 0),
    ("principal", ("cx", "cy"), 2),
    ("size", ("w", "h"), 2),
)
_DISTORTION = {PINHOLE: ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"), FISHEYE: ("k1", "k2", "k3", "k4")}
_COLUMNS = ("file", *(name for _, names, _ in _PARTS for name in names), "lens", *_DISTORTION[PINHOLE])

# right, up, back to right, down, forward
_TURN = np.diag([1.0, -1.0, -1.0])

_LENSES = {
    **dict.fromkeys(("SIMPLE_PINHOLE", "PINHOLE", "SIMPLE_RADIAL", "RADIAL", "OPENCV", "FULL_OPENCV"), PINHOLE),
    **dict.fromkeys(("OPENCV_FISHEYE", "SIMPLE_RADIAL_FISHEYE", "RADIAL_FISHEYE"), FISHEYE),
}
LENS_MODELS = tuple(_LENSES)
"""COLMAP's names of the lens models that can be read; their last parameters are OpenCV's first coefficients."""


class _Camera(CheckedModel):
    file: str = Field(min_length=1)
    position: tuple[_Number, _Number, _Number]
    rotation: list[_Number] | list[list[_Number]] = Field([1.0, 0.0, 0.0, 0.0])
    focal: _Number | tuple[_Number, _Number]
    principal: tuple[_Number, _Number] | None = None
    size: tuple[_Number, _Number] | None = None
    lens: str = PINHOLE
    distortion: list[_Number] = Field([])

    def picture(self, pictures: Pictures) -> Picture:
        file = pictures.find(self.file)
        focal = self.focal if isinstance(self.focal, tuple) else (self.focal, self.focal)
        width, height = map(int, self.size or pictures.size(file))
        principal = self.principal or ((width - 1) / 2, (height - 1) / 2)
        lens = Lens(width, height, focal, principal, self.lens, tuple(self.distortion))
        lens = pictures.fitted(file, lens, self.size is not None)
        return Picture(Shot(self.file, lens, rotation_of(self.rotation), np.array(self.position)), file)


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
    for camera in cameras:
        with naming(f"{path}: {camera.file}"):
            found.append(camera.picture(pictures))
    return CameraModel(path, tuple(found), units=METRES if table.units == "metres" else UNITS_OF_MODEL)


def _rows(text: str) -> list[dict[str, Any]]:
    lines = text.splitlines()
    # separators of spreadsheets in countries with decimal commas
    separator = next((mark for mark in ";\t" if lines and mark in lines[0]), ",")
    rows = csv.DictReader(lines, delimiter=separator, skipinitialspace=True)
    rows.fieldnames = [name.strip() for name in rows.fieldnames or ()]
    require_known("columns", rows.fieldnames, _COLUMNS)
    for name in _REQUIRED:
        if name not in rows.fieldnames:
            raise SepiError(f"no column '{name}'; expected {', '.join(_COLUMNS)}; columns from qw on are optional")
    return [_entry({name: (row.get(name) or "").strip() for name in _COLUMNS}) for row in rows]


def _entry(row: dict[str, str]) -> dict[str, Any]:
    """The entry of a table that a row of a CSV file means; empty columns are 0, or nothing."""
    row["fy"] = row["fy"] or row["fx"]
    lens = row["lens"] or PINHOLE
    entry: dict[str, Any] = {"file": row["file"], "lens": lens}
    for key, names, least in (*_PARTS, ("distortion", _DISTORTION.get(lens, ()), 0)):
        numbers = [row[name].replace(",", ".") for name in names]
        if sum(map(bool, numbers)) >= least:
            entry[key] = [number or "0" for number in numbers]
    return entry


def rotation_of(told: Any) -> Floats:
    """A rotation matrix from a quaternion ``(w, x, y, z)`` or a matrix, both with few digits."""
    values = np.array(told, np.float64) if len({np.size(row) for row in told}) == 1 else np.zeros(0)
    if values.shape == (4,) and abs(np.linalg.norm(values) - 1) < _NEARLY:
        return np.asarray(Rotation.from_quat(values, scalar_first=True).as_matrix(), np.float64)
    if values.shape == (3, 3) and np.abs(values @ values.T - np.eye(3)).max() < _NEARLY and np.linalg.det(values) > 0:
        left, _, right = np.linalg.svd(values)
        return np.asarray(left @ right, np.float64)
    expected = "a quaternion w x y z of length 1, or a 3x3 rotation matrix (no reflection)"
    raise SepiError(f"rotation: expected {expected}, from the world's axes to the camera's")


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
    found = []
    for n, frame in enumerate(frames, 1):
        entry = {**told, **frame}
        name = entry.get("file_path")
        if not isinstance(name, str) or not name:
            raise SepiError(f"{path}: frame {n}: no file_path")
        with naming(f"{path}: {name}"):
            found.append(_picture_of_frame(name.removeprefix("./"), entry, pictures))
    units = METRES if told.get("units") == METRES else UNITS_OF_MODEL
    # nerfstudio's points
    cloud = told.get("ply_file_path")
    inside = isinstance(cloud, str) and not Path(cloud).is_absolute() and ".." not in Path(cloud).parts
    points = read_positions(path.parent / cloud) if inside and (path.parent / cloud).is_file() else None
    return CameraModel(path, tuple(found), points, units)


def read_positions(path: Path) -> Floats:
    """Coordinates (N, 3) of the points of a PLY file.

    Raises
    ------
    SepiError
        If it is damaged or has no points.
    """
    from plyfile import PlyData

    with reading(path, "PLY file of points"):
        try:
            points = PlyData.read(path)["vertex"]
        except MemoryError as error:
            raise SepiError("damaged: it cannot hold as many points as its header says") from error
        return np.column_stack([np.asarray(points[axis], np.float64) for axis in "xyz"])


def _picture_of_frame(name: str, entry: Mapping[str, Any], pictures: Pictures) -> Picture:
    def number(key: str, other: Any = None, shapes: Sequence[tuple[int, ...]] = ((),)) -> Any:
        told = entry.get(key, other)
        with suppress(TypeError, ValueError, OverflowError):
            value = np.array(told, np.float64)
            if not isinstance(told, bool) and value.shape in shapes and np.isfinite(value).all():
                return value.tolist()
        expected = "a number" if () in shapes else "4 rows of 4 numbers"
        raise SepiError(f"expected {expected} as {key}, got {str(told)[:40]}")

    def file_of(path: str) -> Path:
        # paths may contain the folder of pictures, which may lie elsewhere; NeRF's files leave out the ending
        return pictures.find(path, PureWindowsPath(path).name, f"{path}.png")

    file, mask = file_of(name), entry.get("mask_path")
    kind = _lens_kind(str(entry.get("camera_model", "OPENCV")))
    sized = {"w", "h"} <= entry.keys()
    width, height = (number("w"), number("h")) if sized else pictures.size(file)
    if "fl_x" not in entry and "camera_angle_x" in entry:
        focal_x = width / 2 / math.tan(min(3.0, max(1e-3, number("camera_angle_x"))) / 2)
    else:
        focal_x = number("fl_x")
    # counted from the picture's corner, not from the middle of the first pixel
    principal = number("cx", width / 2) - 0.5, number("cy", height / 2) - 0.5
    distortion = tuple(number(key, 0.0) for key in _DISTORTION[kind])
    lens = Lens(int(width), int(height), (focal_x, number("fl_y", focal_x)), principal, kind, distortion)
    matrix = np.array(number("transform_matrix", shapes=((4, 4), (3, 4))))
    shot = Shot(name, pictures.fitted(file, lens, sized), rotation_of((matrix[:3, :3] @ _TURN).T), matrix[:3, 3].copy())
    return Picture(shot, file, file_of(mask) if isinstance(mask, str) and mask else None)


def _lens_kind(model: str) -> str:
    require_known("camera model", [model[:40]], _LENSES)
    return _LENSES[model]


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
        with naming(f"{path}: {image.name}"):
            found.append(_picture_of_image(image, model.cameras[image.camera_id], pictures))
    return CameraModel(path, tuple(found), points)


def _picture_of_image(image: Any, camera: Any, pictures: Pictures) -> Picture:
    file, kind, pose = pictures.find(image.name), _lens_kind(camera.model.name), image.cam_from_world()
    focal = camera.focal_length_x, camera.focal_length_y
    # COLMAP counts from the picture's corner, a lens from the middle of the first pixel
    principal = camera.principal_point_x - 0.5, camera.principal_point_y - 0.5
    distortion = tuple(float(camera.params[place]) for place in camera.extra_params_idxs())
    lens = pictures.fitted(file, Lens(camera.width, camera.height, focal, principal, kind, distortion), sized=True)
    rotation = np.array(pose.rotation.matrix(), np.float64)
    shot = Shot(image.name, lens, rotation, -rotation.T @ np.array(pose.translation, np.float64))
    return Picture(shot, file, mask_of(file, image.name))


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
