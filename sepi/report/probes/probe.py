"""What the method sees at one pixel: SEPIs, cost curves over the candidates, occlusion side (figures 1, 3, 4 of [1]_).

References
----------
.. [1] Zhou, Shi, Liu, Jin, Zhang, Hou: Light Field Depth Estimation via Stitched Epipolar Plane Images.
"""

from __future__ import annotations

import base64
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt

from sepi.errors import SepiError
from sepi.lightfield import BoolMap, FloatMap, LightField
from sepi.matching.plane_sweep import SweepParameters
from sepi.matching.stitched_epi import stitched_epi
from sepi.matching.view_subsets import halves_and_quarters
from sepi.report.plots.contrast import contrast_of, stretched
from sepi.report.plots.pictures import Picture, as_rgb, picture_uri
from sepi.report.probes.curves import Curves, cost_curves, require_inside
from sepi.stage import StageMaps

GREY = 128
"""Value of all channels where a picture shows nothing: outside the view, or no such view."""

HALF_WIDTH = 24
"""Pixels that a SEPI picture shows on each side of the line."""

CROP_RADIUS = 40
"""Pixels of the reference view that a probe keeps on each side of its pixel."""

WEBP_QUALITY = 60
"""Of the SEPI pictures in a page."""


@dataclass(frozen=True)
class SepiPicture:
    """A SEPI cut out around the pixel's line.

    Attributes
    ----------
    pixels : ndarray, shape (T * S, 2 half_width + 1, 3), uint8
        A row per view, ordered by ``t``, then ``s``; grey where a view has no sample.
    inside : ndarray, shape (T * S, 2 half_width + 1), bool
        Where the views have samples.
    line : ndarray, shape (T * S,), float64
        Column of the candidate's line in each row; may lie outside the picture where it is not sheared.
    disparity : float
        Candidate, pixels per view step.
    """

    pixels: Picture
    inside: BoolMap
    line: npt.NDArray[np.float64]
    disparity: float


