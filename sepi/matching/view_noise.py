"""Noise of the views by brightness and by place, measured in the views themselves.

Two measurements give upper bounds, and the lower bound counts:

- within a view: how much the flattest blocks of a brightness vary. Texture adds to this;
- between views: the least difference of a block from blocks of other views, moved by whole pixels and so without
  interpolation. Where texture matches, only the noise of two pixels is left. More is left where no whole pixel fits,
  the surface is hidden or specular, or the cameras differ, so the best tenth of the blocks counts. The mean of a block
  is taken off, since the exposure may change from view to view.

Both bounds are too high for a brightness that has texture everywhere. Photon noise behind a power-law tone curve is a
power of brightness, so a bound far above the line through the lower ones is cut down to this line.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import cv2
import numpy as np
import numpy.typing as npt

from sepi.image.noise import BLACK, SATURATED, mask_energy
from sepi.kernels import view_noise as kernels
from sepi.lightfield import BoolMap, FloatArray, FloatMap, LightField, full_scale, without_reference

VIEWS = 12
"""Least number of other views that are compared, nearest first; equally distant views all take part."""

MOST_MOVES = 400
"""Number of whole-pixel moves, over all views, after which no other view is added."""

LEVELS = 8
"""Number of brightness levels; each has as many blocks as the next."""

PARTS = 4
"""Number of parts of the picture, down and across."""

BEST_SHARE = 0.1
"""Share of the blocks of a brightness, or of a part of the picture, that tell its noise."""

# variance of all blocks divided by that of the best tenth, measured on white noise
_OF_ONE_VIEW, _OF_VIEWS = 1.23, 1.25

_ROUNDING = 0.29
"""Standard deviation of rounding to whole levels."""

_LEAST = 1e-5
"""Standard deviation of rounding to single precision."""

_LOWER_SHARE = 0.25
"""Share of the brightness levels whose noise lies below the line."""

_BENT = 2.0
"""Highest variance as a multiple of the line's: real tone curves are bent, and read noise adds to photon noise."""

_SLOPES = np.linspace(-1.5, 1.5, 13)
"""Powers of brightness that are tried for the variance: photon noise and read noise, with or without a tone curve."""

_TRUSTED = 0.85
"""Least agreement of the two bounds at which they count even above the line, or above the noise of the brightness."""

_ENOUGH = 25
"""Least number of blocks for which these limits apply: the best tenth of fewer blocks scatters too much."""

WINDOW = (9, 9)
"""Pixels over which a pixel's own noise and its brightness are averaged."""

_MOST_OF_USUAL = 4.0
"""Highest variance of a pixel as a multiple of that of its brightness and place; more is texture."""

_MOST_UNEVEN = 16.0
"""Largest factor between the variances of a part and of the picture."""


@dataclass(frozen=True)
class ViewNoise:
    """Variance of the noise by brightness and by part of the picture.

    Attributes
    ----------
    brightness : ndarray, shape (N,), float32
        Rising, 0..1.
    variance : ndarray, shape (N,), float32
        Variance in one channel at each brightness, colours in 0..1.
    by_place : ndarray, shape (PARTS, PARTS), float32
        Factor of the variance in each part of the picture; a lens or uneven light changes it.
    share : float
        Upper bound of the share that noise has in the variance between views.
    agreement : float
        Ratio, at most 1, of the standard deviations measured within a view and between views, at the brightness of
        least agreement. 1: both measure noise only.
    """

    brightness: FloatMap
    variance: FloatMap
    by_place: FloatMap
    share: float
    agreement: float

    @property
    def usual(self) -> float:
        """Median of the standard deviation over the brightness levels."""
        return float(np.sqrt(np.median(self.variance)))


