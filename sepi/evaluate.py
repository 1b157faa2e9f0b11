"""Evaluation: how far a disparity map is from the ground truth, by two protocols and over three regions.

Scores follow the paper (section V) and the HCI 4D light field benchmark. A non-finite estimate counts as bad and is
reported, where the benchmark's own toolkit counts it as good. Pixels without finite ground truth are left out.
"""

from __future__ import annotations

from pathlib import Path

import click
import numpy as np

from sepi import regions
from sepi.command import SepiCommand
from sepi.errors import SepiError
from sepi.io.hdf5 import read_light_field, read_stage
from sepi.io.scores import Evaluation, Scores, write_scores
from sepi.lightfield import BoolMap, FloatMap, LightField
from sepi.provenance import history_of, stage_attributes

PROTOCOLS: dict[str, int] = {"paper": 0, "benchmark": 15}
"""Protocol to the pixels left out on each side."""

BAD_PIXEL: dict[str, float] = {"badpix007": 0.07, "badpix003": 0.03, "badpix001": 0.01}
"""Score to the error in pixels per view step above which a pixel is bad."""

WHOLE_MAP = "all"
"""Name of the region that is the whole map."""

REGIONS: tuple[str, ...] = (WHOLE_MAP, "occluded", "textureless")
"""Regions that are scored."""


def score(estimate: FloatMap, truth: FloatMap, border: int = 0, region: BoolMap | None = None) -> Scores:
    """Scores of a disparity map.

    Parameters
    ----------
    estimate, truth : ndarray, shape (H, W), float32
        Disparity in pixels per view step.
    border : int
        Pixels left out on each side: 0 for the paper's protocol, 15 for the benchmark's.
    region : ndarray, shape (H, W), bool, optional
        Where to score; everywhere unless given.

    Returns
    -------
    dict
        ``mse100``: 100 x mean squared error over finite estimates; ``q25``: the 25th percentile of 100 x absolute
        error, not interpolated; ``badpix007``, ``badpix003``, ``badpix001``: percentage of pixels with a larger error
        than 0.07, 0.03, 0.01, a non-finite estimate being one; ``non_finite``, ``pixels``: counts. A score over no
        pixels is NaN.

    Raises
    ------
    SepiError
        If shapes differ.
    """
    _require_shape("truth", truth, estimate)
    chosen = np.isfinite(truth)
    if region is not None:
        _require_shape("region", region, estimate)
        chosen = chosen & region
    inside = np.s_[border : -border or None, border : -border or None]
    chosen = chosen[inside]
    error = np.abs(estimate[inside][chosen].astype(np.float64) - truth[inside][chosen])
    finite = np.isfinite(error)
    scores: Scores = {"mse100": 100 * _mean(error[finite] ** 2), "q25": _quarter(100 * error)}
    # written so that NaN is bad
    scores |= {name: 100 * _mean(~(error <= threshold)) for name, threshold in BAD_PIXEL.items()}
    scores |= {"non_finite": int(np.count_nonzero(~finite)), "pixels": error.size}
    return scores


def evaluate(light_field: LightField, disparity: FloatMap) -> dict[str, dict[str, Scores]]:
    """Scores of a disparity map of this light field, by every protocol and over every region.

    Parameters
    ----------
    light_field : LightField
        Its own masks ``occluded`` and ``textureless`` are used where it has them, else those of ``sepi.regions``.
    disparity : ndarray, shape (H, W), float32
        Pixels per view step.

    Returns
    -------
    dict
        Protocol (``paper``, ``benchmark``) to region (``all``, ``occluded``, ``textureless``) to the scores of
        :func:`score`; empty where the light field has no ground truth.

    Raises
    ------
    SepiError
        If the map does not have the light field's shape.
    """
    return {protocol: dict(scores) for protocol, scores in evaluation_of(light_field, disparity).scores.items()}


def evaluation_of(light_field: LightField, disparity: FloatMap) -> Evaluation:
    """Like :func:`evaluate`, with the error map and the masks that were used."""
    if disparity.shape != light_field.shape:
        raise SepiError(
            f"{light_field.name}: a disparity map must have the views' shape {light_field.shape}, got {disparity.shape}"
        )
    truth = light_field.truth
    if truth is None:
        return Evaluation()
    masks = region_masks(light_field)
    known = np.isfinite(truth) & np.isfinite(disparity)
    error = np.subtract(disparity, truth, out=np.full(truth.shape, np.nan, np.float32), where=known)
    return Evaluation(
        scores={
            protocol: {region: score(disparity, truth, border, masks.get(region)) for region in REGIONS}
            for protocol, border in PROTOCOLS.items()
        },
        error=error,
        regions=masks,
        region_sources={name: "scene" if name in light_field.masks else "computed" for name in masks},
    )


def region_masks(light_field: LightField) -> dict[str, BoolMap]:
    """The masks ``occluded`` and ``textureless``, (H, W) bool: the scene's own, else computed from its ground truth."""
    if light_field.truth is None:
        raise SepiError(f"{light_field.name}: regions for evaluation need ground truth, and this scene has none")
    masks = dict(light_field.masks)
    if "occluded" not in masks:
        masks["occluded"] = regions.occluded(
            light_field.truth, light_field.grid, light_field.reference, light_field.present
        )
    if "textureless" not in masks:
        masks["textureless"] = regions.textureless(light_field.centre)
    return {name: masks[name] for name in ("occluded", "textureless")}


def _require_shape(what: str, values: FloatMap | BoolMap, estimate: FloatMap) -> None:
    if values.shape != estimate.shape:
        raise SepiError(f"{what} must have the estimate's shape (H, W) = {estimate.shape}, got {values.shape}")


def _mean(values: FloatMap | BoolMap) -> float:
    # the mean of nothing would be a warning
    return float(np.mean(values)) if values.size else float("nan")


def _quarter(error: FloatMap) -> float:
    return float(np.sort(error)[int(0.25 * error.size)]) if error.size else float("nan")


@click.command(name="python -m sepi.evaluate", cls=SepiCommand)
@click.option("--light-field", "light_field_path", type=click.Path(path_type=Path), required=True, help="From ingest.")
@click.option("--stage", "stage_path", type=click.Path(path_type=Path), required=True, help="Stage file to score.")
@click.option("--output", type=click.Path(path_type=Path), required=True, help="Score file to write (HDF5).")
def command(light_field_path: Path, stage_path: Path, output: Path) -> None:
    """Score a stage's disparity map against the light field's ground truth, if it has one."""
    light_field = read_light_field(light_field_path)
    steps = history_of(stage_path)
    evaluation = evaluation_of(light_field, read_stage(stage_path).disparity)
    if evaluation.error is None:
        click.echo(f"{light_field.name}: no ground truth, no scores", err=True)
    write_scores(output, evaluation, stage_attributes(light_field, steps))


if __name__ == "__main__":
    command()
