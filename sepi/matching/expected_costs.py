"""Expected matching costs of pure noise, by the sub-pixel positions of a candidate's samples.

A sample between pixels averages their noise: its variance is that of a pixel times the sum of the interpolation's
squared weights, 1 at whole pixels and 1/4 amid four of them. Candidates that sample most views between pixels would
cost less whatever the depth, and would attract faint texture in noise. A candidate's match is 1 minus its cost (Eq. 3).
It is divided by the match that noise leaves at such positions, in units of what it leaves anywhere; a view that does
not match has none. Without noise nothing changes. All views count as if they saw the pixel, near the border, too.

The paper, whose light fields have hardly any noise, does not have it.
"""

import cv2
import numpy as np
import numpy.typing as npt

from sepi.image.noise import BLACK, SATURATED
from sepi.lightfield import BoolMap, FloatArray, FloatMap, LightField
from sepi.matching.sweep_arrays import Candidates, ExpectedCosts
from sepi.matching.view_noise import WINDOW, ViewNoise, expected_variance

ANYWHERE = 4 / 9, 49 / 225
"""Means of the sum of squared bilinear weights, and of its square, over all places between pixels."""

_SUMS = np.array([0.25, 0.625, 1.0])
"""Sums of squared bilinear weights, from the least to the greatest, through which costs are a parabola."""

_LEAST_LEFT = np.float32(1e-3)
"""Of the noise's variance, where all samples are cut off."""

_RATIOS = 256
"""Ratios of noise and robust scale at which costs are computed."""


def robust_cost_of_noise(variance: FloatArray, channels: int) -> FloatArray:
    """Expectation of ``z / (z + 1)``, ``z`` being the sum of the squares of three channels' normal residuals.

    Parameters
    ----------
    variance : ndarray, float64
        Of the residual of one channel, in units of the squared robust scale; above 0.
    channels : int
        1 or 3; a single one counts three times.

    Returns
    -------
    ndarray, float64
        0..1, of the same shape.
    """
    from scipy.special import erfcx

    # E[1 / (1 + v X)] with X of the chi-square distribution of one, or of three degrees of freedom
    q = 1 / (2 * variance) if channels > 1 else 1 / (6 * variance)
    of_one = np.sqrt(np.pi * q) * erfcx(np.sqrt(q))
    return np.asarray(1 - (2 * q * (1 - of_one) if channels > 1 else of_one))


def expected_costs(
    light_field: LightField,
    noise: ViewNoise | None,
    candidates: Candidates,
    groups: npt.NDArray[np.int64],
    subsets: BoolMap,
    squared_scale: float,
    multiple: int,
) -> ExpectedCosts:
    """Expected costs of the candidates under noise.

    Parameters
    ----------
    light_field : LightField
    noise : ViewNoise or None
        Of its views; None if there is little, or if it is to be ignored.
    candidates : Candidates
    groups : ndarray, shape (T, S), int64
        Group of each view, 0..G-1; -1 leaves a view out, and the reference view is.
    subsets : ndarray, shape (N, G), bool
        Which groups make up each subset.
    squared_scale : float
        Square of the robust scale, colours in 0..1.
    multiple : int
        The number of candidates is rounded up to one of it.

    Returns
    -------
    ExpectedCosts
        Zeros without noise.
    """
    number = -(-len(candidates.disparities) // multiple) * multiple
    moments = np.zeros((2, len(subsets), number), np.float32)
    if noise is None:
        none = np.zeros((3, *light_field.shape), np.float32)
        return ExpectedCosts(moments, none[:2], none[2])
    down, across = ((1 - f) ** 2 + f**2 for f in (candidates.fy.astype(np.float64), candidates.fx.astype(np.float64)))
    compared = light_field.present & (groups >= 0)
    compared[light_field.reference_position] = False
    if light_field.missing is not None:
        compared &= ~light_field.missing.all(axis=(2, 3))
    for n, subset in enumerate(subsets):
        chosen = compared & subset[groups]
        if not chosen.any():
            continue
        sums: FloatArray = down[chosen] * across[chosen]
        for power, anywhere in enumerate(ANYWHERE, start=1):
            moments[power - 1, n, : sums.shape[1]] = (sums**power).mean(axis=0) - anywhere
    variance = expected_variance(light_field, noise) * _not_cut_off(light_field) / squared_scale
    ratios = np.geomspace(variance.min(), variance.max(), _RATIOS)
    # grey stored as three channels is grey
    channels = 1 if not np.ptp(light_field.reference_view, axis=2).any() else 3
    costs = robust_cost_of_noise(ratios * (1 + _SUMS[:, None]), channels)
    constant, linear, quadratic = np.linalg.solve(np.vander(_SUMS, increasing=True), costs)
    usual = constant + linear * ANYWHERE[0] + quadratic * ANYWHERE[1]
    maps = (np.interp(variance, ratios, values) for values in (linear / (1 - usual), quadratic / (1 - usual), usual))
    first, second, of_noise = (values.astype(np.float32) for values in maps)
    return ExpectedCosts(moments, np.stack([first, second]), of_noise)


def _not_cut_off(light_field: LightField) -> FloatMap:
    """Share of the noise variance that remains where samples round a pixel are black or overexposed, (H, W).

    A signal clipped in part of its samples keeps about the square of the rest. That factor is applied once more: the
    noise is less certain there, and overcorrection is worse than undercorrection.
    """
    image = light_field.reference_view
    told = ((image > BLACK) & (image < SATURATED)).mean(axis=2, dtype=np.float32)
    return np.asarray(np.maximum(cv2.blur(told, WINDOW) ** 4, _LEAST_LEFT), np.float32)
