"""Data of the method at one pixel: SEPIs, cost curves over the candidates, views kept (figures 1, 3, 4 of [1]_).

References
----------
.. [1] Zhou, Shi, Liu, Jin, Zhang, Hou: Light Field Depth Estimation via Stitched Epipolar Plane Images.
"""

import base64
import math
from typing import Any

import cv2
import numpy as np

from sepi.errors import SepiError
from sepi.extensions.page.curves import cost_curves
from sepi.extensions.page.pixels import InterestingPixel, kept_subsets
from sepi.lightfield import LightField
from sepi.matching.plane_sweep import SweepParameters
from sepi.matching.stitched_epi import stitched_epi
from sepi.matching.view_subsets import halves_and_quarters
from sepi.report.pictures import as_rgb, contrast_of, picture_uri, stretched
from sepi.stage import StageMaps

GREY = 128
"""Value of all channels where a picture has no sample: outside the view, or of a missing view."""

HALF_WIDTH = 24
"""Pixels of a SEPI picture on each side of the line."""

# quality of the SEPI pictures on a page
_WEBP = [cv2.IMWRITE_WEBP_QUALITY, 60]
_PNG = [cv2.IMWRITE_PNG_COMPRESSION, 9]


class SepiPicture:
    """The SEPI of a pixel (Eq. 1-2 of [1]_) around its column, sheared so that a candidate's line is upright.

    The line is in the middle. The right candidate shows upright stripes, a wrong one a saw-tooth with a tooth for each
    row of views.

    Parameters
    ----------
    light_field : LightField
    y, x : int
        Pixel of the reference view.
    disparity : float
        Candidate, pixels per view step; finite.

    Attributes
    ----------
    pixels : ndarray, shape (T * S, 2 HALF_WIDTH + 1, 3), uint8
        A row per view, ordered by ``t``, then ``s``; grey where a view has no sample.
    inside : ndarray, shape (T * S, 2 HALF_WIDTH + 1), bool
        Where the views have samples.
    disparity : float
        As given.

    Raises
    ------
    SepiError
        If the disparity is not finite.
    """

    def __init__(self, light_field: LightField, y: int, x: int, disparity: float) -> None:
        sepi = stitched_epi(light_field, y, disparity)
        lines = [sepi.along_line(column) for column in range(x - HALF_WIDTH, x + HALF_WIDTH + 1)]
        samples, self.inside = (np.stack(of_lines, axis=1) for of_lines in zip(*lines, strict=True))
        self.pixels = np.where(self.inside[:, :, None], as_rgb(samples), np.uint8(GREY))
        self.disparity = float(disparity)


