"""Evaluation (section V): scores, error maps and regions of a scene's disparity maps.

:mod:`sepi.scoring.scores` defines the scores.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import click
import numpy as np

from sepi.io.hdf5 import read_stage, read_with_truth
from sepi.io.provenance import scene_attributes
from sepi.io.scores import Evaluation, map_name, write_scores
from sepi.lightfield import FloatMap, LightField, require_light_field
from sepi.matching.unknown import with_unknown
from sepi.process.command import PATH, SepiCommand, bad_thresholds
from sepi.scoring.error_bars import ErrorBars, reliability
from sepi.scoring.regions import edges_of
from sepi.scoring.scores import DISCONTINUITIES, region_masks, score_regions
from sepi.stage import StageMaps
from sepi.validation import require_map, require_type


def evaluation_of(light_field: LightField, maps: FloatMap | StageMaps) -> Evaluation:
    """Scores, error map and masks of one disparity map of a light field.

    Parameters
    ----------
    light_field : LightField
        Without ground truth, the evaluation is empty.
    maps : ndarray, shape (H, W), float32, or StageMaps
        Disparity in pixels per view step, or final maps, whose error bars are scored, too.

    Returns
    -------
    Evaluation

    Raises
    ------
    SepiError
        If the map does not have the ground truth's shape.

    Examples
    --------
    >>> import sepi
    >>> from sepi.evaluate import evaluation_of
    >>> from sepi.scenes import render
    >>> light_field = render("wall", size=96, views=5)
    >>> found = evaluation_of(light_field, sepi.estimate_depth(light_field))
    >>> list(found.scores["paper"])
    ['all', 'occluded', 'textureless', 'discontinuities']
    >>> found.scores["paper"]["all"]["mse100"] < found.scores["paper"]["occluded"]["mse100"]
    True

    Scores of the error bars, among them how often the interval holds the truth, and how wide it is:

    >>> {"coverage", "width"} <= found.scores["paper"]["all"].keys()
    True
    """
    return evaluations_of(light_field, {"": maps})[""]


def evaluations_of(
    light_field: LightField, maps: Mapping[str, FloatMap | StageMaps], thresholds: Sequence[float] = ()
) -> dict[str, Evaluation]:
    """Scores, error maps and masks of several disparity maps of one light field, by name.

    Parameters
    ----------
    light_field : LightField
        Scored over the regions of :func:`sepi.scoring.scores.region_masks`. Without ground truth the evaluations are
        empty.
    maps : mapping of str to ndarray, shape (H, W), float32, or StageMaps
        Name to disparity in pixels per view step, or to final maps, whose error bars are scored, too.
    thresholds : sequence of float
        As :func:`sepi.scoring.scores.score` takes them.

    Returns
    -------
    dict of str to Evaluation
        In the order of ``maps``.

    Raises
    ------
    SepiError
        If a map does not have the ground truth's shape.

    Examples
    --------
    The gain by the stage for textureless regions of variant ``best`` on a bare wall:

    >>> import sepi
    >>> from sepi.evaluate import evaluations_of
    >>> from sepi.scenes import render
    >>> light_field = render("wall", size=96, views=5)
    >>> maps = {name: sepi.estimate_depth(light_field, name).disparity for name in ("best", "best_no_planes")}
    >>> found = evaluations_of(light_field, maps)
    >>> mse = {name: found[name].scores["paper"]["textureless"]["mse100"] for name in maps}
    >>> mse["best"] < 0.8 * mse["best_no_planes"]
    True
    """
    require_light_field(light_field)
    require_type(f"{light_field.name}: maps", maps, Mapping, "names with their maps")
    for name, found in maps.items():
        require_map(f"{light_field.name}: disparity{name and f' of {name}'}", _disparity(found), light_field.shape)
    if light_field.ground_truth is None or not maps:
        return {name: Evaluation() for name in maps}
    truth, masks = light_field.ground_truth, region_masks(light_field)
    sources = {name: "scene" if name in light_field.masks else "computed" for name in masks}
    # masks that all maps of the scene share
    common = Evaluation(regions=masks, region_sources=sources | {DISCONTINUITIES: "computed"})
    edges, known = edges_of(truth), np.isfinite(truth)
    evaluations: dict[str, Evaluation] = {}
    for name, one in maps.items():
        disparity = _disparity(one)
        bars = ErrorBars.of(one, light_field.reach) if isinstance(one, StageMaps) else None
        scores = score_regions(disparity, truth, masks, edges=edges, thresholds=thresholds, bars=bars)
        # NaN where either is not finite
        nowhere, both = np.full(truth.shape, np.nan, np.float32), known & np.isfinite(disparity)
        error = np.subtract(disparity, truth, out=nowhere, where=both)
        evaluations[name] = replace(common, scores=scores, error=error)
        if bars is not None and bars.close is not None:
            right = reliability(bars.maps.confidence[known], disparity[known] - truth[known], bars.close)
            evaluations[name] = replace(evaluations[name], reliability=np.array(right))
    return evaluations


def _disparity(maps: FloatMap | StageMaps) -> FloatMap:
    return maps.disparity if isinstance(maps, StageMaps) else maps


@click.command(name="python -m sepi.evaluate", cls=SepiCommand)
@click.option("--light-field", "light_field_path", type=PATH, required=True, help="From ingest.")
@click.option("--truth", type=PATH, help="Ground truth from sepi.truth; default: the light field's own.")
@click.option("--stages", type=PATH, required=True, help="Folder of the stage files, whose paths name the maps.")
@bad_thresholds
@click.option("--output", type=PATH, required=True, help="Score file (HDF5) to write.")
@click.argument("paths", nargs=-1, type=PATH, metavar="STAGE_FILE...", required=True)
def command(
    light_field_path: Path,
    truth: Path | None,
    stages: Path,
    thresholds: tuple[float, ...],
    output: Path,
    paths: tuple[Path, ...],
) -> None:
    """Score the disparity maps of stage files against the light field's ground truth, if it has one."""
    light_field = read_with_truth(light_field_path, truth)
    read = ((map_name(stages, path), read_stage(path)) for path in paths)
    # maps with error bars are final
    maps = {name: one.disparity if one.sigma is None else with_unknown(light_field, one) for name, one in read}
    write_scores(output, evaluations_of(light_field, maps, thresholds), scene_attributes(light_field))
    if light_field.ground_truth is None:
        click.echo(f"{light_field.name}: no ground truth, no scores", err=True)


if __name__ == "__main__":
    command()
