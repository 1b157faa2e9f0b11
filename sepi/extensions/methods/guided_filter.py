"""Guided filter with a colour guide [1]_: smoothing that keeps the edges of the guide.

In each window the output is a linear function of the guide's colours, which preserves the guide's edges, and each pixel
is the mean over all windows that contain it. The run time does not depend on the window size.

References
----------
.. [1] He, Sun, Tang: Guided image filtering. IEEE TPAMI 35(6), 2013. doi:10.1109/TPAMI.2012.213
"""

from __future__ import annotations

import cv2
import numpy as np

from sepi.lightfield import FloatMap


class GuidedFilter:
    """A guided filter [1]_ that applies one guide to many maps, such as the costs of all candidates.

    Parameters
    ----------
    guide : ndarray, shape (H, W, 3), float32
        Colours in 0..1.
    radius : int
        The windows are ``2 radius + 1`` pixels wide.
    epsilon : float
        Colour variance within a window above which its edges are preserved.

    References
    ----------
    .. [1] He, Sun, Tang: Guided image filtering. IEEE TPAMI 35(6), 2013. doi:10.1109/TPAMI.2012.213

    Examples
    --------
    Noise is smoothed, and the step is preserved, since the guide has it too:

    >>> import numpy as np
    >>> from sepi.extensions.methods.guided_filter import GuidedFilter
    >>> step = np.zeros((32, 32), np.float32)
    >>> step[:, 16:] = 1
    >>> smooth = GuidedFilter(np.repeat(step[..., None], 3, axis=2), radius=4, epsilon=1e-4)
    >>> noisy = step + np.random.default_rng(0).normal(0, 0.2, step.shape).astype(np.float32)
    >>> bool(np.abs(smooth(noisy) - step).max() < 0.5 * np.abs(noisy - step).max())
    True
    >>> bool(np.abs(smooth(step) - step).max() < 0.01)
    True
    """

    def __init__(self, guide: FloatMap, radius: int, epsilon: float) -> None:
        self._size = (2 * radius + 1, 2 * radius + 1)
        self._guide = guide.astype(np.float32)
        self._mean = self._box(self._guide)
        # centred first: one-pass variances of nearly constant colours lose precision in float32
        offset = self._guide.mean(axis=(0, 1), dtype=np.float64).astype(np.float32)
        self._guide -= offset
        self._mean -= offset
        covariance = np.empty((*guide.shape[:2], 3, 3))
        for i in range(3):
            for j in range(i, 3):
                product = self._box(self._guide[..., i] * self._guide[..., j])
                covariance[..., i, j] = covariance[..., j, i] = product - self._mean[..., i] * self._mean[..., j]
        self._inverse = np.linalg.inv(covariance + epsilon * np.eye(3)).astype(np.float32)

    def __call__(self, values: FloatMap) -> FloatMap:
        """Filter a map.

        Parameters
        ----------
        values : ndarray, shape (H, W), float32

        Returns
        -------
        ndarray, shape (H, W), float32
        """
        mean = self._box(values)
        covariance = self._box(self._guide * values[..., None]) - self._mean * mean[..., None]
        slope = np.einsum("hwij,hwj->hwi", self._inverse, covariance)
        offset = mean - (slope * self._mean).sum(axis=2)
        return np.asarray((self._box(slope) * self._guide).sum(axis=2) + self._box(offset), np.float32)

    def _box(self, values: FloatMap) -> FloatMap:
        return np.asarray(cv2.blur(values, self._size, borderType=cv2.BORDER_REFLECT))
