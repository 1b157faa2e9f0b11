"""The command ``sepi evaluate``."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from sepi.cli.input_options import Pair, Reading, read_ground_truth, reading_flags, truth_flags
from sepi.errors import SepiError, warn
from sepi.process.command import SepiCommand, bad_thresholds

if TYPE_CHECKING:
    from sepi.io.disparity_maps import TruthFile
    from sepi.io.scores import AllScores

_PATH = click.Path(path_type=Path)

NO_INTERVAL = "no interval: the map has no error bars"
"""Line for a map without error bars."""


@click.command(cls=SepiCommand)
@click.argument("estimate", type=_PATH)
@click.argument("ground_truth", metavar="[GROUND_TRUTH|SCENE]", type=_PATH, required=False)
@truth_flags
@bad_thresholds
@click.option("--border", type=click.IntRange(min=0), help="Pixels left out on each side, in place of both protocols.")
@click.option(
    "--offset",
    type=Pair("ROW,COLUMN"),
    metavar="ROW,COLUMN",
    help="For a crop as ESTIMATE: row and column of its top left pixel in the ground truth, from 0.",
)
@click.option(
    "--truth-step",
    type=click.FloatRange(min=0),
    metavar="D",
    help="Step of rounded ground truth, pixels per view step; an interval may miss it by half a step. "
    "[default: K of --truth-scale if FILE has whole numbers, else 0]",
)
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
@reading_flags
def evaluate(
    estimate: Path,
    ground_truth: Path | None,
    own: TruthFile | None,
    thresholds: tuple[float, ...],
    border: int | None,
    offset: tuple[int, int] | None,
    truth_step: float | None,
    as_json: bool,
    reading: Reading,
) -> None:
    """Score the disparity map ESTIMATE against ground truth.

    ESTIMATE is a PFM, an HDF5 file with a dataset 'disparity', a NumPy file (.npy), a TIFF of floats, a
    'disparity_16bit.png', or a folder that 'sepi depth' wrote. GROUND_TRUTH is such a file. With a SCENE, a light
    field with ground truth, occluded and textureless regions are scored, too. A folder that 'sepi depth' wrote records
    its light field, view and flags.

    --truth FILE is ground truth for a scene without any, or alone: a file as above, or a grey picture of 8 or 16 bit
    with --truth-scale K (disparity = level * K, 0 is unknown).

    Whole-image ground truth is cropped like the views, as given by --crop-of or by the result.

    There are two protocols: 'paper' scores the whole map, 'benchmark' leaves out 15 pixels on each side. With --offset,
    the crop's pixels are scored, and the border is that of the ground truth, not of the crop.

    Error bars of ESTIMATE are scored, too: how often the interval of 90 % holds the truth, its median width, the
    negative log likelihood of the errors (NLL), and how well sigma ranks the errors (AUSE, 0 is best).

    \b
    Examples:
      sepi evaluate cotton-depth cotton
      sepi evaluate estimate.pfm gt_disp_lowres.pfm --border 15 --json
      sepi evaluate inner_482x482.pfm cotton --offset 15,15
      sepi evaluate venus-depth venus --truth disp2.pgm --truth-scale 0.03125 --bad 0.25
    """
    from sepi.io.all_views import read_disparity_at, read_error_bars_at
    from sepi.io.files import naming
    from sepi.io.scores import without_nan
    from sepi.scoring.conventions import misfit
    from sepi.scoring.error_bars import ErrorBars
    from sepi.scoring.regions import in_frame
    from sepi.scoring.scores import PROTOCOLS, region_masks, score_regions

    source = ground_truth if own is None else own.path
    if source is None:
        raise click.UsageError("expected GROUND_TRUTH, a SCENE, or --truth FILE")
    disparity = read_disparity_at(estimate, reading.options.view)
    shape = None if offset is not None else disparity.shape
    values, light_field = read_ground_truth(ground_truth, estimate, reading, own, shape)
    if values is None:
        view = "" if light_field is None else ",".join(map(str, light_field.reference_position))
        raise SepiError(f"{source}: no ground truth for view {view}")
    crop = None if offset is None else {"offset": offset, "shape": disparity.shape, "whole": values.shape}
    inside = None
    if offset is not None:
        with naming(estimate):
            disparity, inside = in_frame(disparity, offset, values.shape)
    elif values.shape != disparity.shape:
        smaller = all(length <= whole for length, whole in zip(disparity.shape, values.shape, strict=True))
        raise SepiError(
            f"{source}: ground truth has shape {values.shape}, the estimate {disparity.shape} (height, width)"
            f"{'; for a crop, give --offset' if smaller else ''}"
        )
    doubt = misfit(disparity, values, None if light_field is None else light_field.grid)
    if doubt is not None:
        warn(f"{source}: the ground truth fits {estimate} far better {doubt}")
    masks = None if light_field is None else region_masks(light_field)
    protocols = PROTOCOLS if border is None else {f"border {border}": border}
    if truth_step is None:
        truth_step = 0.0 if own is None else own.step
    maps = read_error_bars_at(estimate, reading.options.view)
    bars = None if maps is None else ErrorBars.of(maps, None if light_field is None else light_field.reach, truth_step)
    if bars is not None and offset is not None:
        bars = bars.in_frame(offset, values.shape)
    scores = score_regions(disparity, values, masks, protocols, within=inside, thresholds=thresholds, bars=bars)
    if as_json:
        told = without_nan(scores) | ({} if crop is None else {"crop": crop})
        told |= {"truth_step": truth_step} if bars is not None and truth_step else {}
        click.echo(json.dumps(told, indent=2, sort_keys=True))
    else:
        lines = [] if crop is None else [_described(**crop)]
        click.echo("\n".join([*lines, score_table(scores, thresholds, truth_step)]))


def _described(offset: tuple[int, int], shape: tuple[int, int], whole: tuple[int, int]) -> str:
    """Line on the part of the ground truth that is scored."""
    (row, column), (height, width) = offset, shape
    return (
        f"crop: rows {row} to {row + height - 1}, columns {column} to {column + width - 1} of "
        f"{whole[0]}x{whole[1]} (height x width); borders are counted from the edges of the whole"
    )


def score_table(scores: AllScores, thresholds: Sequence[float] = (), truth_step: float = 0.0) -> str:
    """Scores as aligned columns, with notes on the intervals below."""
    from tabulate import tabulate

    from sepi.scoring.error_bars import ERROR_BAR_SCORES
    from sepi.scoring.scores import COUNTS, EDGE_SCORES, score_heads

    there = {name for regions in scores.values() for values in regions.values() for name in values}
    bars = {name: head for name, head in ERROR_BAR_SCORES.items() if name in there}
    heads = score_heads(thresholds) | EDGE_SCORES | bars | COUNTS
    rows = [
        [protocol, region, *(_cell(values[name]) for name in heads)]
        for protocol, regions in scores.items()
        for region, values in regions.items()
    ]
    alignment = ["left", "left", *["right"] * len(heads)]
    titles = ["protocol", "region", *heads.values()]
    table = str(tabulate(rows, titles, tablefmt="plain", colalign=alignment, disable_numparse=True))
    if not bars:
        return f"{table}\n{NO_INTERVAL}"
    rounded = f"ground truth in steps of {truth_step:g}: an interval may miss it by half a step"
    return f"{table}\n{rounded}" if truth_step else table


def _cell(value: float) -> str:
    """Text of a count, of a score with three decimals, or a dash for a score over no pixels."""
    if isinstance(value, int):
        return f"{value}"
    return "-" if math.isnan(value) else f"{value:.3f}"
