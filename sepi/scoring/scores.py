"""Scores of disparity maps against ground truth, for two protocols and four regions.

Scores follow the paper (section V) and the HCI 4D light field benchmark. A non-finite estimate counts as bad and is
reported, whereas the benchmark's own toolkit counts it as good. Pixels of the mask ``unknown`` are scored like all
others. Pixels without finite ground truth are left out.

Examples
--------
The paper's tables score whole maps, the HCI benchmark excludes a border:

>>> from sepi.scoring.scores import PROTOCOLS
>>> PROTOCOLS
{'paper': 0, 'benchmark': 15}
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from sepi.errors import SepiError
from sepi.io.scores import AllScores, Scores
from sepi.lightfield import BoolMap, FloatMap, LightField, require_light_field
from sepi.scoring.error_bars import ErrorBars
from sepi.scoring.regions import Edges, edges_of, fattening_and_thinning, occluded, textureless
from sepi.validation import described, is_finite, require_map, require_type

PROTOCOLS: dict[str, int] = {"paper": 0, "benchmark": 15}
"""Protocol to the pixels left out on each side."""

BAD_PIXEL: dict[str, float] = {"badpix007": 0.07, "badpix003": 0.03, "badpix001": 0.01}
"""Score to its threshold: the error in pixels per view step above which a pixel is bad."""

SCORES: dict[str, str] = {
    "mse100": "MSE x100",
    "q25": "Q25 x100",
    **{name: f"BadPix {threshold} %" for name, threshold in BAD_PIXEL.items()},
}
"""Score to its name in tables."""

EDGE_SCORES: dict[str, str] = {"fattening": "fattening %", "thinning": "thinning %"}
"""Score at depth discontinuities (:mod:`sepi.scoring.regions`) to its name in tables."""

OWN_BAD_PIXEL = "badpix_"
"""Prefix of the scores for a user's thresholds."""

COUNTS: dict[str, str] = {"non_finite": "non-finite", "pixels": "pixels"}
"""Pixel count to its name in tables."""


WHOLE_MAP = "all"
"""Region name of the whole map."""

REGIONS: tuple[str, ...] = (WHOLE_MAP, "occluded", "textureless")
"""Regions of the paper's tables."""

DISCONTINUITIES = "discontinuities"
"""Region name of the pixels near depth discontinuities."""

SCORED_REGIONS: tuple[str, ...] = (*REGIONS, DISCONTINUITIES)
"""Regions scored for every scene, in addition to a scene's own masks."""


def own_bad_pixel(thresholds: Sequence[float]) -> dict[str, float]:
    """Score to threshold as in :data:`BAD_PIXEL`, for thresholds that are not in it.

    Raises
    ------
    SepiError
        If a threshold is not a number above 0.
    """
    for one in thresholds:
        if not (is_finite(one) and one > 0):
            raise SepiError(f"thresholds: expected numbers above 0 in pixels per view step, got {described(one)}")
    return {f"{OWN_BAD_PIXEL}{one:.10g}": one for one in thresholds if one not in BAD_PIXEL.values()}


def score_heads(thresholds: Sequence[float] = ()) -> dict[str, str]:
    """:data:`SCORES` and the scores of a user's thresholds, to their names in tables."""
    return SCORES | {name: f"BadPix {threshold:.10g} %" for name, threshold in own_bad_pixel(thresholds).items()}


