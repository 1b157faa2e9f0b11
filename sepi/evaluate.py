"""Evaluation: how far a disparity map is from the ground truth, by two protocols and over four regions.

Scores follow the paper (section V) and the HCI 4D light field benchmark. A non-finite estimate counts as bad and is
reported, where the benchmark's own toolkit counts it as good. Pixels of the mask ``unknown`` are scored as they stand:
no answer is no excuse. Pixels without finite ground truth are left out.

Examples
--------
The paper's tables score whole maps, the HCI benchmark leaves a border out:

>>> from sepi.evaluate import PROTOCOLS
>>> PROTOCOLS
{'paper': 0, 'benchmark': 15}
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
from sepi.io.scores import AllScores, Evaluation, Scored, Scores, map_name, read_evaluations, write_scores
from sepi.lightfield import BoolMap, FloatMap, LightField
from sepi.scoring.edges import Edges, edges_of, fattening_and_thinning

PROTOCOLS: dict[str, int] = {"paper": 0, "benchmark": 15}
"""Protocol to the pixels left out on each side."""

BAD_PIXEL: dict[str, float] = {"badpix007": 0.07, "badpix003": 0.03, "badpix001": 0.01}
"""Score to the error in pixels per view step above which a pixel is bad."""

SCORES: dict[str, str] = {
    "mse100": "MSE x100",
    "q25": "Q25 x100",
    **{name: f"BadPix {threshold} %" for name, threshold in BAD_PIXEL.items()},
}
"""Score to its name in tables."""

EDGE_SCORES: dict[str, str] = {"fattening": "fattening %", "thinning": "thinning %"}
"""Score of what happens beside depth discontinuities (:mod:`sepi.scoring.edges`) to its name in tables."""

COUNTS: dict[str, str] = {"non_finite": "non-finite", "pixels": "pixels"}
"""Count that stands beside the scores to its name in tables."""

WHOLE_MAP = "all"
"""Name of the region that is the whole map."""

REGIONS: tuple[str, ...] = (WHOLE_MAP, "occluded", "textureless")
"""Regions of the paper's tables."""

DISCONTINUITIES = "discontinuities"
"""Name of the region beside depth discontinuities."""

SCORED_REGIONS: tuple[str, ...] = (*REGIONS, DISCONTINUITIES)
"""Regions that are scored."""


