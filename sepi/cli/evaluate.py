"""The command ``sepi evaluate``."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from sepi.cli.input_options import Reading, reading_flags
from sepi.cli.scene_argument import require_one_view, scene_of
from sepi.command import SepiCommand
from sepi.errors import SepiError

if TYPE_CHECKING:
    from sepi.io.scores import Scores

_PATH = click.Path(path_type=Path)


@click.command(cls=SepiCommand, short_help="Score a disparity map against ground truth.")
@click.argument("estimate", type=_PATH)
@click.argument("ground_truth", metavar="TRUTH|SCENE", type=_PATH)
@click.option("--border", type=click.IntRange(min=0), help="Score with this many pixels left out on each side only.")
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
@reading_flags
def evaluate(estimate: Path, ground_truth: Path, border: int | None, as_json: bool, reading: Reading) -> None:
    """Score the disparity map ESTIMATE against ground truth.

    ESTIMATE is a PFM, an HDF5 file with a dataset 'disparity', a NumPy file (.npy), a 'disparity_16bit.png', or a
    folder that 'sepi depth' wrote. TRUTH is such a file; give the SCENE itself, a light field with ground truth, to
    have its occluded and textureless regions scored too. Give the flags of 'sepi depth' that say how to read the SCENE
    here, too. A folder that 'sepi depth' wrote knows which view it belongs to.

    Both protocols are used: 'paper' scores the whole map, 'benchmark' leaves out 15 pixels on each side.

    \b
    Examples:
      sepi evaluate cotton-depth cotton
      sepi evaluate estimate.pfm gt_disp_lowres.pfm --border 15 --json
    """
    scores = _scores(estimate, ground_truth, border, reading)
    if as_json:
        click.echo(json.dumps(_without_nan(scores), indent=2, sort_keys=True))
    else:
        click.echo(score_table(scores))


def _scores(estimate: Path, ground_truth: Path, border: int | None, reading: Reading) -> dict[str, dict[str, Scores]]:
    """Protocol to region to scores; the regions only where ``ground_truth`` is a light field."""
    from sepi.evaluate import PROTOCOLS, REGIONS, WHOLE_MAP, region_masks, score
    from sepi.io.disparity_maps import is_disparity, read_disparity

    disparity = read_disparity(estimate)
    masks = {}
    if is_disparity(ground_truth):
        values = read_disparity(ground_truth)
        require_one_view(estimate, ground_truth)
    else:
        light_field = scene_of(ground_truth, estimate, reading)
        if light_field.ground_truth is None:
            t, s = light_field.reference_position
            raise SepiError(f"{ground_truth}: no ground truth for view {t},{s}")
        values = light_field.ground_truth
        masks = region_masks(light_field)
    if values.shape != disparity.shape:
        raise SepiError(
            f"{ground_truth}: ground truth is {values.shape}, the estimate {disparity.shape} (height, width)"
        )
    protocols = PROTOCOLS if border is None else {f"border {border}": border}
    regions = REGIONS if masks else (WHOLE_MAP,)
    return {
        protocol: {region: score(disparity, values, left_out, masks.get(region)) for region in regions}
        for protocol, left_out in protocols.items()
    }


def score_table(scores: dict[str, dict[str, Scores]]) -> str:
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