@dataclass(frozen=True)
class Probe:
    """What there is to show of one pixel; all disparities in pixels per view step.

    Attributes
    ----------
    y, x : int
        Pixel of the reference view.
    label : str
        Why it was chosen; may be empty.
    curves : Curves
    chosen : float
        Disparity in the final map.
    minimum : float
        Disparity at the lowest cost over all views: what the initial stage sees.
    best_subset : str
        Subset of the views with the lowest cost of all, whether or not it was kept.
    side : str
        Subset of the views that the occlusion stage kept; ``full`` where it kept all, or did not run.
    kept : ndarray, shape (T, S), bool
        Views of ``side`` that are present.
    best : float or None
        Disparity in the final map of the most accurate variant, if it was given.
    ground_truth : float or None
        None where it is unknown.
    confidence : float
        Of the final map, 0..1.
    occluded, textureless : bool
        What the stages took the pixel for.
    pictures : mapping of str to SepiPicture
        SEPIs at ``minimum``, ``chosen``, ``wrong`` (the candidate of the highest cost over all views) and, where it is
        known, ``ground_truth``.
    patch : ndarray, shape (T, S, 3), uint8
        The sample of each view at the chosen disparity (angular patch); grey where there is none.
    crop : ndarray, shape (h, w, 3), uint8
        Surroundings of the pixel in the reference view.
    crop_origin : tuple of int
        Row and column of the reference view at which ``crop`` begins.
    """

    y: int
    x: int
    label: str
    curves: Curves
    chosen: float
    minimum: float
    best_subset: str
    side: str
    kept: BoolMap
    best: float | None
    ground_truth: float | None
    confidence: float
    occluded: bool
    textureless: bool
    pictures: Mapping[str, SepiPicture]
    patch: Picture
    crop: Picture
    crop_origin: tuple[int, int]

    @property
    def contrast(self) -> tuple[float, float]:
        """Brightness in all SEPIs that is best drawn black, and white."""
        return contrast_of([(picture.pixels, picture.inside) for picture in self.pictures.values()])

    @property
    def patch_inside(self) -> BoolMap:
        """Where the angular patch has a sample, (T, S)."""
        inside = self.pictures["chosen"].inside
        return inside[:, inside.shape[1] // 2].reshape(self.kept.shape)


def sepi_picture(
    light_field: LightField, y: int, x: int, disparity: float, *, half_width: int = HALF_WIDTH, sheared: bool = True
) -> SepiPicture:
    """The SEPI of a pixel for one candidate, cut out around the pixel's column.

    Parameters
    ----------
    light_field : LightField
    y, x : int
        Pixel of the reference view.
    disparity : float
        Candidate, pixels per view step; finite.
    half_width : int
        Pixels on each side of column ``x``.
    sheared : bool
        Whether each row is moved so that the candidate's line stands upright in the middle column: the right candidate
        shows upright stripes, a wrong one a saw-tooth, a tooth for each row of views. Otherwise the picture is that of
        Eq. 1-2, whose line has the candidate's slope.

    Returns
    -------
    SepiPicture

    Raises
    ------
    SepiError
        If the pixel lies outside the reference view or the disparity is not finite.
    """
    require_inside(light_field, y, x)
    if not math.isfinite(disparity):
        raise SepiError(f"{light_field.name}: a SEPI needs a finite disparity, got {disparity:g}")
    sepi = stitched_epi(light_field, y, disparity)
    upright = -disparity * sepi.steps
    columns = x + np.arange(-half_width, half_width + 1)
    position = columns + (upright if sheared else np.zeros_like(upright))[:, None] - sepi.offsets[:, None]
    width = sepi.rows.shape[1]
    inside = sepi.inside[:, None] & (position >= 0) & (position <= width - 1)
    # far outside, whole numbers would overflow
    position = np.clip(position, 0, width - 1)
    left = np.minimum(np.floor(position).astype(np.int64), width - 2)
    weight = (position - left).astype(np.float32)[:, :, None]
    number = np.arange(len(sepi.rows))[:, None]
    samples = (1 - weight) * sepi.rows[number, left] + weight * sepi.rows[number, left + 1]
    pixels = np.where(inside[:, :, None], as_rgb(samples), np.uint8(GREY))
    line = half_width + (np.zeros_like(upright) if sheared else upright)
    return SepiPicture(pixels, inside, line, float(disparity))


def probe(
    light_field: LightField,
    y: int,
    x: int,
    *,
    maps: StageMaps,
    parameters: SweepParameters,
    best: StageMaps | None = None,
    label: str = "",
    noise: float | None = None,
    half_width: int = HALF_WIDTH,
) -> Probe:
    """Everything there is to show of one pixel.

    Parameters
    ----------
    light_field : LightField
        With a known disparity range.
    y, x : int
        Pixel of the reference view.
    maps : StageMaps
        Final maps of a variant whose occlusion stage is ``half_sepi`` or ``none``: others number the sides otherwise.
    parameters : SweepParameters
        Of its initial or occlusion stage.
    best : StageMaps, optional
        Final maps of the most accurate variant.
    label : str
        Why the pixel was chosen.
    noise : float, optional
        ``residual_variance(light_field.reference_view)``; computed unless given.
    half_width : int
        Of the SEPI pictures, pixels.

    Returns
    -------
    Probe

    Raises
    ------
    SepiError
        If the pixel lies outside the reference view, the disparity range is unknown, the final disparity is not
        finite there, or the subsets of the views are not those of the half-SEPI.
    """
    curves = cost_curves(light_field, y, x, parameters, noise=noise)
    views = halves_and_quarters(light_field.grid, light_field.reference_position)
    kept_subset = int(maps.extra["view_subset"][y, x]) if "view_subset" in maps.extra else 0
    if maps.subset_names and maps.subset_names != views.names:
        raise SepiError(
            f"{light_field.name}: the subsets of the views are {', '.join(maps.subset_names[:3])}, ...; "
            f"expected those of half_sepi, {', '.join(views.names[:3])}, ..."
        )
    ground_truth = None if light_field.ground_truth is None else _finite(light_field.ground_truth[y, x])
    minimum, _ = curves.minimum()
    shown = {
        "minimum": minimum,
        "chosen": float(maps.disparity[y, x]),
        "wrong": float(curves.disparities[curves.costs[0].argmax()]),
        "ground_truth": ground_truth,
    }
    pictures = {
        name: sepi_picture(light_field, y, x, disparity, half_width=half_width)
        for name, disparity in shown.items()
        if disparity is not None
    }
    top, left = max(0, y - CROP_RADIUS), max(0, x - CROP_RADIUS)
    around = light_field.reference_view[top : y + CROP_RADIUS + 1, left : x + CROP_RADIUS + 1]
    return Probe(
        y=y,
        x=x,
        label=label,
        curves=curves,
        chosen=float(maps.disparity[y, x]),
        minimum=minimum,
        best_subset=curves.best_subset(),
        side=views.names[kept_subset],
        kept=views.subsets[kept_subset][views.groups] & light_field.present,
        best=None if best is None else _finite(best.disparity[y, x]),
        ground_truth=ground_truth,
        confidence=float(maps.confidence[y, x]),
        occluded=bool(maps.mask("occluded")[y, x]),
        textureless=bool(maps.mask("textureless")[y, x]),
        pictures=pictures,
        patch=pictures["chosen"].pixels[:, half_width].reshape(*light_field.grid, 3),
        crop=as_rgb(around),
        crop_origin=(top, left),
    )


def to_json(found: Probe) -> dict[str, Any]:
    """A probe for a page, compact.

    Returns
    -------
    dict
        The fields of :class:`Probe` but for the crop. ``range`` is the first and last candidate; ``costs`` maps the
        names of the subsets to base64 of little-endian uint16, ``65535 * cost`` of each candidate; ``kept`` has a
        character per view, ``1`` or ``0``; ``sepi`` maps the names of the pictures to their ``disparity`` and ``src``,
        a data URI (WebP), whose middle column is the line; ``patch`` is a data URI (PNG) of a pixel per view; both have
        more contrast than the views. Unknown values are None.
    """
    curves, limits = found.curves, found.contrast
    return {
        "y": found.y,
        "x": found.x,
        "label": found.label,
        "range": [_short(curves.disparities[0]), _short(curves.disparities[-1])],
        "costs": {name: _base64(cost) for name, cost in zip(curves.names, _quantised(curves.costs), strict=True)},
        "chosen": _short(found.chosen),
        "minimum": _short(found.minimum),
        "best_subset": found.best_subset,
        "side": found.side,
        "kept": "".join("01"[int(view)] for view in found.kept.ravel()),
        "best": _short(found.best),
        "ground_truth": _short(found.ground_truth),
        "confidence": _short(found.confidence),
        "occluded": found.occluded,
        "textureless": found.textureless,
        "sepi": {
            name: {
                "disparity": _short(picture.disparity),
                "src": picture_uri(
                    stretched(picture.pixels, picture.inside, limits), "webp", [cv2.IMWRITE_WEBP_QUALITY, WEBP_QUALITY]
                ),
            }
            for name, picture in found.pictures.items()
        },
        "patch": picture_uri(
            stretched(found.patch, found.patch_inside, limits), "png", [cv2.IMWRITE_PNG_COMPRESSION, 9]
        ),
    }


def _finite(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None


def _short(value: float | None) -> float | None:
    """To four decimals, finer than any of the values is known; None where it is not a number."""
    return None if value is None or not math.isfinite(value) else round(float(value), 4)


def _quantised(costs: FloatMap) -> npt.NDArray[np.uint16]:
    return np.rint(65535 * np.clip(costs.astype(np.float64), 0, 1)).astype("<u2")


def _base64(values: npt.NDArray[Any]) -> str:
    return base64.b64encode(values.tobytes()).decode()