def view_noise(light_field: LightField) -> ViewNoise:
    """Noise of a light field's views.

    Parameters
    ----------
    light_field : LightField
        With a known disparity range.

    Returns
    -------
    ViewNoise

    Raises
    ------
    SepiError
        If the disparity range is unknown.
    """
    views, image = light_field.views, light_field.reference_view
    unit, least = 1 / full_scale(views.dtype), _least_variance(views.dtype)
    place, moves = light_field.reference_position, whole_pixel_moves(light_field)
    height, width = light_field.shape
    # as many blocks from either end, so that a rotated picture has the same blocks
    rows, columns = (2 * (size // (2 * kernels.BLOCK)) or size // kernels.BLOCK for size in (height, width))
    differences = np.empty((rows, columns), np.float32)
    kernels.least_differences(views, *place, moves, differences)
    between = np.minimum(differences * unit**2 / 2, 1)
    brightness = np.mean(cv2.split(image), axis=0)
    within, level = (_of_blocks(values, between.shape, kernels.BLOCK) for values in (mask_energy(image), brightness))
    # black, overexposed and flat blocks have no noise
    tells = (within > 0) & (level > BLACK) & (level < SATURATED)
    even = np.ones((PARTS, PARTS), np.float32)
    if tells.sum() < LEVELS:
        return ViewNoise(np.array([0.5], np.float32), np.array([least], np.float32), even, 1.0, 0.0)
    found: list[tuple[float, float, float, float]] = []
    for low, high in pairwise(np.quantile(level[tells], np.linspace(0, 1, LEVELS + 1))):
        chosen = tells & (level >= low) & (level <= high)
        of_one, of_two = (max(bound, least) for bound in _bounds(within[chosen], between[chosen]))
        share, agreement = min(of_one / of_two, 1), _agreement(of_one, of_two)
        found.append((float(np.median(level[chosen])), min(of_one, of_two), share, agreement))
    brightness, variance, shares, agreements = np.array(found, np.float32).T
    if tells.sum() >= _ENOUGH * LEVELS:
        most = np.where(agreements >= _TRUSTED, np.inf, _BENT * _lower_line(brightness, variance))
        variance = np.minimum(variance, most).astype(np.float32)
    expected = np.interp(level, brightness, variance)
    by_place = _by_place(within / expected, between / expected, tells)
    return ViewNoise(brightness, variance, by_place, float(np.median(shares)), float(agreements.min()))


def _lower_line(brightness: FloatMap, variance: FloatMap) -> FloatMap:
    """Variance as a power of brightness, fitted so that a quarter of the variances lie below it; shape (N,)."""
    x, y = np.log(np.float64(brightness)), np.log(np.float64(variance))
    lines = y[:, None, None] + _SLOPES[:, None] * (x - x[:, None, None])
    above = y - lines
    loss = np.where(above > 0, _LOWER_SHARE * above, (_LOWER_SHARE - 1) * above).sum(axis=2)
    return np.asarray(np.exp(lines.reshape(-1, len(x))[loss.argmin()]), np.float32)


def _least_variance(dtype: npt.DTypeLike) -> float:
    """Variance of the rounding of values of this type; colours in 0..1."""
    return (_LEAST if dtype == np.float32 else _ROUNDING / full_scale(np.dtype(dtype))) ** 2


def expected_variance(light_field: LightField, noise: ViewNoise) -> FloatArray:
    """Variance of the noise of one channel at each pixel, by its brightness and place.

    Parameters
    ----------
    light_field : LightField
    noise : ViewNoise

    Returns
    -------
    ndarray, shape (H, W), float64
        Colours in 0..1.
    """
    height, width = light_field.shape
    level = cv2.blur(np.ascontiguousarray(np.mean(cv2.split(light_field.reference_view), axis=0)), WINDOW)
    by_place = cv2.resize(noise.by_place, (width, height), interpolation=cv2.INTER_LINEAR)
    return np.asarray(np.interp(level, noise.brightness, noise.variance) * by_place, np.float64)


def variance_map(light_field: LightField, noise: ViewNoise, views: BoolMap) -> FloatMap:
    """Variance of the noise of one channel of a view at each pixel, measured in a window.

    Texture adds to the measurement, so a multiple of the variance by brightness and place limits it from above, and the
    variance of rounding from below.

    Parameters
    ----------
    light_field : LightField
        The views as they are, not denoised.
    noise : ViewNoise
    views : ndarray, shape (T, S), bool
        The views in which the noise is measured.

    Returns
    -------
    ndarray, shape (H, W), float32
        Colours in 0..1.
    """
    unit = np.float32(1 / full_scale(light_field.views.dtype))
    energies = [mask_energy(view * unit) for view in light_field.rgb_views[views]]
    energy = np.asarray(np.mean(energies, axis=0), np.float32)
    most = _MOST_OF_USUAL * expected_variance(light_field, noise)
    own = np.minimum(cv2.blur(energy, WINDOW), most)
    return np.asarray(np.maximum(own, _least_variance(light_field.views.dtype)), np.float32)


def _by_place(within: FloatMap, between: FloatMap, tells: BoolMap) -> FloatMap:
    """Factor of the variance in each part of the picture, from blocks' variances relative to their brightness'."""
    factors = np.ones((PARTS, PARTS), np.float32)
    for number in np.ndindex(PARTS, PARTS):
        part = part_of_picture(number, tells.shape)
        chosen = np.zeros_like(tells)
        chosen[part] = tells[part]
        if chosen.sum() >= LEVELS:
            bounds = _bounds(within[chosen], between[chosen])
            may = chosen.sum() < _ENOUGH or _agreement(*bounds) >= _TRUSTED
            most = _MOST_UNEVEN if may else 1
            factors[number] = np.clip(min(bounds), 1 / _MOST_UNEVEN, most)
    return factors


def part_of_picture(number: tuple[int, ...], shape: tuple[int, ...]) -> tuple[slice, ...]:
    """One of ``PARTS`` x ``PARTS`` parts of a picture; a block on the border of two parts belongs to both."""
    return tuple(slice(i * n // PARTS, -(-(i + 1) * n // PARTS)) for i, n in zip(number, shape, strict=True))


def _bounds(within: FloatMap, between: FloatMap) -> tuple[float, float]:
    """Upper bounds of the variance, from the best blocks within a view and between views."""
    of_one, of_two = (float(np.quantile(energy, BEST_SHARE)) for energy in (within, between))
    return _OF_ONE_VIEW * of_one, _OF_VIEWS * of_two


def _agreement(of_one: float, of_two: float) -> float:
    """Ratio, at most 1, of the standard deviations of two variances."""
    return float((min(of_one, of_two) / max(of_one, of_two, 1e-12)) ** 0.5)


def whole_pixel_moves(light_field: LightField) -> npt.NDArray[np.int64]:
    """Whole-pixel shifts of a reference pixel in the nearest views, over the disparity range.

    Parameters
    ----------
    light_field : LightField
        With a known disparity range.

    Returns
    -------
    ndarray, shape (N, 4), int64
        Row and column of a view in the grid, pixels down and across.
    """
    known = light_field.require_disparity_range()
    others = without_reference(light_field, light_field.present)
    places, baselines = np.argwhere(others), light_field.baselines[others]
    moves: list[tuple[int, ...]] = []
    distances, looked_at = (baselines**2).sum(axis=1), 0
    for distance in np.unique(distances[distances > 0]):
        if looked_at >= VIEWS or len(moves) > MOST_MOVES:
            break
        for n in np.flatnonzero(distances == distance):
            looked_at += 1
            longest = float(np.abs(baselines[n]).max())
            for k in np.arange(np.floor(known.minimum * longest), np.ceil(known.maximum * longest) + 1):
                moves.append((*places[n], *np.rint(-k / longest * baselines[n]).astype(int)))
    return np.array(moves, np.int64).reshape(-1, 4)


def _of_blocks(values: FloatMap, shape: tuple[int, ...], size: int) -> FloatMap:
    """Means over blocks of ``size`` pixels, laid from opposite borders; pixels left over in the middle are left out."""
    rows, columns = shape
    for axis, number in enumerate(shape):
        beyond = values.shape[axis] - number * size
        middle = (number + 1) // 2 * size
        values = np.delete(values, np.s_[middle : middle + beyond], axis)
    blocks = values.reshape(rows, size, columns, size)
    return np.asarray(blocks.mean(axis=(1, 3)), np.float32)
