"""All views sheared by a disparity: each view's sample of every pixel of the reference view.

A light field sheared by ``d`` holds, at pixel ``(y, x)`` of view ``(t, s)``, what that view shows at
``(y, x) - d * baseline``. Where ``d`` is the pixel's disparity, all views show the same point there: its *angular
patch* has one colour, and the mean over the views is the light field refocused at ``d`` [1]_.

Samples between pixels come from cubic convolution [2]_, which keeps the detail that sub-pixel depth needs, or from
bilinear interpolation. Beyond its border a view goes on as it ends.

References
----------
.. [1] Ng, Levoy, Bredif, Duval, Horowitz, Hanrahan: Light field photography with a hand-held plenoptic camera.
   Stanford Tech Report CTSR 2005-02.
.. [2] Keys: Cubic convolution interpolation for digital image processing. IEEE TASSP 29(6), 1981.
   doi:10.1109/TASSP.1981.1163711
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import numpy.typing as npt

from sepi.kernels import sheared_views as kernels
from sepi.lightfield import BoolMap, FloatMap, LightField, as_unit_float, require_light_field
from sepi.stage import Progress, no_progress


class ShearedViews:
    """The views of a light field, to be sheared by one disparity after the other.

    Where the disparity is a pixel's, all views show the same point there: what a data cost compares, and the mean over
    the views is the light field refocused at that disparity [1]_. Samples between pixels by cubic convolution [2]_.

    Parameters
    ----------
    light_field : LightField
    views : ndarray, shape (T, S), bool, optional
        The views to shear; all that are present, unless given.
    cubic : bool
        Cubic convolution; else bilinear interpolation.

    Attributes
    ----------
    baselines : ndarray, shape (N, 2), float64
        ``(down, across)`` from the reference view to each view, in view steps.
    positions : ndarray, shape (N, 2), int64
        Row and column ``(t, s)`` of each view in the grid.
    reference : int
        Number of the reference view among them; -1 if it is not one of them.

    References
    ----------
    .. [1] Ng, Levoy, Bredif, Duval, Horowitz, Hanrahan: Light field photography with a hand-held plenoptic camera.
       Stanford Tech Report CTSR 2005-02.
    .. [2] Keys: Cubic convolution interpolation for digital image processing. IEEE TASSP 29(6), 1981.
       doi:10.1109/TASSP.1981.1163711

    Examples
    --------
    Depth by colour variance, the simplest data cost: the candidate at which the views agree best.

    >>> import numpy as np
    >>> from sepi.matching.sheared_views import ShearedViews
    >>> from sepi.scenes import render
    >>> light_field = render("slanted_plane", size=64, views=3)
    >>> candidates = light_field.disparity_range.candidates(41)
    >>> views = ShearedViews(light_field)
    >>> costs = np.stack([sheared.var(axis=0).mean(axis=0) for _, sheared in views.over(candidates)])
    >>> disparity = candidates[costs.argmin(axis=0)]
    >>> bool(np.median(np.abs(disparity - light_field.ground_truth)) < 0.1)
    True
    """

    def __init__(self, light_field: LightField, views: BoolMap | None = None, *, cubic: bool = True) -> None:
        require_light_field(light_field)
        chosen = light_field.present if views is None else views & light_field.present
        self.positions = np.argwhere(chosen)
        self.baselines = light_field.baselines[chosen]
        found = np.flatnonzero((self.positions == light_field.reference_position).all(axis=1))
        self.reference = int(found[0]) if found.size else -1
        self._cubic = cubic
        height, width = light_field.shape
        self._colours = np.empty((len(self.positions), 3, height, width), np.float32)
        for n, (t, s) in enumerate(self.positions):
            self._colours[n] = as_unit_float(light_field.rgb_views[t, s]).transpose(2, 0, 1)
        self._sheared = np.empty_like(self._colours)

    def at(self, disparity: float) -> FloatMap:
        """The views sheared by a disparity.

        Parameters
        ----------
        disparity : float
            Pixels per view step.

        Returns
        -------
        ndarray, shape (N, 3, H, W), float32
            Colours in 0..1 (cubic convolution overshoots a little). The array is made anew by the next call.
        """
        kernels.shear(self._colours, -disparity * self.baselines, self._cubic, self._sheared)
        return self._sheared

    def over(self, disparities: FloatMap, progress: Progress = no_progress) -> Iterator[tuple[int, FloatMap]]:
        """The views sheared by one disparity after the other.

        Parameters
        ----------
        disparities : ndarray, shape (K,), float32
            Pixels per view step.
        progress : callable
            Called with the fraction done, 0..1, after each.

        Yields
        ------
        number : int
            Of the disparity, from 0 on.
        sheared : ndarray, shape (N, 3, H, W), float32
            As of :meth:`at`: the array is made anew by the next step.
        """
        for k, disparity in enumerate(disparities.tolist()):
            yield k, self.at(disparity)
            progress((k + 1) / len(disparities))


def refocused(sheared: FloatMap, weights: npt.NDArray[np.float32] | None = None) -> FloatMap:
    """Mean over sheared views ``(N, 3, H, W)``, with a weight for each if given; shape (3, H, W), float32."""
    if weights is None:
        return np.asarray(sheared.mean(axis=0, dtype=np.float32))
    return np.asarray(np.tensordot(weights / weights.sum(), sheared, axes=1), np.float32)
