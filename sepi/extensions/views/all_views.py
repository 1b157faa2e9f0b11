"""Consistent disparity maps of all views of a light field.

A few source maps cover what nearly all views see: that of the reference view, and those of the views farthest from it
in each diagonal direction, which see what is occluded in it. Each source map is warped to a view as a surface
(:mod:`sepi.matching.carried_map`). Where source maps differ, they vote: maps that show a surface vote for it, maps
that see through it to what is behind vote against it, as in the fusion of [1]_. Pixels that no map shows take the
disparity of the farther adjacent surface. Last, each view decides which side its pixels at depth steps belong to
(:mod:`sepi.boundaries.decision`), since a warped outline is only accurate to a pixel.

References
----------
.. [1] Merrell et al.: Real-Time Visibility-Based Fusion of Depth Maps. ICCV 2007. doi:10.1109/ICCV.2007.4408984
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from types import NoneType
from typing import Any, NamedTuple

import cv2
import numpy as np
import numpy.typing as npt

from sepi.kernels import all_views as kernels
from sepi.lightfield import BoolMap, FloatMap, LightField, require_light_field
from sepi.matching.carried_map import TOLERANCE, corner_disparities
from sepi.pipeline import estimate_depth
from sepi.stage import Progress, StageMaps, no_progress, part_of
from sepi.validation import require_map, require_type
from sepi.variants import Variant
from sepi.variants.built_in import DEFAULT_VARIANT

EDGE_VIEWS = 25
"""Least number of views with which each view is compared at its depth steps."""

_AT_ONCE = 8  # views made at a time; their maps are held beside the sources
_CORNERS = ((-1, -1), (-1, 1), (1, -1), (1, 1))


class Sources(NamedTuple):
    """The source maps.

    Attributes
    ----------
    disparity : ndarray, shape (N, H, W), float32
        Pixels per view step.
    told : ndarray, shape (N, H, W, 1 or 4), float32
        Confidence; with error bars also the standard deviation of the disparity, and distances of its interval's bounds
        below and above it.
    corners : ndarray, shape (N, H, W, 4), float32
        Disparity at the corners of each pixel, from :func:`sepi.matching.carried_map.corner_disparities`.
    baselines : ndarray, shape (N, 2), float64
        Baselines of the maps' views, down and across, in view steps.
    """

    disparity: FloatMap
    told: FloatMap
    corners: FloatMap
    baselines: npt.NDArray[np.float64]


ViewMaps = dict[str, npt.NDArray[Any]]
"""Maps (H, W) of one view by name: the fields of :class:`AllViews`, without error bars if the variant has none."""


@dataclass(frozen=True)
class AllViews:
    """Maps of all views.

    Attributes
    ----------
    disparity : ndarray, shape (T, S, H, W), float32
        Pixels per view step, positive nearer, like that of the reference view; NaN in missing views.
    confidence : ndarray, shape (T, S, H, W), float32
        0..1; 0 in missing views.
    extended : ndarray, shape (T, S, H, W), bool
        Pixels that no source map shows, filled with the background beside them, with confidence 0.
    sigma : ndarray, shape (T, S, H, W), float32, or None
        Standard deviation of the disparity, pixels per view step; NaN in missing views, None if the variant has no
        error bars.
    low, high : ndarray, shape (T, S, H, W), float32, or None
        Bounds of the interval of 90 %, likewise; the whole range at extended pixels.

    Examples
    --------
    A point has the same disparity in all views:

    >>> import sepi
    >>> from sepi.scenes import render
    >>> every = sepi.estimate_all_views(render("fronto_parallel", size=64, views=3))
    >>> isinstance(every, sepi.AllViews), bool(abs(every.disparity - 1).mean() < 0.01)
    (True, True)
    >>> bool(((every.low <= every.disparity) & (every.disparity <= every.high)).all())
    True
    """

    disparity: FloatMap
    confidence: FloatMap
    extended: BoolMap
    sigma: FloatMap | None = None
    low: FloatMap | None = None
    high: FloatMap | None = None


def estimate_all_views(
    light_field: LightField,
    maps: StageMaps | None = None,
    variant: str | Variant = DEFAULT_VARIANT,
    parameters: Mapping[str, Mapping[str, Any]] | None = None,
    progress: Progress = no_progress,
    memory: int | None = None,
    edge_views: int = EDGE_VIEWS,
) -> AllViews:
    """Maps of all views: disparity, confidence and error bars.

    Parameters
    ----------
    light_field : LightField
        If its disparity range is unknown, the range is estimated from the views.
    maps : StageMaps, optional
        Maps of the reference view, which stay unchanged; default: computed.
    variant : str or Variant
        As for :func:`sepi.estimate_depth`, which computes the maps of up to five views.
    parameters : mapping, optional
        As there.
    progress : callable
        Called with the fraction done.
    memory : int, optional
        Bytes, as there, without the returned maps.
    edge_views : int
        Least number of views with which each view is compared at its depth steps. With 0, outlines stay as warped,
        which takes a fraction of the time.

    Returns
    -------
    AllViews
        The maps of every view.

    Raises
    ------
    SepiError
        If ``maps`` have another shape than the views, or as for :func:`sepi.pipeline.estimate_depth`.
    MemoryError
        If a limit on the process's address space is too small.

    Examples
    --------
    >>> import sepi
    >>> from sepi.scenes import render, true_disparity
    >>> light_field = render("slanted_plane", size=64, views=3)
    >>> maps = sepi.estimate_depth(light_field)
    >>> every = sepi.estimate_all_views(light_field, maps)
    >>> every.disparity.shape, bool((every.disparity[1, 1] == maps.disparity).all())
    ((3, 3, 64, 64), True)
    >>> corner = true_disparity("slanted_plane", size=64, baseline=(-1, -1))
    >>> bool(abs(every.disparity[0, 0] - corner).mean() < 0.02)
    True
    """
    require_light_field(light_field)
    require_type(f"{light_field.name}: maps", maps, (StageMaps, NoneType), "StageMaps")
    shape = (*light_field.grid, *light_field.shape)
    result: dict[str, npt.NDArray[Any]] = {}
    for position, view in maps_of_all_views(light_field, maps, variant, parameters, progress, memory, edge_views):
        for name, values in view.items():
            if name not in result:
                missing = 0 if name in ("confidence", "extended") else np.nan
                result[name] = np.full(shape, missing, values.dtype)
            result[name][position] = values
    return AllViews(**result)


def maps_of_all_views(
    light_field: LightField,
    maps: StageMaps | None = None,
    variant: str | Variant = DEFAULT_VARIANT,
    parameters: Mapping[str, Mapping[str, Any]] | None = None,
    progress: Progress = no_progress,
    memory: int | None = None,
    edge_views: int = EDGE_VIEWS,
) -> Iterator[tuple[tuple[int, int], ViewMaps]]:
    """The maps of one view after the other, row by row of the grid, without missing views.

    Arguments and errors are those of :func:`estimate_all_views`. Only a few views' maps are in memory at a time.

    Yields
    ------
    position : (int, int)
        Row and column of the view in the grid.
    maps : dict of str to ndarray, shape (H, W)
        Its :data:`ViewMaps`.
    """
    if maps is not None:
        require_map(f"{light_field.name}: maps", maps.disparity, light_field.shape)
    if light_field.disparity_range is None:
        from sepi.inspection.disparity_range import estimate_range

        # once, so that all maps have the same range
        light_field = light_field.with_range(estimate_range(light_field))
    anchors = anchor_views(light_field)
    places = np.argwhere(light_field.present)
    # a view's share takes about a tenth of an estimate
    total = len(anchors) + 0.1 * len(places)
    found = []
    for number, position in enumerate(anchors):
        of_all = part_of(progress, number, total)
        known = maps if number == 0 else None
        found.append(known or estimate_depth(light_field.seen_from(position), variant, parameters, of_all, memory))
        of_all(1.0)
    sources = _sources(found, np.array([light_field.baselines[position] for position in anchors]))
    # frees the other views' maps
    reference = found[0]
    del found
    for number, ((t, s), view) in enumerate(_fused(light_field, sources, places), 1):
        if (t, s) == light_field.reference_position:
            yield (t, s), {name: getattr(reference, name, values) for name, values in view.items()}
        else:
            decided = _with_own_edges(light_field.seen_from((t, s)), view["disparity"], edge_views)
            yield (t, s), _with_doubt(light_field, view, decided)
        progress((len(anchors) + 0.1 * number) / total)


def anchor_views(light_field: LightField) -> list[tuple[int, int]]:
    """The views of the source maps: the reference view, and the farthest in each diagonal direction.

    Parameters
    ----------
    light_field : LightField

    Returns
    -------
    list of (int, int)
        Rows and columns in the grid, the reference view first; five of a whole grid, three of one row of views.
    """
    places, baselines = np.argwhere(light_field.present), light_field.baselines[light_field.present]
    farthest = [places[np.argmax(baselines @ corner)] for corner in _CORNERS]
    found = [light_field.reference_position, *((int(t), int(s)) for t, s in farthest)]
    return list(dict.fromkeys(found))


def _sources(found: list[StageMaps], baselines: npt.NDArray[np.float64]) -> Sources:
    """The source maps, with the surfaces of their pixels."""
    told = []
    for maps in found:
        # error bars of all maps, or of none
        if maps.sigma is None or maps.low is None or maps.high is None:
            told = [maps.confidence[..., None] for maps in found]
            break
        # distances of the bounds hold in other views, too; an unknown disparity may lie beyond both
        below, above = np.maximum(maps.disparity - maps.low, 0), np.maximum(maps.high - maps.disparity, 0)
        told.append(np.stack([maps.confidence, maps.sigma, below, above], axis=2))
    disparities = [maps.disparity for maps in found]
    parts = disparities, told, list(map(corner_disparities, disparities))
    disparity, of_all, corners = (np.stack(part, dtype=np.float32) for part in parts)
    return Sources(disparity, of_all, corners, baselines)


def _fused(
    light_field: LightField, sources: Sources, places: npt.NDArray[np.int64]
) -> Iterator[tuple[tuple[int, int], ViewMaps]]:
    """Positions and maps of views, fused from the source maps, some at a time."""
    for some in np.split(places, range(_AT_ONCE, len(places), _AT_ONCE)):
        shape = (len(some), *light_field.shape)
        disparity, extended = np.empty(shape, np.float32), np.empty(shape, bool)
        told = np.empty((*shape, sources.told.shape[3]), np.float32)
        baselines = np.ascontiguousarray(light_field.baselines[tuple(some.T)])
        kernels.maps_of_views(sources, baselines, disparity, told, extended)
        for (t, s), at, own, beyond in zip(some.tolist(), disparity, told, extended, strict=True):
            sure, *bars = np.moveaxis(own, 2, 0)
            of_view = {"sigma": bars[0], "low": at - bars[1], "high": at + bars[2]} if bars else {}
            yield (t, s), {"disparity": at, "confidence": np.ascontiguousarray(sure), "extended": beyond, **of_view}


def _with_doubt(light_field: LightField, view: ViewMaps, decided: FloatMap) -> ViewMaps:
    """A view's maps with the decided disparity, and error bars that allow for changes and extended background."""
    if "sigma" not in view:
        return view | {"disparity": decided}
    # a pixel that changed sides may belong to either surface
    moved, anywhere = decided - view["disparity"], view["extended"]
    # extended and unknown pixels may have any disparity
    lowest, highest = light_field.require_disparity_range().candidates(2)
    sigma = np.where(anywhere, np.float32((highest - lowest) / 12**0.5), np.hypot(view["sigma"], moved / 2))
    low = np.where(anywhere, np.minimum(lowest, decided), view["low"] + np.minimum(moved, 0))
    high = np.where(anywhere, np.maximum(highest, decided), view["high"] + np.maximum(moved, 0))
    return view | {"disparity": decided, "sigma": sigma, "low": low, "high": high}


