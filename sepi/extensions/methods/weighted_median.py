"""Weighted median of a map in a window, with weights by the guide's colours [1]_.

It removes outliers and rough edges from a disparity map without introducing new values.

References
----------
.. [1] Ma, He, Wei, Sun, Wu: Constant time weighted median filtering for stereo matching and beyond. ICCV 2013.
   doi:10.1109/ICCV.2013.13
"""

from __future__ import annotations

import numpy as np

from sepi.kernels import weighted_median as kernels
from sepi.lightfield import FloatMap


def weighted_median(values: FloatMap, guide: FloatMap, radius: int, sigma: float, weight: FloatMap) -> FloatMap:
    """The value in each window at which half of the weight lies below [1]_.

    Parameters
    ----------
    values : ndarray, shape (H, W), float32
        The map to filter.
    guide : ndarray, shape (H, W, 3), float32
        Colours in 0..1.
    radius : int
        The window is ``2 radius + 1`` pixels wide; it is cropped at the image border.
    sigma : float
        RGB distance at which a pixel's weight falls to ``exp(-1/2)``, colours in 0..1.
    weight : ndarray, shape (H, W), float32
        Additional weight of each pixel, not negative, such as its confidence; ones for none. Pixels whose window has no
        weight keep their value.

    Returns
    -------
    ndarray, shape (H, W), float32

    References
    ----------
    .. [1] Ma, He, Wei, Sun, Wu: Constant time weighted median filtering for stereo matching and beyond. ICCV 2013.
       doi:10.1109/ICCV.2013.13

    Examples
    --------
    An edge of the map that is two pixels away from the guide's edge moves there:

    >>> import numpy as np
    >>> from sepi.extensions.methods.weighted_median import weighted_median
    >>> guide = np.zeros((9, 12, 3), np.float32)
    >>> guide[:, 6:] = 1
    >>> fattened = np.zeros((9, 12), np.float32)
    >>> fattened[:, 4:] = 2
    >>> weighted_median(fattened, guide, radius=4, sigma=0.1, weight=np.ones((9, 12), np.float32))[4].tolist()
    [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 2.0, 2.0, 2.0, 2.0, 2.0, 2.0]
    """
    out = np.empty(values.shape, np.float32)
    kernels.weighted_medians(values, guide, radius, sigma, weight, out)
    return out
