"""The command ``sepi evaluate``."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from sepi.command import SepiCommand
from sepi.errors import SepiError
from sepi.input_options import Reading, reading_flags

if TYPE_CHECKING:
    from sepi.io.scores import Scores
    from sepi.lightfield import FloatMap, LightField

_PATH = click.Path(path_type=Path)


@click.command(cls=SepiCommand, short_help="Score a disparity map against ground truth.")
@click.argument("estimate", type=_PATH)
@click.argument("truth", metavar="TRUTH|SCENE", type=_PATH)
@click.option("--border", type=click.IntRange(min=0), help="Score with this many pixels left out on each side only.")
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
@reading_flags
def evaluate(estimate: Path, truth: Path, border: int | None, as_json: bool, reading: Reading) -> None:
    """Score the disparity map ESTIMATE against ground truth.

    ESTIMATE is a PFM, an HDF5 file with a dataset 'disparity', a NumPy file (.npy), or a folder that 'sepi depth'
    wrote. TRUTH is such a file; give the SCENE itself, a light field with ground truth, to have its occluded and
    texture-less regions scored too. Give the flags of 'sepi depth' that say how to read the SCENE here, too. A folder
    that 'sepi depth' wrote knows which view it belongs to.

    Both protocols are used: 'paper' scores the whole map, 'benchmark' leaves out 15 pixels on each side.

    \b
    Examples:
      sepi evaluate cotton-depth cotton
      sepi evaluate estimate.pfm gt_disp_lowres.pfm --border 15 --json
    """
    scores = _scores(estimate, truth, border, reading)
    if as_json:
        click.echo(json.dumps(_without_nan(scores), indent=2, sort_keys=True))
    else:
        click.echo(_table(scores))


def _is_map(path: Path) -> bool:
    """Whether ``path`` is one disparity map rather than a light field."""
    from sepi.io.hdf5 import holds

    if path.is_dir():
        return (path / "disparity.pfm").is_file()
    return path.suffix in (".pfm", ".npy") or (path.suffix in (".h5", ".hdf5") and holds(path, "disparity"))


def _read_map(path: Path) -> FloatMap:
    """A disparity map from a PFM, HDF5 or NumPy file, or from the folder of a result."""
    import numpy as np

    from sepi.io.hdf5 import read_map
    from sepi.io.numpy_files import read_array
    from sepi.io.pfm import read_pfm

    if path.is_dir():
        path = path / "disparity.pfm"
    if not path.is_file():
        raise SepiError(f"{path}: no such file")
    if path.suffix == ".pfm":
        return read_pfm(path)
    if path.suffix in (".h5", ".hdf5"):
        return read_map(path, "disparity")
    if path.suffix != ".npy":
        raise SepiError(f"{path}: expected a disparity map as .pfm, .h5 or .npy")
    values = read_array(path)
    if values.ndim != 2 or values.dtype.kind not in "fiu":
        raise SepiError(f"{path}: expected an array of numbers of shape (H, W)")
    return np.asarray(values, np.float32)


def _view_of(path: Path) -> tuple[tuple[int, int], tuple[int, int]] | None:
    """The view that a result's map belongs to, and the view grid; None for a map that does not say."""
    from sepi.io.hdf5 import read_attributes

    path = path / "result.h5" if path.is_dir() else path
    if path.suffix not in (".h5", ".hdf5") or not path.is_file():
        return None
    attributes = read_attributes(path)
    if not {"view_position", "grid"} <= set(attributes):
        return None
    (t, s), (rows, columns) = (map(int, attributes[name]) for name in ("view_position", "grid"))
    return (t, s), (rows, columns)


def _truth_of_scene(scene: Path, estimate: Path, reading: Reading) -> LightField:
    """The light field with ground truth of the view that the estimate belongs to."""
    belongs = _view_of(estimate)
    if belongs is not None and reading.options.view is None:
        reading = replace(reading, options=replace(reading.options, view=belongs[0]))
    light_field = reading.read(scene, check_order=False)
    if belongs is not None and belongs != (light_field.reference, light_field.grid):
        (t, s), (rows, columns) = belongs
        raise SepiError(
            f"{estimate}: depth of view {t},{s} of {rows}x{columns} views, but {scene} is read as view "
            f"{light_field.reference[0]},{light_field.reference[1]} of {light_field.grid[0]}x{light_field.grid[1]}; "
            "give the flags here that 'sepi depth' had"
        )
    if light_field.truth is None:
        raise SepiError(f"{scene}: no ground truth for view {light_field.reference[0]},{light_field.reference[1]}")
    return light_field


def _scores(estimate: Path, truth: Path, border: int | None, reading: Reading) -> dict[str, dict[str, Scores]]:
    """Protocol to region to scores; the regions only where ``truth`` is a light field."""
    from sepi.evaluate import PROTOCOLS, REGIONS, WHOLE_MAP, region_masks, score

    disparity = _read_map(estimate)
    masks = {}
    if _is_map(truth):
        values = _read_map(truth)
        views = _view_of(estimate), _view_of(truth)
        if None not in views and views[0] != views[1]:
            raise SepiError(f"{truth}: depth of another view than {estimate}; compare maps of one view")
    else:
        light_field = _truth_of_scene(truth, estimate, reading)
        assert light_field.truth is not None  # or it would have been refused
        values = light_field.truth
        masks = region_masks(light_field)
    if values.shape != disparity.shape:
        raise SepiError(f"{truth}: ground truth is {values.shape}, the estimate {disparity.shape} (height, width)")
    protocols = PROTOCOLS if border is None else {f"border {border}": border}
    regions = REGIONS if masks else (WHOLE_MAP,)
    return {
        protocol: {region: score(disparity, values, left_out, masks.get(region)) for region in regions}
        for protocol, left_out in protocols.items()
    }


def _table(scores: dict[str, dict[str, Scores]]) -> str:
    """Scores as aligned columns."""
    heads = {
        "mse100": "MSE x100",
        "q25": "Q25 x100",
        "badpix007": "BadPix 0.07 %",
        "badpix003": "BadPix 0.03 %",
        "badpix001": "BadPix 0.01 %",
        "non_finite": "non-finite",
        "pixels": "pixels",
    }
    rows = [["protocol", "region", *heads.values()]]
    for protocol, regions in scores.items():
        for region, values in regions.items():
            rows.append([protocol, region, *(_cell(values[key]) for key in heads)])
    widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))]
    return "\n".join(
        "  ".join(
            text.ljust(width) if column < 2 else text.rjust(width)
            for column, (text, width) in enumerate(zip(row, widths, strict=True))
        )
        for row in rows
    )


def _cell(value: float) -> str:
    """A count as it is, a score with three decimals, a score over no pixels as a dash."""
    if isinstance(value, int):
        return f"{value}"
    return "-" if math.isnan(value) else f"{value:.3f}"


def _without_nan(value: Any) -> Any:
    """NaN, which JSON does not have, as null."""
    if isinstance(value, dict):
        return {key: _without_nan(inner) for key, inner in value.items()}
    return None if isinstance(value, float) and math.isnan(value) else value
