"""Calibrated cameras in a user's table, CSV or YAML.

docs/depth/calibrated_cameras.md describes both. A row of a CSV, or an entry of ``cameras`` in a YAML file, is a
picture: ``file``, the camera's position, its rotation from the world's axes, and its lens. Values shared by all
pictures stand below ``shared`` in a YAML file.
"""

from __future__ import annotations

import csv
from collections.abc import Mapping
from math import prod
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
import yaml
from pydantic import Field
from scipy.spatial.transform import Rotation

from sepi.camera.rig import FISHEYE, METRES, MOST_COEFFICIENTS, PINHOLE, Floats, Lens, Shot
from sepi.errors import SepiError
from sepi.extensions.cameras.model import UNITS_OF_MODEL, CameraModel
from sepi.extensions.cameras.pictures import Pictures
from sepi.io.files import naming, reading
from sepi.validation import require_known
from sepi.validation.models import AS_PAIR, CheckedModel, validated

# largest size of a table in bytes
_MOST_BYTES = 16 * 2**20
# largest difference of a matrix from a rotation, and of a quaternion's length from 1, for values with few digits
_NEARLY = 1e-2

# numbers may be text, since YAML reads 1e-4 as text
_Number = Annotated[float, Field(allow_inf_nan=False, strict=False)]
_Positive = Annotated[float, Field(gt=0, allow_inf_nan=False, strict=False)]
_PLACE = ("x", "y", "z")
_ROTATION = ("qw", "qx", "qy", "qz")
_DISTORTION = {PINHOLE: ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"), FISHEYE: ("k1", "k2", "k3", "k4")}
_COLUMNS = ("file", *_PLACE, *_ROTATION, "fx", "fy", "cx", "cy", "w", "h", "lens", *_DISTORTION[PINHOLE])


class _Camera(CheckedModel):
    file: str = Field(min_length=1)
    position: tuple[_Number, _Number, _Number]
    rotation: list[_Number] | list[list[_Number]] = Field([1.0, 0.0, 0.0, 0.0])
    focal: _Positive | tuple[_Positive, _Positive]
    principal: tuple[_Number, _Number] | None = None
    size: tuple[_Positive, _Positive] | None = None
    lens: Literal["pinhole", "fisheye"] = "pinhole"
    distortion: list[_Number] = Field([], max_length=MOST_COEFFICIENTS[PINHOLE])


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
        if path.stat().st_size > _MOST_BYTES:
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
    files = [pictures.find(camera.file) for camera in cameras]
    shots = []
    for camera, file in zip(cameras, files, strict=True):
        with naming(f"{path}: {camera.file}"):
            shots.append(_shot(camera, pictures, file))
    units = METRES if table.units == "metres" else UNITS_OF_MODEL
    return CameraModel(path, tuple(shots), tuple(files), np.zeros((0, 3)), units)


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


def _shot(camera: _Camera, pictures: Pictures, file: Path) -> Shot:
    focal = camera.focal if isinstance(camera.focal, tuple) else (camera.focal, camera.focal)
    width, height = map(int, camera.size or pictures.size(file))
    principal = camera.principal or ((width - 1) / 2, (height - 1) / 2)
    lens = Lens(width, height, focal, principal, camera.lens, tuple(camera.distortion))
    place = np.array(camera.position)
    return Shot(camera.file, pictures.fitted(file, lens, camera.size), rotation_of(camera.rotation), place)


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
