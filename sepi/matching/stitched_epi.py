"""Stitched epipolar plane images as the paper builds them (section III, Eq. 1-2 of [1]_), for drawing and tests.

An EPI ``E_{y,t}(x, s)`` stacks row ``y`` of the views of grid row ``t``. A scene point of disparity ``d`` draws the
line ``x = x0 - d (s - s0)`` into it, and a parallel line into each corresponding EPI ``E_{y_j,t_j}`` with
``y_j = y0 - d (t_j - t0)``. Shifting the EPI of ``j = t_j - t0`` by ``-d N_s j`` (Eq. 2; the paper writes ``j N_s /
k`` with the slope ``k = 1/d`` and the opposite sign convention) puts all lines onto one, and concatenating them (Eq.
1) gives an image with ``N_t N_s`` rows. If views stand off the grid, or rows another distance apart, their baselines
replace ``t - t0`` and ``s - s0``, so that lines stay straight.

The estimator does not build these images: :mod:`sepi.matching.plane_sweep` visits the same samples directly.

References
----------
.. [1] Zhou, Shi, Liu, Jin, Zhang, Hou: Light Field Depth Estimation via Stitched Epipolar Plane Images.
"""

from __future__ import annotations

from dataclasses import dataclass
from numbers import Integral

import numpy as np

from sepi.errors import SepiError
from sepi.lightfield import FloatMap, LightField, as_unit_float, require_light_field
from sepi.validation import described, is_finite, require_type


@dataclass(frozen=True)
class StitchedEpi:
    """A SEPI through one row of the reference view for one candidate disparity.

    Rows are not resampled: ``offsets`` holds their shifts. Only :meth:`image` resamples them.

    Attributes
    ----------
    rows : ndarray, shape (T * S, W, C), float32
        Rows of the corresponding EPIs, 0..1, ordered by ``t``, then ``s``.
    offsets : ndarray, shape (T * S,), float64
        Shift of each row to the right, pixels (Eq. 2).
    positions : ndarray, shape (T * S,), float64
        Position of each row along the stitched angular axis, ``s' - s0'`` = 0 for the reference view, in view steps.
    inside : ndarray, shape (T * S,), bool
        Whether the corresponding EPI lies inside its view and the view is present.
    disparity : float
        Candidate, pixels per view step.

    Examples
    --------
    In the SEPI of the true disparity, the line through a pixel has one colour:

    >>> from sepi.matching.stitched_epi import StitchedEpi, stitched_epi
    >>> from sepi.scenes import render
    >>> light_field = render("fronto_parallel", size=64, views=3)  # of disparity 1
    >>> right, wrong = (stitched_epi(light_field, 32, disparity) for disparity in (1.0, 0.5))
    >>> isinstance(right, StitchedEpi), right.image().shape
    (True, (9, 64, 3))
    >>> samples, valid = right.along_line(32)
    >>> samples.shape, bool(valid.all()), bool(samples.std(axis=0).max() < 1e-6)
    ((9, 3), True, True)
    >>> bool(wrong.along_line(32)[0].std(axis=0).max() > 0.01)
    True
    """

    rows: FloatMap
    offsets: np.ndarray
    positions: np.ndarray
    inside: np.ndarray
    disparity: float

    def along_line(self, x: int) -> tuple[FloatMap, np.ndarray]:
        """Samples on the line of the candidate's slope through one column of the reference view's row.

        Parameters
        ----------
        x : int
            Column of the reference view.

        Returns
        -------
        samples : ndarray, shape (T * S, C), float32
            Linear interpolation between the row's pixels.
        valid : ndarray, shape (T * S,), bool
            Whether the sample lies inside its view.
        """
        position = x - self.disparity * self.positions - self.offsets
        width = self.rows.shape[1]
        valid = self.inside & (position >= 0) & (position <= width - 1)
        left = np.clip(np.floor(position), 0, width - 2).astype(int)
        weight = (position - left)[:, None]
        number = np.arange(len(self.rows))
        samples = (1 - weight) * self.rows[number, left] + weight * self.rows[number, left + 1]
        return samples.astype(np.float32), valid

    def image(self) -> FloatMap:
        """The SEPI as a picture.

        Returns
        -------
        ndarray, shape (T * S, W, C), float32
            Shifted rows resampled to whole pixels; zero outside.
        """
        width = self.rows.shape[1]
        picture = np.zeros_like(self.rows)
        for number, (row, offset) in enumerate(zip(self.rows, self.offsets, strict=True)):
            for channel in range(row.shape[1]):
                picture[number, :, channel] = np.interp(
                    np.arange(width) - offset, np.arange(width), row[:, channel], left=0, right=0
                )
        picture[~self.inside] = 0
        return picture


def stitched_epi(light_field: LightField, y: int, disparity: float) -> StitchedEpi:
    """The SEPI through one row of the reference view for one candidate (section III, Eq. 1-2 of [1]_).

    Parameters
    ----------
    light_field : LightField
    y : int
        Row of the reference view.
    disparity : float
        Candidate, pixels per view step.

    Returns
    -------
    StitchedEpi

    Raises
    ------
    SepiError
        If the row lies outside the reference view.

    References
    ----------
    .. [1] Zhou, Shi, Liu, Jin, Zhang, Hou: Light Field Depth Estimation via Stitched Epipolar Plane Images.
       arXiv:2203.15201.

    Examples
    --------
    >>> from sepi.matching.stitched_epi import stitched_epi
    >>> from sepi.scenes import render
    >>> light_field = render("fronto_parallel", size=64, views=3)
    >>> epi = stitched_epi(light_field, y=32, disparity=1.0)
    >>> epi.rows.shape  # nine views, stitched row below row
    (9, 64, 3)
    >>> epi.offsets.astype(int).tolist()  # the EPIs of three rows of views, shifted against each other
    [3, 3, 3, 0, 0, 0, -3, -3, -3]
    """
    require_light_field(light_field)
    (T, S), (H, W) = light_field.grid, light_field.shape
    require_type(f"{light_field.name}: row", y, Integral, "a whole number")
    if not 0 <= y < H:
        raise SepiError(f"{light_field.name}: row {y} lies outside the reference view (0..{H - 1})")
    if not is_finite(disparity):
        raise SepiError(f"{light_field.name}: disparity must be a finite number, got {described(disparity)}")
    down, across = np.moveaxis(light_field.baselines, 2, 0)
    j = np.repeat(np.arange(T)[:, None] - light_field.reference_position[0], S, axis=1)
    offsets, positions = -disparity * S * j, S * j + across
    row = y - disparity * down
    inside = light_field.present & (row >= 0) & (row <= H - 1)
    top = np.clip(np.floor(row), 0, H - 2).astype(int)
    view = np.ix_(np.arange(T), np.arange(S))
    above, below = (as_unit_float(light_field.rgb_views[(*view, top + below)]) for below in (0, 1))
    weight = (row - top)[..., None, None]
    samples = (1 - weight).astype(np.float32) * above + weight.astype(np.float32) * below
    rows = np.where(inside[..., None, None], samples, np.float32(0))
    return StitchedEpi(rows.reshape(T * S, W, 3), offsets.ravel(), positions.ravel(), inside.ravel(), float(disparity))
