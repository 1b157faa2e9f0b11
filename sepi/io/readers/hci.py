"""Folders of the HCI 4D light field benchmark [1]_.

``input_CamNNN.png`` is view ``NNN = S * t + s``. Views may be missing, except the reference view. ``parameters.cfg``,
``gt_disp_lowres.pfm`` (disparity of the centre view) and ``mask_NAME.png`` (white regions) are read if present.
``baseline_mm`` is the distance of neighbouring cameras, in rows and columns. ``sensor_size_mm`` belongs to the image of
``image_resolution``, of which the views may be a crop (``crop_of``).

References
----------
.. [1] K. Honauer, O. Johannsen, D. Kondermann, B. Goldluecke, "A dataset and evaluation methodology for depth
       estimation on 4D light fields", ACCV 2016.
"""

from __future__ import annotations

import configparser
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import BaseModel, PositiveInt

from sepi.camera import Part, camera_from
from sepi.errors import SepiError, warn
from sepi.io.disparity_maps import read_pfm
from sepi.io.files import name_of, naming, reading
from sepi.io.images import picture_header, read_picture
from sepi.io.readers.options import ReadOptions
from sepi.io.readers.view_files import read_grid
from sepi.io.readers.view_grid import arrange_numbers, cut_like_views, position_of
from sepi.io.readers.view_names import parse_view_numbers, require_different
from sepi.lightfield import DisparityRange, LightField, Truth
from sepi.validation.models import validated

PARAMETERS = "parameters.cfg"
# beside them, pictures are those of calibrated cameras
CALIBRATED = ("cameras.csv", "cameras.yaml", "cameras.yml", "transforms.json", "transforms_train.json", "sparse")
TRUTH = "gt_disp_lowres.pfm"

_CAMERA = ("focal_length_mm", "baseline_mm", "focus_distance_m", "sensor_size_mm")

# masks that scores need: any fault in them is an error; other masks are left out if they do not fit
_EVALUATED = ("occluded", "textureless")


class _Parameters(BaseModel, defer_build=True):
    """Parameters that this package uses of ``parameters.cfg``; None if missing."""

    scene: str | None = None
    num_cams_y: PositiveInt | None = None
    num_cams_x: PositiveInt | None = None
    image_resolution_y_px: PositiveInt | None = None
    image_resolution_x_px: PositiveInt | None = None
    disp_min: float | None = None
    disp_max: float | None = None
    focal_length_mm: float | None = None
    baseline_mm: float | None = None
    focus_distance_m: float | None = None
    sensor_size_mm: float | None = None

    def pair(self, *keys: str) -> tuple[Any, Any] | None:
        """Two numbers that must be given both or not at all."""
        first, second = (getattr(self, key) for key in keys)
        if (first is None) != (second is None):
            raise SepiError(f"expected both {' and '.join(keys)}, or neither")
        return None if first is None else (first, second)


def matches(path: Path) -> bool:
    """Whether ``path`` is a folder named as in the benchmark, without calibrated cameras."""
    named = path.is_dir() and ((path / PARAMETERS).is_file() or any(path.glob("input_Cam*.png")))
    return named and not any((path / name).exists() for name in CALIBRATED)


