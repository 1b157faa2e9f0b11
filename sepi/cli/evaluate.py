"""The command ``sepi evaluate``."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import TYPE_CHECKING

import click

from sepi.cli.input_options import Reading, reading_flags
from sepi.cli.scene_argument import read_ground_truth
from sepi.command import SepiCommand
from sepi.errors import SepiError

if TYPE_CHECKING:
    from sepi.io.scores import AllScores

_PATH = click.Path(path_type=Path)


@click.command(cls=SepiCommand, short_help="Score a disparity map against ground truth.")
@click.argument("estimate", type=_PATH)
@click.argument("ground_truth", metavar="GROUND_TRUTH|SCENE", type=_PATH)
@click.option("--border", type=click.IntRange(min=0), help="Score with this many pixels left out on each side only.")
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
@reading_flags
def evaluate(estimate: Path, ground_truth: Path, border: int | None, as_json: bool, reading: Reading) -> None:
    """Score the disparity map ESTIMATE against ground truth.

    ESTIMATE is a PFM, an HDF5 file with a dataset 'disparity', a NumPy file (.npy), a 'disparity_16bit.png', or a
    folder that 'sepi depth' wrote. GROUND_TRUTH is such a file; give the SCENE itself, a light field with ground truth,
    to have its occluded and textureless regions scored too. Give the flags of 'sepi depth' that say how to read the
    SCENE here, too. A folder that 'sepi depth' wrote knows which view it belongs to.

    Both protocols are used: 'paper' scores the whole map, 'benchmark' leaves out 15 pixels on each side.

    \b
    Examples:
      sepi evaluate cotton-depth cotton
      sepi evaluate estimate.pfm gt_disp_lowres.pfm --border 15 --json
    """
    from sepi.evaluate import PROTOCOLS, region_masks, score_regions
    from sepi.io.disparity_maps import read_disparity
    from sepi.io.scores import without_nan

    disparity = read_disparity(estimate)
    values, light_field = read_ground_truth(ground_truth, estimate, reading)
    if values is None:
        view = "" if light_field is None else ",".join(map(str, light_field.reference_position))
        raise SepiError(f"{ground_truth}: no ground truth for view {view}")
    if values.shape != disparity.shape:
        raise SepiError(
            f"{ground_truth}: ground truth is {values.shape}, the estimate {disparity.shape} (height, width)"
        )
    masks = None if light_field is None else region_masks(light_field)
    protocols = PROTOCOLS if border is None else {f"border {border}": border}
    scores = score_regions(disparity, values, masks, protocols)
    click.echo(json.dumps(without_nan(scores), indent=2, sort_keys=True) if as_json else score_table(scores))


def score_table(scores: AllScores) -> str:
    """Scores as aligned columns."""
    from tabulate import tabulate

    from sepi.evaluate import COUNTS, EDGE_SCORES, SCORES

    heads = SCORES | EDGE_SCORES | COUNTS
    rows = [
        [protocol, region, *(_cell(values[name]) for name in heads)]
        for protocol, regions in scores.items()
        for region, values in regions.items()
    ]
    alignment = ["left", "left", *["right"] * len(heads)]
    titles = ["protocol", "region", *heads.values()]
    return str(tabulate(rows, titles, tablefmt="plain", colalign=alignment, disable_numparse=True))


def _cell(value: float) -> str:
    """A count as it is, a score with three decimals, a score over no pixels as a dash."""
    if isinstance(value, int):
        return f"{value}"
    return "-" if math.isnan(value) else f"{value:.3f}"