def score(
    estimate: FloatMap,
    ground_truth: FloatMap,
    border: int = 0,
    region: BoolMap | None = None,
    edges: Edges | None = None,
    thresholds: Sequence[float] = (),
    bars: ErrorBars | None = None,
) -> Scores:
    """Scores of a disparity map as in the paper (section V) and the HCI 4D light field benchmark [1]_.

    Parameters
    ----------
    estimate, ground_truth : ndarray, shape (H, W), float32
        Disparity in pixels per view step.
    border : int
        Pixels left out on each side: 0 for the paper's protocol, 15 for the benchmark's.
    region : ndarray, shape (H, W), bool, optional
        Pixels to score; default: all.
    edges : Edges, optional
        Depth discontinuities of the ground truth; computed if not given.
    thresholds : sequence of float
        Further bad-pixel thresholds in pixels per view step: 0.5 gives the score ``badpix_0.5``.
    bars : ErrorBars, optional
        Error bars of the estimate (:class:`sepi.scoring.error_bars.ErrorBars`), which are then scored too.

    Returns
    -------
    dict
        ``mse100``: 100 x mean squared error over finite estimates; ``q25``: the 25th percentile of 100 x absolute
        error, not interpolated; ``badpix007``, ``badpix003``, ``badpix001``: percentage of pixels with a larger error
        than 0.07, 0.03, 0.01, including non-finite estimates; ``fattening``, ``thinning``: see
        :func:`sepi.scoring.regions.fattening_and_thinning`; ``non_finite``, ``pixels``: counts. A score over no pixels
        is NaN. With ``bars``, also :data:`sepi.scoring.error_bars.ERROR_BAR_SCORES`.

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
    A map whose error is 0.02, except for a tenth of the pixels with -0.1:

    >>> import numpy as np
    >>> from sepi.scoring.scores import score
    >>> truth = np.zeros((10, 10), np.float32)
    >>> estimate = np.full((10, 10), 0.02, np.float32)
    >>> estimate[0] = -0.1
    >>> found = score(estimate, truth)
    >>> [round(found[name], 3) for name in ("mse100", "q25", "badpix007", "badpix001")]
    [0.136, 2.0, 10.0, 100.0]
    >>> round(score(estimate, truth, border=1)["mse100"], 3)
    0.04
    """
    require_map("estimate", estimate)
    _require_shape("ground_truth", ground_truth, estimate)
    chosen = np.isfinite(ground_truth)
    if region is not None:
        _require_shape("region", region, estimate)
        chosen = chosen & region
    inside = np.zeros(chosen.shape, bool)
    inside[border : -border or None, border : -border or None] = True
    chosen = chosen & inside
    error = np.abs(estimate[chosen].astype(np.float64) - ground_truth[chosen])
    finite = np.isfinite(error)
    quarter = float(np.sort(100 * error)[error.size // 4]) if error.size else float("nan")
    scores: Scores = {"mse100": 100 * _mean(error[finite] ** 2), "q25": quarter}
    bad_pixel = BAD_PIXEL | own_bad_pixel(thresholds)
    # written so that NaN counts as bad
    scores |= {name: 100 * _mean(~(error <= threshold)) for name, threshold in bad_pixel.items()}
    edge_scores = fattening_and_thinning(estimate, edges or edges_of(ground_truth), chosen)
    scores |= dict(zip(EDGE_SCORES, edge_scores, strict=True))
    scores |= {"non_finite": int(np.count_nonzero(~finite)), "pixels": error.size}
    return scores if bars is None else scores | bars.scores(estimate, ground_truth, chosen)


def score_regions(
    estimate: FloatMap,
    ground_truth: FloatMap,
    masks: Mapping[str, BoolMap] | None = None,
    protocols: Mapping[str, int] = PROTOCOLS,
    edges: Edges | None = None,
    within: BoolMap | None = None,
    thresholds: Sequence[float] = (),
    bars: ErrorBars | None = None,
) -> AllScores:
    """Scores of a disparity map for every protocol and region.

    Parameters
    ----------
    estimate, ground_truth : ndarray, shape (H, W), float32
        Disparity in pixels per view step.
    masks : mapping of str to ndarray, shape (H, W), bool, optional
        Masks of regions (:func:`region_masks`); without them the regions are the whole map and the discontinuities.
    protocols : mapping of str to int
        Protocol to the pixels left out on each side.
    edges : Edges, optional
        Depth discontinuities of the ground truth; computed if not given.
    within : ndarray, shape (H, W), bool, optional
        Pixels that count in every region, such as a crop's (:func:`sepi.scoring.regions.in_frame`); default: all.
    thresholds : sequence of float
        See :func:`score`.
    bars : ErrorBars, optional
        See :func:`score`.

    Returns
    -------
    dict
        Protocol (``paper``, ``benchmark``) to region (``all``, and those of ``masks``) to the scores of :func:`score`.

    Raises
    ------
    SepiError
        If shapes differ.

    Examples
    --------
    With custom regions, here the left and the right half:

    >>> import numpy as np
    >>> from sepi.scoring.scores import score_regions
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
    require_map("ground_truth", ground_truth)
    edges = edges or edges_of(ground_truth)
    regions: dict[str, BoolMap | None] = {WHOLE_MAP: None, **(masks or {DISCONTINUITIES: edges.region})}
    if within is not None:
        regions = {name: within if mask is None else within & mask for name, mask in regions.items()}
    return {
        protocol: {
            name: score(estimate, ground_truth, border, mask, edges, thresholds, bars) for name, mask in regions.items()
        }
        for protocol, border in protocols.items()
    }


def region_masks(light_field: LightField) -> dict[str, BoolMap]:
    """The regions over which maps are scored.

    Parameters
    ----------
    light_field : LightField
        With ground truth. All of its own masks are used; ``discontinuities``, and ``occluded`` and ``textureless`` if
        missing, are computed (:mod:`sepi.scoring.regions`).

    Returns
    -------
    dict of str to ndarray, shape (H, W), bool
        ``occluded``, ``textureless`` and ``discontinuities``, then the scene's others by name.

    Raises
    ------
    SepiError
        If there is no ground truth.

    Examples
    --------
    >>> from sepi.scoring.scores import region_masks
    >>> from sepi.scenes import render
    >>> masks = region_masks(render("wall", size=64, views=3))
    >>> sorted(masks)
    ['discontinuities', 'occluded', 'textureless']
    >>> masks["textureless"].shape, masks["textureless"].dtype.name
    ((64, 64), 'bool')
    """
    require_light_field(light_field)
    if light_field.ground_truth is None:
        raise SepiError(f"{light_field.name}: regions for evaluation need ground truth, but this scene has none")
    masks = dict(light_field.masks)
    if "occluded" not in masks:
        masks["occluded"] = occluded(light_field.ground_truth, light_field.baselines)
    if "textureless" not in masks:
        masks["textureless"] = textureless(light_field.reference_view)
    edges = edges_of(light_field.ground_truth).region
    found = {name: masks[name] for name in ("occluded", "textureless")} | {DISCONTINUITIES: edges}
    return found | {name: masks[name] for name in sorted(masks) if name not in (WHOLE_MAP, *found)}


def _require_shape(what: str, values: FloatMap | BoolMap, estimate: FloatMap) -> None:
    require_type(what, values, np.ndarray, "an array of shape (H, W)")
    if values.shape != estimate.shape:
        raise SepiError(f"{what} must have the estimate's shape (H, W) = {estimate.shape}, got {values.shape}")


def _mean(values: FloatMap | BoolMap) -> float:
    # the mean of an empty array would warn
    return float(np.mean(values)) if values.size else float("nan")