def read_truth(path: Path, options: ReadOptions) -> Truth:
    """Ground truth and masks of a folder, if they belong to the reference view of :func:`read`."""
    of, (rows, columns) = _view_of_truth(path, options)
    reference = options.view or (rows // 2, columns // 2)
    if of == reference:
        header = picture_header(min(path.glob("input_Cam*.png")))
        return _truth_of(path, (header.height, header.width), options.part)
    if of is not None and options.view is None and truth_files(path):
        known, made = (f"{t},{s}" for t, s in (of, reference))
        warn(f"{path}: its ground truth is of view {known}, the depth of view {made}; --view {known} scores it")
    return None, {}


def truth_files(folder: Path) -> list[Path]:
    """Files of a folder with ground truth and masks."""
    return sorted(path for name in (TRUTH, "mask_*.png") for path in folder.glob(name) if path.is_file())


def read(path: Path, options: ReadOptions) -> LightField:
    """Light field of a folder without ground truth and masks, so that a change in these affects no map."""
    file = path / PARAMETERS
    parameters = _parameters_of(path)
    with naming(file):
        given_shape = parameters.pair("image_resolution_y_px", "image_resolution_x_px")
        limits = parameters.pair("disp_min", "disp_max")
        disparity_range = None if limits is None else DisparityRange(*limits, "parameters")
    files, grid = _views_in(path, options, parameters)
    views, present, _, names = read_grid(path, files, grid, options)
    shape = views.shape[2], views.shape[3]
    whole = shape if options.part is None else options.part[1::-1]
    if given_shape not in (None, whole):
        size = f"{given_shape[1]}x{given_shape[0]}"
        raise SepiError(
            f"{file}: image_resolution is {size}, but the views are {whole[1]}x{whole[0]} (x, y); for cropped views "
            f"give --crop-of {size}+X+Y, for scaled ones correct image_resolution, disp_min and disp_max"
        )
    known = parameters.model_dump(include=set(_CAMERA))
    with naming(file):
        camera = None if None in known.values() else camera_from(**known, shape=shape, crop_of=options.part)
    # baseline_mm holds for both directions: rows are as far apart as columns
    settled, name, view = parameters.baseline_mm is not None, parameters.scene or str(name_of(path)), options.view
    return LightField(
        views, name, str(path), present, disparity_range, view=view, camera=camera, settled=settled, files=names
    )


def _views_in(path: Path, options: ReadOptions, parameters: _Parameters) -> tuple[dict[int, Path], tuple[int, int]]:
    """View files by number, and the grid."""
    with naming(path / PARAMETERS):
        given = parameters.pair("num_cams_y", "num_cams_x")
    files = _numbered_views(path)
    side = math.isqrt(max(files) + 1)
    grid = options.grid or given or (side, side)
    if options.grid is given is None and side**2 != max(files) + 1:
        what = f"{path}: views up to {files[max(files)].name} make {max(files) + 1}, which is not a square grid"
        raise SepiError(f"{what}; give --grid ROWSxCOLUMNS, or num_cams_x and num_cams_y in {PARAMETERS}")
    if max(files) >= grid[0] * grid[1]:
        source = "--grid" if options.grid else PARAMETERS
        raise SepiError(f"{files[max(files)]}: beyond the {grid[0]}x{grid[1]} grid that {source} gives")
    return files, grid


def _view_of_truth(path: Path, options: ReadOptions) -> tuple[tuple[int, int] | None, tuple[int, ...]]:
    """Position of the centre view of the folder's own grid, the view of the ground truth and masks; and the grid."""
    _, grid = _views_in(path, options, _parameters_of(path))
    numbers = arrange_numbers(str(path), grid, replace(options, exclude=()))
    return position_of(numbers, grid[0] // 2 * grid[1] + grid[1] // 2), numbers.shape


def _truth_of(folder: Path, shape: tuple[int, int], part: Part | None) -> Truth:
    """Ground truth and masks for views of a shape; those of the whole image are cropped like the views."""
    path = folder / TRUTH
    ground_truth = cut_like_views(read_pfm(path), shape, part) if path.is_file() else None
    if ground_truth is not None and ground_truth.shape != shape:
        raise SepiError(f"{path}: ground truth is {ground_truth.shape}, the views are {shape} (height, width)")
    masks = {}
    for path in sorted(folder.glob("mask_*.png")):
        name, header = path.stem.removeprefix("mask_"), picture_header(path)
        if (header.height, header.width) in (shape, None if part is None else part[1::-1]):
            picture = read_picture(path)
            values, highest = (cut_like_views(of(picture, axis=2), shape, part) for of in (np.min, np.max))
            # a region is white on black
            if values.shape == shape and (values == highest).all() and np.isin(values, (0, picture.max())).all():
                masks[name] = values > 0
                continue
        if name in _EVALUATED:
            raise SepiError(f"{path}: expected a black and white image of the views' size {shape} (height, width)")
    return ground_truth, masks


def _numbered_views(folder: Path) -> dict[int, Path]:
    """Files of the views by number."""
    names = sorted(path.name for path in folder.glob("input_Cam*.png"))
    if not names:
        raise SepiError(f"{folder}: no views (expected input_Cam000.png, input_Cam001.png, ...)")
    named = parse_view_numbers(str(folder), names, "input_Cam{number}.png")
    strange = [*named.unmatched, *(name for name in names if not name.removeprefix("input_Cam")[0].isdigit())]
    if strange:
        raise SepiError(f"{folder / strange[0]}: expected a name like input_Cam007.png")
    require_different(folder, named)
    return {number: folder / name for name, (number,) in named.numbers.items()}


def _parameters_of(folder: Path) -> _Parameters:
    """Parameters from all sections of ``parameters.cfg``."""
    path = folder / PARAMETERS
    if not path.is_file():
        return _Parameters()
    parser = configparser.ConfigParser(interpolation=None)
    with reading(path, "text file with '[section]' and 'key = value'"):
        data = path.read_bytes()
        try:
            text = data.decode("utf-8-sig")
        except UnicodeDecodeError:
            # some editors write comments in this encoding
            text = data.decode("latin-1")
        parser.read_string(text, source=path.name)
    values = {key: value for section in parser.sections() for key, value in parser.items(section)}
    used = {key: values[key] for key in _Parameters.model_fields if key in values}
    return validated(_Parameters, used, f"{path}: parameters")
