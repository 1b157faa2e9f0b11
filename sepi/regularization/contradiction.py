"""Pixels where the views contradict a plane in favour of the previous depth.

A plane from a few border pixels, or in a region wrongly taken for uniform, may replace a correct depth from faint
texture. So both are compared with the views: where the plane fits clearly worse, over some pixels, than noise alone
explains, the views contradict it. The rim of a region is left out: its pixels also show what stands beside it.
"""

from __future__ import annotations

import cv2
import numpy as np

from sepi.lightfield import BoolMap, FloatMap, LightField, without_reference
from sepi.matching.gaps import compared_depths

# pixels over which residuals are summed: what faint texture tells, many pixels tell together
_WINDOW = 17, 17
# standard deviations by which residuals are larger than noise makes them, from which on a depth is contradicted
_CLEAR = 4.0
# most that a view counts at a pixel, in units of the noise's variance: it may show something else
_MOST = 27.0
# of a region, all that is left out
_RIM = np.ones((5, 5), np.uint8)


def contradicted(
    light_field: LightField,
    before: FloatMap,
    after: FloatMap,
    regions: BoolMap,
    present: BoolMap,
    occlusion_margin: float,
    variance: float,
) -> BoolMap:
    """Pixels whose views, with those of the pixels about, fit one map clearly better than the one that replaces it.

    Parameters
    ----------
    light_field : LightField
        Not denoised: noise has to be that of each pixel by itself.
    before, after : ndarray, shape (H, W), float32
        Pixels per view step; where they are equal nothing is compared.
    regions : ndarray, shape (H, W), bool
        Where they may differ.
    present : ndarray, shape (T, S), bool
        The views that are asked.
    occlusion_margin : float
        By how much an occluder must be nearer, pixels per view step.
    variance : float
        Of the noise of one channel of a view, colours in 0..1.

    Returns
    -------
    ndarray, shape (H, W), bool
    """
    others = without_reference(light_field, present)
    inside = cv2.erode(regions.astype(np.uint8), _RIM, borderValue=1) > 0
    # beside an occluder a view shows both
    occluders = np.asarray(cv2.dilate(after, np.ones((3, 3), np.uint8)), np.float32)
    compared = compared_depths(light_field, before, after, others, occlusion_margin, _MOST * variance, occluders)
    sums = compared * inside
    there, here, views = (cv2.boxFilter(each, cv2.CV_64F, _WINDOW, normalize=False) for each in sums)
    # of white noise the ratio of both sums is about one, with a deviation of one over the root of how many they are of
    return np.asarray(regions & (there > here * (1 + _CLEAR / np.sqrt(np.maximum(views, 1)))))
