"""Folders in the layout of the HCI 4D light field benchmark.

``input_CamNNN.png`` is view ``NNN = S * t + s``. Views may be missing, but for the one whose depth is made.
``parameters.cfg``, ``gt_disp_lowres.pfm`` (disparity of the centre view) and ``mask_NAME.png`` (white regions) are read
where present.

References
----------
.. [1] K. Honauer, O. Johannsen, D. Kondermann, B. Goldluecke, "A dataset and evaluation methodology for depth
       estimation on 4D light fields", ACCV 2016.
"""

from __future__ import annotations

import configparser
import math
import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

import numpy as np

from sepi.camera import Camera, camera_from
from sepi.errors import SepiError
from sepi.io.images import picture_header, read_picture
from sepi.io.pfm import read_pfm
from sepi.io.readers.options import ReadOptions, position_of, require_unused
from sepi.io.readers.view_files import read_grid
from sepi.lightfield import BoolMap, DisparityRange, FloatMap, LightField

PARAMETERS = "parameters.cfg"
TRUTH = "gt_disp_lowres.pfm"

_CAMERA = ("focal_length_mm", "baseline_mm", "focus_distance_m", "sensor_size_mm")

Number = TypeVar("Number", int, float)

_VIEW = re.compile(r"input_Cam(\d{1,6})\.png")
# the masks that evaluation uses: any fault in them is an error; other masks are left out if they do not fit
_EVALUATED = ("occluded", "textureless")


@dataclass(frozen=True)
class _Parameters:
    """What this package uses of ``parameters.cfg``; None where the file does not say."""

    grid: tuple[int, int] | None = None
    shape: tuple[int, int] | None = None
    disparity_range: DisparityRange | None = None
    scene: str | None = None


def matches(path: Path) -> bool:
    """Whether ``path`` is a folder with views or parameters of the benchmark's names."""
    return path.is_dir() and ((path / PARAMETERS).is_file() or any(path.glob("input_Cam*.png")))


