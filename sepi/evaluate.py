"""Evaluation (section V): the scores, the error and the regions of every map of a scene, each computed once.

:mod:`sepi.scoring.scores` says what the scores are.
"""

from __future__ import annotations

import hashlib
import shutil
from collections.abc import Mapping
from contextlib import suppress
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import click
import numpy as np
import numpy.typing as npt

from sepi.command import SepiCommand
from sepi.errors import SepiError
from sepi.io.files import atomic_path
from sepi.io.hdf5 import read_light_field, read_stage
from sepi.io.provenance import scene_attributes
from sepi.io.scores import Evaluation, Scored, map_name, read_evaluations, write_scores
from sepi.lightfield import FloatMap, LightField
from sepi.scoring.edges import edges_of
from sepi.scoring.scores import (
    BAD_PIXEL,
    DISCONTINUITIES,
    PROTOCOLS,
    SCORED_REGIONS,
    region_masks,
    score_regions,
)


def evaluation_of(light_field: LightField, disparity: FloatMap) -> Evaluation:
    """Scores, error map and masks of one disparity map of a light field.

    Parameters
    ----------
    light_field : LightField
        With ground truth; without, the evaluation is empty.
    disparity : ndarray, shape (H, W), float32
        Pixels per view step.

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
    >>> found = evaluation_of(light_field, sepi.estimate_depth(light_field).disparity)
    >>> list(found.scores["paper"])
    ['all', 'occluded', 'textureless', 'discontinuities']
    >>> found.scores["paper"]["all"]["mse100"] < found.scores["paper"]["occluded"]["mse100"]
    True
    """
    return evaluations_of(light_field, {"": disparity})[""]


def evaluations_of(light_field: LightField, maps: Mapping[str, FloatMap]) -> dict[str, Evaluation]:
    """Scores, error maps and masks of disparity maps of one light field, by name; the masks are found once for all.

    Parameters
    ----------
    light_field : LightField
        Its own masks ``occluded`` and ``textureless`` are used where it has them, else those of
        :mod:`sepi.scoring.regions`. Without ground truth the evaluations are empty.
    maps : mapping of str to ndarray, shape (H, W), float32
        Name to disparity in pixels per view step.

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
    What the stage for textureless regions of variant ``best`` is worth on a bare wall:

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
    if light_field.ground_truth is None or not maps:
        return {name: Evaluation() for name in maps}
    masks = region_masks(light_field)
    sources = {name: "scene" if name in light_field.masks else "computed" for name in masks}
    sources[DISCONTINUITIES] = "computed"
    edges = edges_of(light_field.ground_truth)
    return {
        name: Evaluation(
            scores=score_regions(disparity, light_field.ground_truth, masks, edges=edges),
            error=_error(disparity, light_field.ground_truth),
            regions=masks,
            region_sources=sources,
        )
        for name, disparity in maps.items()
    }


def score_maps(
    light_field: LightField, maps: Mapping[str, FloatMap], known: Mapping[str, Scored], code: str = ""
) -> tuple[dict[str, Scored], list[str]]:
    """The evaluation of every map, taken from ``known`` where that was made of the same.

    Parameters
    ----------
    light_field : LightField
    maps : mapping of str to ndarray, shape (H, W), float32
        Name to disparity in pixels per view step.
    known : mapping of str to Scored
        Earlier evaluations, by name.
    code : str
        Digest of the code that evaluates: what other code found is not kept.

    Returns
    -------
    scored : dict of str to Scored
        In the order of ``maps``.
    anew : list of str
        Those that were not kept.

    Raises
    ------
    SepiError
        If a map does not have the ground truth's shape.
    """
    scene = _digest_of_scene(light_field, code)
    digests = {name: _digest(scene, disparity) for name, disparity in maps.items()}
    anew = [name for name in maps if name not in known or known[name].digest != digests[name]]
    found = evaluations_of(light_field, {name: maps[name] for name in anew})
    scored = {name: Scored(digests[name], found[name]) if name in found else known[name] for name in maps}
    return scored, anew


def _error(disparity: FloatMap, ground_truth: FloatMap) -> FloatMap:
    """Estimate minus ground truth; NaN where either is unknown."""
    known = np.isfinite(ground_truth) & np.isfinite(disparity)
    return np.subtract(disparity, ground_truth, out=np.full(ground_truth.shape, np.nan, np.float32), where=known)


def _digest_of_scene(light_field: LightField, code: str) -> str:
    """Digest of what decides the scores beside the map: code, ground truth, masks, and what masks are computed from."""
    facts = [code, _versions(), list(light_field.masks), list(SCORED_REGIONS), PROTOCOLS, BAD_PIXEL]
    arrays: list[npt.NDArray[Any]] = [light_field.baselines, *light_field.masks.values()]
    arrays += [] if light_field.ground_truth is None else [light_field.ground_truth, light_field.reference_view]
    return _digest(repr(facts), *arrays)


def _versions() -> list[str]:
    """Versions of the libraries that masks are computed with; of those that are there under this name."""
    found = [np.__version__]
    for name in ("scipy", "numba", "opencv-python-headless"):
        with suppress(PackageNotFoundError):
            found.append(version(name))
    return found


def _digest(text: str, *arrays: npt.NDArray[Any]) -> str:
    total = hashlib.sha256(text.encode())
    for values in arrays:
        total.update(f"{values.shape} {values.dtype}".encode())
        total.update(np.ascontiguousarray(values).data.cast("B"))
    return total.hexdigest()


_PATH = click.Path(path_type=Path)


@click.command(name="python -m sepi.evaluate", cls=SepiCommand)
@click.option("--light-field", "light_field_path", type=_PATH, required=True, help="From ingest.")
@click.option("--stages", type=_PATH, required=True, help="Folder of the stage files; their paths in it name the maps.")
@click.option("--code", default="", help="Digest of the code: maps that other code scored are scored anew.")
@click.option("--kept", type=_PATH, help="Score file of an earlier call: what still holds in it is taken over.")
@click.option("--output", type=_PATH, required=True, help="Score file (HDF5) to write, and then to keep.")
@click.argument("paths", nargs=-1, type=_PATH, metavar="STAGE_FILE...", required=True)
def command(
    light_field_path: Path, stages: Path, code: str, kept: Path | None, output: Path, paths: tuple[Path, ...]
) -> None:
    """Score the disparity maps of stage files against the light field's ground truth, if it has one."""
    light_field = read_light_field(light_field_path)
    maps = {map_name(stages, path): read_stage(path).disparity for path in paths}
    known: dict[str, Scored] = {}
    if kept is not None:
        # absent, or of an earlier version: all is scored anew
        with suppress(SepiError):
            known = read_evaluations(kept)
    scored, anew = score_maps(light_field, maps, known, code)
    write_scores(output, scored, scene_attributes(light_field))
    if kept is not None:
        with atomic_path(kept) as temporary:
            shutil.copyfile(output, temporary)
    if light_field.ground_truth is None:
        click.echo(f"{light_field.name}: no ground truth, no scores", err=True)
    else:
        click.echo(f"{light_field.name}: {len(anew)} of {len(maps)} maps scored anew: {', '.join(anew)}", err=True)


if __name__ == "__main__":
    command()