def _with_own_edges(own: LightField, disparity: FloatMap, edge_views: int) -> FloatMap:
    """Disparity of a light field's reference view, its pixels at depth steps on the surface that fills most of them."""
    if edge_views == 0:
        return disparity
    from sepi.boundaries.decision import assigned_to_surfaces
    from sepi.boundaries.parameters import BoundaryParameters

    parameters = BoundaryParameters(share_views=edge_views)
    decided = assigned_to_surfaces(own, disparity, parameters)
    # a steep slope is not a step, and its pixels stay on their surface
    beside = np.ones((2 * parameters.share_radius + 1,) * 2, np.uint8)
    return np.where(cv2.dilate(torn_pixels(disparity).astype(np.uint8), beside) > 0, decided, disparity)


def torn_pixels(disparity: FloatMap) -> BoolMap:
    """Pixels beside a depth step that slopes do not explain; shape (H, W), bool."""
    corners, torn = corner_disparities(disparity), np.zeros(disparity.shape, bool)
    # numbers of corners that pixels side by side share, then pixels one above the other
    beside, below = ((1, 0), (2, 3)), ((3, 0), (2, 1))
    for of_pixel, lines, pairs in ((corners, torn, beside), (corners.swapaxes(0, 1), torn.T, below)):
        for here, there in pairs:
            apart = np.abs(of_pixel[:, :-1, here] - of_pixel[:, 1:, there]) > TOLERANCE
            lines[:, :-1] |= apart
            lines[:, 1:] |= apart
    return torn