def read(path: Path, options: ReadOptions) -> LightField:
    """Read a folder.

    Returns
    -------
    LightField
        With the scene's own disparity range, ground truth and masks where the folder has them.

    Raises
    ------
    SepiError
        If a view is given twice, damaged or unlike the others, no grid has as many views, the parameters are nonsense,
        or ground truth or masks do not fit the views.
    """
    require_unused(str(path), options, ("pattern", "axes", "variable"))
    values = _values(path / PARAMETERS) if (path / PARAMETERS).is_file() else {}
    parameters = _read_parameters(path / PARAMETERS, values)
    files = _numbered_views(path)
    grid = options.grid or parameters.grid or _square_grid(path, files)
    _require_inside(path, files, grid, "--grid" if options.grid else PARAMETERS)
    arranged = read_grid(path, files, grid, options)
    shape = arranged.views.shape[2], arranged.views.shape[3]
    if parameters.shape not in (None, shape):
        raise SepiError(
            f"{path / PARAMETERS}: image_resolution (y, x) = {parameters.shape}, but the views are {shape}; "
            "disparities change with the size, so set image_resolution, disp_min and disp_max for these views"
        )
    # ground truth and masks belong to the centre view of the folder's own grid
    with_truth = position_of(arranged.numbers, grid[0] // 2 * grid[1] + grid[1] // 2)
    read_truth = with_truth is not None and options.view in (None, with_truth) and _has_truth(path)
    return LightField(
        views=arranged.views,
        name=parameters.scene or path.resolve().name,
        source=str(path),
        present=arranged.present,
        view=with_truth if read_truth else options.view,
        disparity_range=parameters.disparity_range,
        ground_truth=_read_truth(path / TRUTH, shape) if read_truth else None,
        masks=_read_masks(path, shape) if read_truth else {},
        camera=_read_camera(path / PARAMETERS, values, shape),
    )


def _numbered_views(folder: Path) -> dict[int, Path]:
    """Number of each view and its file."""
    views: dict[int, Path] = {}
    for path in sorted(folder.glob("input_Cam*.png")):
        match = _VIEW.fullmatch(path.name)
        if match is None:
            raise SepiError(f"{path}: expected a name like input_Cam007.png")
        number = int(match[1])
        if number in views:
            raise SepiError(f"{path}: view {number} is given twice, also as {views[number].name}")
        views[number] = path
    if not views:
        raise SepiError(f"{folder}: no views (expected input_Cam000.png, input_Cam001.png, ...)")
    return views


def _square_grid(folder: Path, views: dict[int, Path]) -> tuple[int, int]:
    """The square grid that ends with the last view."""
    highest = max(views)
    side = math.isqrt(highest + 1)
    if side**2 != highest + 1:
        raise SepiError(
            f"{folder}: views up to {views[highest].name} make {highest + 1}, which is no square grid; "
            f"give --grid ROWSxCOLUMNS, or num_cams_x and num_cams_y in {PARAMETERS}, or all views of a grid such as "
            f"{side + 1}x{side + 1}"
        )
    return side, side


def _require_inside(folder: Path, views: dict[int, Path], grid: tuple[int, int], source: str) -> None:
    highest = max(views)
    count = grid[0] * grid[1]
    if highest >= count:
        raise SepiError(
            f"{views[highest]}: beyond the {count} views of the {grid[0]}x{grid[1]} grid that {source} gives"
        )


def _values(path: Path) -> dict[str, str]:
    """Key to value, of all sections together."""
    parser = configparser.ConfigParser(interpolation=None)
    try:
        parser.read_string(path.read_text(encoding="utf-8"), source=path.name)
    except OSError as error:
        raise SepiError(f"{path}: cannot be read ({error.strerror})") from error
    except UnicodeDecodeError as error:
        raise SepiError(f"{path}: not a text file") from error
    except configparser.Error as error:
        reason = " ".join(error.message.split())
        raise SepiError(f"{path}: not of the form '[section]' and 'key = value' ({reason})") from error
    return {key: value for section in parser.sections() for key, value in parser.items(section)}


def _read_parameters(path: Path, values: dict[str, str]) -> _Parameters:
    limits = _pair(path, values, ("disp_min", "disp_max"), float)
    if limits is not None and not (math.isfinite(limits[0]) and limits[0] < limits[1] < math.inf):
        raise SepiError(
            f"{path}: expected finite disp_min < disp_max in pixels per view step, got {limits[0]:g} and {limits[1]:g}"
        )
    sizes = []
    for keys in (("num_cams_y", "num_cams_x"), ("image_resolution_y_px", "image_resolution_x_px")):
        size = _pair(path, values, keys, int)
        if size is not None and min(size) < 1:
            raise SepiError(f"{path}: expected {' and '.join(keys)} of at least 1, got {size[0]} and {size[1]}")
        sizes.append(size)
    return _Parameters(
        grid=sizes[0],
        shape=sizes[1],
        disparity_range=None if limits is None else DisparityRange(*limits, "parameters"),
        scene=values.get("scene") or None,
    )


def _read_camera(path: Path, values: dict[str, str], shape: tuple[int, int]) -> Camera | None:
    """Geometry from the parameters; None where they do not give all of it."""
    if not all(key in values for key in _CAMERA):
        return None
    try:
        return camera_from(**dict(zip(_CAMERA, _numbers(path, values, _CAMERA, float), strict=True)), shape=shape)
    except SepiError as error:
        raise error if str(error).startswith(str(path)) else SepiError(f"{path}: {error}") from error


def _pair(
    path: Path, values: dict[str, str], keys: tuple[str, str], kind: Callable[[str], Number]
) -> tuple[Number, Number] | None:
    """Two numbers that come together or not at all."""
    missing = [key for key in keys if key not in values]
    if len(missing) == 1:
        raise SepiError(f"{path}: {missing[0]} is not given, but needed with the other of {' and '.join(keys)}")
    if missing:
        return None
    first, second = _numbers(path, values, keys, kind)
    return first, second


def _numbers(path: Path, values: dict[str, str], keys: tuple[str, ...], kind: Callable[[str], Number]) -> list[Number]:
    try:
        return [kind(values[key]) for key in keys]
    except ValueError as error:
        given = ", ".join(f"'{values[key]}'" for key in keys)
        whole = "whole " if kind is int else ""
        raise SepiError(f"{path}: expected {whole}numbers for {', '.join(keys)}, got {given}") from error


def _has_truth(folder: Path) -> bool:
    return (folder / TRUTH).is_file() or any(folder.glob("mask_*.png"))


def _read_truth(path: Path, shape: tuple[int, int]) -> FloatMap | None:
    if not path.is_file():
        return None
    ground_truth = read_pfm(path)
    if ground_truth.shape != shape:
        raise SepiError(f"{path}: ground truth is {ground_truth.shape}, the views are {shape} (height, width)")
    return ground_truth


def _read_masks(folder: Path, shape: tuple[int, int]) -> dict[str, BoolMap]:
    masks = {}
    for path in sorted(folder.glob("mask_*.png")):
        name = path.stem.removeprefix("mask_")
        header = picture_header(path)
        if (header.height, header.width) == shape:
            values = read_picture(path)
            # white on black; anything else is not a region
            if np.array_equal(values.min(2), values.max(2)) and np.isin(values, (0, values.max())).all():
                masks[name] = values[:, :, 0] > 0
                continue
        if name in _EVALUATED:
            raise SepiError(f"{path}: expected a black and white picture of the views' size {shape} (height, width)")
    return masks
