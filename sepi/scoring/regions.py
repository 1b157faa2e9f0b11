"""What is scored: occluded and textureless pixels, depth discontinuities, and crops in the frame of the whole image.

The paper cites another work for its occluded region and does not define its textureless one. These definitions are the
same for all scenes and methods, so that rows of a table are comparable. Estimators never see them.

The region of discontinuities and the two measures of it follow the idea of the HCI 4D light field benchmark's [1]_
measures for discontinuities and fine structures, but are defined from the ground truth alone.

References
----------
.. [1] Honauer et al.: A dataset and evaluation methodology for depth estimation on 4D light fields. ACCV 2016.
   doi:10.1007/978-3-319-54187-7_2
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from sepi.camera import require_part
from sepi.kernels import regions as kernels
from sepi.lightfield import BoolMap, FloatMap
from sepi.validation import require_map, require_type

WINDOW = 7
"""Side in pixels of the window over which gradient energy is averaged."""

ENERGY_THRESHOLD = 0.005
"""RMS gradient below which a pixel is textureless, as a fraction of the full range per pixel (1.3 of 255 steps)."""

MIN_AREA = 225
"""Pixels: smaller patches are dropped and smaller holes filled (one superpixel of the paper, 15 x 15)."""


def occluded(ground_truth: FloatMap, baselines: npt.NDArray[np.float64]) -> BoolMap:
    """Pixels of the reference view that are hidden in at least one other view.

    A pixel is hidden in a view if a nearer pixel is projected to within half a pixel of it, as in a z-buffer. A buffer
    on the view's pixel grid would round positions and mark slanted planes as hidden by themselves; therefore the line
    of sight is followed through the disparity map. The nearer pixel ``q`` that hides ``p`` in the view of baseline
    ``v`` lies at ``q = p + (d(q) - d(p)) v``, so a search along ``v`` in steps of one pixel finds its exact position. A
    surface whose slope times the largest baseline is below one half (0.125 of disparity per pixel for 9 x 9 views)
    never hides itself.

    Parameters
    ----------
    ground_truth : ndarray, shape (H, W), float32
        Disparity in pixels per view step; non-finite pixels neither hide others nor are hidden.
    baselines : ndarray, shape (T, S, 2), float64
        Row and column offset from the reference view in view steps; zero for missing views.

    Returns
    -------
    ndarray, shape (H, W), bool
        A pixel that falls outside a view counts as seen by it.

    Examples
    --------
    A bar in front of a plane hides a strip of it in the view to the right:

    >>> import numpy as np
    >>> from sepi.scoring.regions import occluded
    >>> disparity = np.zeros((5, 12), np.float32)
    >>> disparity[:, 6:9] = 2
    >>> baselines = np.array([[(0, 0), (0, 1)]], float)
    >>> occluded(disparity, baselines)[0].astype(int).tolist()
    [0, 0, 0, 0, 1, 1, 0, 0, 0, 0, 0, 0]
    """
    require_map("ground truth", ground_truth)
    reach = np.abs(baselines).max(axis=2).ravel()
    # distant views hide most: testing them first ends the search early; views at the reference position hide nothing
    order = np.argsort(-reach, kind="stable")[: np.count_nonzero(reach)]
    finite = np.isfinite(ground_truth)
    hidden = np.zeros(ground_truth.shape, bool)
    if finite.any():
        filled = np.where(finite, ground_truth, -np.inf).astype(np.float64)
        kernels.occluded(filled, baselines.reshape(-1, 2)[order], ground_truth[finite].max(), hidden)
    return hidden


def textureless(reference_view: FloatMap) -> BoolMap:
    """Pixels of the reference view with almost no image gradient around them.

    The energy is the squared gradient, averaged over the channels and a window of ``WINDOW`` pixels; its root is
    compared with ``ENERGY_THRESHOLD`` (0.005 of the full range per pixel). Patches and holes smaller than ``MIN_AREA``
    (225 pixels) are removed.

    Parameters
    ----------
    reference_view : ndarray, shape (H, W, 3), float32
        Values in 0..1.

    Returns
    -------
    ndarray, shape (H, W), bool

    Examples
    --------
    >>> import numpy as np
    >>> from sepi.scoring.regions import textureless
    >>> view = np.full((64, 64, 3), 0.5, np.float32)
    >>> view[:, 32:] += np.random.default_rng(0).normal(0, 0.1, (64, 32, 3)).astype(np.float32)
    >>> flat = textureless(view)
    >>> bool(flat[:, :28].all()), bool(flat[:, 32:].any())
    (True, False)
    """
    require_type("reference view", reference_view, np.ndarray, "an array of shape (H, W, C)")
    energy = np.zeros(reference_view.shape[:2], np.float32)
    for channel in range(reference_view.shape[2]):
        plane = np.ascontiguousarray(reference_view[:, :, channel], np.float32)
        # the Scharr kernel's response to a unit gradient is 32
        for dx, dy in ((1, 0), (0, 1)):
            energy += np.square(cv2.Scharr(plane, cv2.CV_32F, dx, dy) / 32)
    energy = cv2.blur(energy / reference_view.shape[2], (WINDOW, WINDOW))
    flat = _without_small(energy < ENERGY_THRESHOLD**2)
    return ~_without_small(~flat)


def _without_small(mask: BoolMap) -> BoolMap:
    # slow to import, and tables do not need it
    from scipy import ndimage

    labels, _ = ndimage.label(mask)
    large = np.bincount(labels.ravel()) >= MIN_AREA
    large[0] = False
    kept: BoolMap = large[labels]
    return kept


LEAST_DISCONTINUITY = 0.125
"""Minimum difference of neighbours in pixels per view step; half a pixel in the outermost of 9 x 9 views."""

REACH = 2
"""Width in pixels of the region on each side of a depth discontinuity."""


@dataclass(frozen=True)
class Edges:
    """Ground truth of the pixels near depth discontinuities.

    Attributes
    ----------
    region : ndarray, shape (H, W), bool
        Pixels within ``REACH`` of a depth discontinuity.
    middle : ndarray, shape (H, W), float32
        In the region, the disparity half way between the nearest and the most distant surface within ``REACH``.
    foreground : ndarray, shape (H, W), bool
        Pixels of the region that are nearer than ``middle``; its other pixels with ground truth are background.

    Examples
    --------
    >>> from sepi.scenes import render
    >>> from sepi.scoring.regions import Edges, edges_of
    >>> edges = edges_of(render("fronto_parallel", size=64, views=2).ground_truth)
    >>> isinstance(edges, Edges), int(edges.region.sum())  # one plane has no discontinuity
    (True, 0)
    """

    region: BoolMap
    middle: FloatMap
    foreground: BoolMap


def edges_of(ground_truth: FloatMap) -> Edges:
    """The depth discontinuities of a disparity map.

    Parameters
    ----------
    ground_truth : ndarray, shape (H, W), float32
        Disparity in pixels per view step. Non-finite pixels neither form discontinuities nor belong to the region.

    Returns
    -------
    Edges

    Examples
    --------
    >>> import numpy as np
    >>> from sepi.scoring.regions import edges_of
    >>> truth = np.zeros((3, 8), np.float32)
    >>> truth[:, 4:] = 1
    >>> edges = edges_of(truth)
    >>> edges.region[0].astype(int).tolist(), edges.foreground[0].astype(int).tolist()
    ([0, 0, 1, 1, 1, 1, 0, 0], [0, 0, 0, 0, 1, 1, 0, 0])
    >>> edges.middle[0, 2:6].tolist()
    [0.5, 0.5, 0.5, 0.5]
    """
    require_map("ground truth", ground_truth)
    from scipy import ndimage

    known = np.isfinite(ground_truth)
    beside = np.zeros(ground_truth.shape, bool)
    for axis in (0, 1):
        values, marked = np.moveaxis(ground_truth, axis, 0), np.moveaxis(beside, axis, 0)
        both = np.isfinite(values[1:]) & np.isfinite(values[:-1])
        apart = np.abs(np.subtract(values[1:], values[:-1], out=np.zeros_like(values[1:]), where=both))
        marked[1:] |= apart > LEAST_DISCONTINUITY
        marked[:-1] |= apart > LEAST_DISCONTINUITY
    region = ndimage.binary_dilation(beside, np.ones((3, 3), bool), REACH - 1) & known
    side = 2 * REACH + 1
    nearest = ndimage.maximum_filter(np.where(known, ground_truth, -np.inf), side, mode="nearest")
    farthest = ndimage.minimum_filter(np.where(known, ground_truth, np.inf), side, mode="nearest")
    middle = np.full(ground_truth.shape, np.nan, np.float32)
    middle[region] = (nearest[region] + farthest[region]) / 2
    return Edges(region, middle, region & (ground_truth > middle))


def fattening_and_thinning(estimate: FloatMap, edges: Edges, chosen: BoolMap) -> tuple[float, float]:
    """How often an estimate is on the wrong side of a depth discontinuity.

    Parameters
    ----------
    estimate : ndarray, shape (H, W), float32
        Disparity in pixels per view step; NaN counts for neither side.
    edges : Edges
        Depth discontinuities of the ground truth.
    chosen : ndarray, shape (H, W), bool
        Pixels to score.

    Returns
    -------
    fattening : float
        Percentage of background pixels whose estimate is nearer than the middle; NaN without background.
    thinning : float
        Percentage of foreground pixels whose estimate is more distant than it; NaN without foreground.

    Examples
    --------
    The estimated edge is one pixel too far out: half of the background in the region is fattened.

    >>> import numpy as np
    >>> from sepi.scoring.regions import edges_of, fattening_and_thinning
    >>> truth = np.zeros((3, 8), np.float32)
    >>> truth[:, 4:] = 1
    >>> estimate = np.zeros((3, 8), np.float32)
    >>> estimate[:, 3:] = 1
    >>> fattening_and_thinning(estimate, edges_of(truth), np.ones(truth.shape, bool))
    (50.0, 0.0)
    """
    behind = chosen & edges.region & ~edges.foreground
    before = chosen & edges.foreground
    return _percentage(estimate[behind] > edges.middle[behind]), _percentage(estimate[before] < edges.middle[before])


def _percentage(flags: BoolMap) -> float:
    return 100 * float(flags.mean()) if flags.size else math.nan


def in_frame(crop: FloatMap, offset: tuple[int, int], shape: tuple[int, int]) -> tuple[FloatMap, BoolMap]:
    """A crop's map in the frame of the whole image.

    Parameters
    ----------
    crop : ndarray, shape (h, w), float32
        Disparity of the crop, pixels per view step.
    offset : (int, int)
        Row and column of the crop's top left pixel in the whole image, from 0.
    shape : (int, int)
        Height and width (H, W) of the whole image.

    Returns
    -------
    whole : ndarray, shape (H, W), float32
        NaN outside the crop.
    inside : ndarray, shape (H, W), bool
        The crop's pixels.

    Raises
    ------
    SepiError
        If the crop extends beyond the whole image.
    """
    (row, column), (height, width) = offset, crop.shape
    require_part((shape[1], shape[0], column, row), crop.shape)
    whole, inside = np.full(shape, np.nan, np.float32), np.zeros(shape, bool)
    place = np.s_[row : row + height, column : column + width]
    whole[place], inside[place] = crop, True
    return whole, inside
