"""Regions for evaluation: pixels that are occluded in some view according to the ground truth, and textureless pixels.

The paper cites another work for its occluded region and does not define its textureless one. These definitions are the
same for all scenes and methods, so that rows of a table are comparable. Estimators never see them.
"""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt
from scipy import ndimage

from sepi.kernels import regions as kernels
from sepi.lightfield import BoolMap, FloatMap
from sepi.validation import require_map, require_type

WINDOW = 7
"""Side in pixels of the window over which gradient energy is averaged."""

ENERGY_THRESHOLD = 0.005
"""RMS gradient below which a pixel is textureless, as a fraction of the full range per pixel (1.3 of 255 steps)."""

MIN_AREA = 225
"""Pixels: smaller patches are dropped and smaller holes filled (one superpixel of the paper, 15 x 15)."""


def occluded(
    ground_truth: FloatMap,
    baselines: npt.NDArray[np.float64],
) -> BoolMap:
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
    labels, _ = ndimage.label(mask)
    large = np.bincount(labels.ravel()) >= MIN_AREA
    large[0] = False
    kept: BoolMap = large[labels]
    return kept