class Probe:
    """Data of one pixel to show; all disparities in pixels per view step.

    Parameters
    ----------
    light_field : LightField
        With a known disparity range.
    pixel : InterestingPixel
        Pixel of the reference view.
    maps : StageMaps
        Final maps of a variant whose occlusion stage is ``half_sepi`` or ``none``.
    parameters : SweepParameters
        Parameters of its initial or occlusion stage.
    best : StageMaps or None
        Final maps of the most accurate variant.

    Attributes
    ----------
    pixel : InterestingPixel
        Pixel of the reference view, and why it was chosen.
    curves : Curves
    chosen : float
        Disparity in the final map.
    kept_subset : str
        Subset of the views that the occlusion stage kept; ``full`` if it kept all, or did not run.
    kept : ndarray, shape (T, S), bool
        Views of that subset that are present.
    best : float or None
        Disparity in the final map of the most accurate variant, if given.
    interval : (float, float) or None
        Interval of that variant's error bars, which holds the disparity with a probability of 90 %, if it has some.
    ground_truth : float or None
        None if unknown.
    confidence : float
        Confidence of the final map, 0..1.
    occluded, textureless : bool
        Values of the stages' masks.
    pictures : dict of str to SepiPicture
        SEPIs at ``minimum`` (lowest cost over all views, as in the initial stage), ``chosen``, ``wrong`` (highest cost
        over all views) and, if known, ``ground_truth``.
    stretched : dict of str to ndarray, shape (T * S, 2 HALF_WIDTH + 1, 3), uint8
        The SEPIs with stretched contrast, the same in all.
    patch : ndarray, shape (T, S, 3), uint8
        Angular patch: the sample of each view at the chosen disparity, with stretched contrast.

    Raises
    ------
    SepiError
        If the pixel lies outside the reference view, the disparity range is unknown, the final disparity is not
        finite there, or the subsets of the views are not those of the half-SEPI.
    """

    def __init__(
        self,
        light_field: LightField,
        pixel: InterestingPixel,
        maps: StageMaps,
        parameters: SweepParameters,
        best: StageMaps | None,
    ) -> None:
        self.pixel, (y, x, _) = pixel, pixel
        self.curves, views = cost_curves(light_field, y, x, parameters), halves_and_quarters(light_field)
        number = int(kept_subsets(maps)[y, x])
        if maps.subset_names and maps.subset_names != views.names:
            raise SepiError(
                f"{light_field.name}: the subsets of the views are {', '.join(maps.subset_names[:3])}, ...; "
                f"expected those of half_sepi, {', '.join(views.names[:3])}, ..."
            )
        self.kept_subset, self.kept = views.names[number], views.subsets[number][views.groups] & light_field.present
        self.chosen, self.confidence = float(maps.disparity[y, x]), float(maps.confidence[y, x])
        self.occluded, self.textureless = (bool(maps.mask(name)[y, x]) for name in ("occluded", "textureless"))
        self.best = None if best is None else _finite(best.disparity[y, x])
        self.interval: tuple[float, float] | None = None
        if best is not None and best.low is not None and best.high is not None:
            self.interval = float(best.low[y, x]), float(best.high[y, x])
        truth = light_field.ground_truth
        self.ground_truth = None if truth is None else _finite(truth[y, x])
        shown = {
            "minimum": self.curves.minimum()[0],
            "chosen": self.chosen,
            "wrong": float(self.curves.disparities[self.curves.costs[0].argmax()]),
            "ground_truth": self.ground_truth,
        }
        self.pictures = {name: SepiPicture(light_field, y, x, at) for name, at in shown.items() if at is not None}
        limits = contrast_of([(picture.pixels, picture.inside) for picture in self.pictures.values()])
        self.stretched = {name: stretched(one.pixels, one.inside, limits) for name, one in self.pictures.items()}
        self.patch = self.stretched["chosen"][:, HALF_WIDTH].reshape(*self.kept.shape, 3)


def to_json(found: Probe) -> dict[str, Any]:
    """A probe as compact JSON for a page.

    Returns
    -------
    dict
        The fields of :class:`Probe`, and ``best_subset``, the subset of lowest cost, kept or not.
        ``range`` is the first and last candidate; ``costs`` maps the names of the subsets to base64 of little-endian
        uint16, ``65535 * cost`` of each candidate; ``kept`` has a character per view, ``1`` or ``0``; ``sepi`` maps
        the names of the pictures to their ``disparity`` and ``src``, a data URI (WebP), whose middle column is the
        line; ``patch`` is a data URI (PNG) of a pixel per view. Unknown values are None.
    """
    curves, sources = found.curves, found.stretched
    costs = np.rint(65535 * np.clip(curves.costs.astype(np.float64), 0, 1)).astype("<u2")
    packed = (base64.b64encode(cost.tobytes()).decode() for cost in costs)
    return {
        **found.pixel._asdict(),
        "range": [_short(curves.disparities[0]), _short(curves.disparities[-1])],
        "costs": dict(zip(curves.names, packed, strict=True)),
        "minimum": _short(curves.minimum()[0]),
        "best_subset": curves.best_subset(),
        **{name: _short(getattr(found, name)) for name in ("chosen", "best", "ground_truth", "confidence")},
        **{name: getattr(found, name) for name in ("kept_subset", "occluded", "textureless")},
        "kept": "".join("01"[int(view)] for view in found.kept.ravel()),
        "interval": found.interval and [_short(end) for end in found.interval],
        "sepi": {
            name: {"disparity": _short(picture.disparity), "src": picture_uri(sources[name], "webp", _WEBP)}
            for name, picture in found.pictures.items()
        },
        "patch": picture_uri(found.patch, "png", _PNG),
    }


def _finite(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None


def _short(value: float | None) -> float | None:
    """A value with seven decimals; None if it is not finite.

    The page shows three. With four here, double rounding would differ from the tables.
    """
    return None if value is None or not math.isfinite(value) else round(float(value), 7)