def score(
    estimate: FloatMap,
    ground_truth: FloatMap,
    border: int = 0,
    region: BoolMap | None = None,
    edges: Edges | None = None,
) -> Scores:
    """Scores of a disparity map: those of the paper (section V) and of the HCI 4D light field benchmark [1]_.

    Parameters
    ----------
    estimate, ground_truth : ndarray, shape (H, W), float32
        Disparity in pixels per view step.
    border : int
        Pixels left out on each side: 0 for the paper's protocol, 15 for the benchmark's.
    region : ndarray, shape (H, W), bool, optional
        Where to score; everywhere unless given.
    edges : Edges, optional
        Those of the ground truth, which are found unless given.

    Returns
    -------
    dict
        ``mse100``: 100 x mean squared error over finite estimates; ``q25``: the 25th percentile of 100 x absolute
        error, not interpolated; ``badpix007``, ``badpix003``, ``badpix001``: percentage of pixels with a larger error
        than 0.07, 0.03, 0.01, a non-finite estimate being one; ``fattening``, ``thinning``: as
        :func:`sepi.scoring.edges.fattening_and_thinning`; ``non_finite``, ``pixels``: counts. A score over no pixels is
        NaN.

    Raises
    ------
    SepiError
        If shapes differ.

    References
    ----------
    .. [1] K. Honauer, O. Johannsen, D. Kondermann, B. Goldluecke, "A dataset and evaluation methodology for depth
           estimation on 4D light fields", ACCV 2016. doi:10.1007/978-3-319-54187-7_2

    Examples
    --------
    A map that is 0.02 too near everywhere, but for a tenth that is 0.1 too far:

    >>> import numpy as np
    >>> from sepi.evaluate import score
    >>> truth = np.zeros((10, 10), np.float32)
    >>> estimate = np.full((10, 10), 0.02, np.float32)
    >>> estimate[0] = -0.1
    >>> found = score(estimate, truth)
    >>> [round(found[name], 3) for name in ("mse100", "q25", "badpix007", "badpix001")]
    [0.136, 2.0, 10.0, 100.0]
    >>> round(score(estimate, truth, border=1)["mse100"], 3)
    0.04
    """
    _require_shape("ground_truth", ground_truth, estimate)
    chosen = np.isfinite(ground_truth)
    if region is not None:
        _require_shape("region", region, estimate)
        chosen = chosen & region
    chosen = chosen & _within(border, chosen.shape)
    error = np.abs(estimate[chosen].astype(np.float64) - ground_truth[chosen])
    finite = np.isfinite(error)
    quarter = float(np.sort(100 * error)[error.size // 4]) if error.size else float("nan")
    scores: Scores = {"mse100": 100 * _mean(error[finite] ** 2), "q25": quarter}
    # written so that NaN is bad
    scores |= {name: 100 * _mean(~(error <= threshold)) for name, threshold in BAD_PIXEL.items()}
    edge_scores = fattening_and_thinning(estimate, edges or edges_of(ground_truth), chosen)
    scores |= dict(zip(EDGE_SCORES, edge_scores, strict=True))
    scores |= {"non_finite": int(np.count_nonzero(~finite)), "pixels": error.size}
    return scores


def score_regions(
    estimate: FloatMap,
    ground_truth: FloatMap,
    masks: Mapping[str, BoolMap] | None = None,
    protocols: Mapping[str, int] = PROTOCOLS,
    edges: Edges | None = None,
    within: BoolMap | None = None,
) -> AllScores:
    """Scores of a disparity map by every protocol and over every region.

    Parameters
    ----------
    estimate, ground_truth : ndarray, shape (H, W), float32
        Disparity in pixels per view step.
    masks : mapping of str to ndarray, shape (H, W), bool, optional
        Those of :func:`region_masks`; without them the regions are the whole map and the discontinuities.
    protocols : mapping of str to int
        Protocol to the pixels left out on each side.
    edges : Edges, optional
        Those of the ground truth, which are found unless given.
    within : ndarray, shape (H, W), bool, optional
        The pixels that count in every region, such as those of a crop (:func:`sepi.scoring.crops.in_frame`); all
        unless given.

    Returns
    -------
    dict
        Protocol (``paper``, ``benchmark``) to region (``all``, ``occluded``, ``textureless``,
        ``discontinuities``) to the scores of :func:`score`.

    Raises
    ------
    SepiError
        If shapes differ.

    Examples
    --------
    With regions of one's own, here the left and the right half:

    >>> import numpy as np
    >>> from sepi.evaluate import score_regions
    >>> from sepi.scenes import render
    >>> truth = render("wall", size=64, views=2).ground_truth
    >>> left = np.zeros(truth.shape, bool)
    >>> left[:, :32] = True
    >>> scores = score_regions(np.where(left, truth, truth + 1), truth, {"left": left, "right": ~left})
    >>> [round(scores["paper"][region]["mse100"], 3) for region in ("all", "left", "right")]
    [50.0, 0.0, 100.0]
    >>> scores["benchmark"]["all"]["pixels"]  # without the border of 15 pixels
    1156
    """
    edges = edges or edges_of(ground_truth)
    regions: dict[str, BoolMap | None] = {WHOLE_MAP: None, **(masks or {DISCONTINUITIES: edges.region})}
    if within is not None:
        regions = {name: within if mask is None else within & mask for name, mask in regions.items()}
    return {
        protocol: {name: score(estimate, ground_truth, border, mask, edges) for name, mask in regions.items()}
        for protocol, border in protocols.items()
    }


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


def region_masks(light_field: LightField) -> dict[str, BoolMap]:
    """The regions that maps are scored over.

    Parameters
    ----------
    light_field : LightField
        With ground truth. Its own masks ``occluded`` and ``textureless`` are taken where it has them; the others are
        computed (:mod:`sepi.scoring.regions`, :mod:`sepi.scoring.edges`).

    Returns
    -------
    dict of str to ndarray, shape (H, W), bool
        ``occluded``, ``textureless`` and ``discontinuities``.

    Raises
    ------
    SepiError
        If there is no ground truth.

    Examples
    --------
    >>> from sepi.evaluate import region_masks
    >>> from sepi.scenes import render
    >>> masks = region_masks(render("wall", size=64, views=3))
    >>> sorted(masks)
    ['discontinuities', 'occluded', 'textureless']
    >>> masks["textureless"].shape, masks["textureless"].dtype.name
    ((64, 64), 'bool')
    """
    if light_field.ground_truth is None:
        raise SepiError(f"{light_field.name}: regions for evaluation need ground truth, and this scene has none")
    names = ("occluded", "textureless")
    masks = dict(light_field.masks)
    if not masks.keys() >= set(names):
        from sepi.scoring import regions

        if "occluded" not in masks:
            masks["occluded"] = regions.occluded(light_field.ground_truth, light_field.baselines)
        if "textureless" not in masks:
            masks["textureless"] = regions.textureless(light_field.reference_view)
    found = {name: masks[name] for name in names}
    return found | {DISCONTINUITIES: edges_of(light_field.ground_truth).region}


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


def _within(border: int, shape: tuple[int, ...]) -> BoolMap:
    """All pixels but those of a border."""
    inside = np.zeros(shape, bool)
    inside[border : -border or None, border : -border or None] = True
    return inside


def _require_shape(what: str, values: FloatMap | BoolMap, estimate: FloatMap) -> None:
    if values.shape != estimate.shape:
        raise SepiError(f"{what} must have the estimate's shape (H, W) = {estimate.shape}, got {values.shape}")


def _mean(values: FloatMap | BoolMap) -> float:
    # the mean of nothing would be a warning
    return float(np.mean(values)) if values.size else float("nan")


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
