"""Noise of the views by brightness and by place, from the views themselves.

Two bounds from above, of which the lower one holds. Within a view, what the flattest blocks of a brightness vary by:
texture adds to it. Between views, by what a block differs from others at whole pixels from it, nothing being
interpolated: where texture fits, however strong, the noise of two pixels is left; where no whole pixel fits, or a
surface is hidden or shines, or the cameras' pictures are not alike, more is left. So the best tenth of blocks tells.
The mean of a block does not count, which exposure may change from view to view.

Where texture is all over a brightness, both are too high. Photons that a tone curve of a power makes into values have
noise that is a power of brightness, too; what lies far above the line of the lower brightnesses' noise is none.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import cv2
import numpy as np
import numpy.typing as npt

from sepi.image.noise import BLACK, SATURATED, mask_energy
from sepi.kernels import view_noise as kernels
from sepi.lightfield import BoolMap, FloatMap, LightField, full_scale

VIEWS = 12
"""Nearest other views that are compared, at least: of those equally far away all."""

MOST_MOVES = 400
"""Beyond so many whole pixels of all of them no other view is compared: where disparities are large, few will do."""

LEVELS = 8
"""Of brightness, each with as many blocks as the next."""

PARTS = 4
"""Of the picture, down and across."""

BEST_SHARE = 0.1
"""Of the blocks of a brightness, or of a part, that tell its noise."""

# the best tenth of blocks of nothing but noise has so much less of it than all: measured on white noise
_OF_ONE_VIEW, _OF_VIEWS = 1.23, 1.25

_ROUNDING = 0.29
"""Standard deviation of what rounding to whole levels adds."""

_LEAST = 1e-5
"""The same of single precision."""

_LOWER_SHARE = 0.25
"""Of the brightnesses, those whose noise may be below the line."""

_BENT = 2.0
"""Times the line that a variance may be: real tone curves are bent, and reading adds noise to the photons'."""

_SLOPES = np.linspace(-1.5, 1.5, 13)
"""Powers of brightness that a variance may go with: photons' noise and that of reading, seen through a camera's tone
curve or as it is."""

_TRUSTED = 0.85
"""Agreement of the two bounds from which on a brightness may have more noise than the line, and a part of the picture
more than its brightness."""

_ENOUGH = 25
"""Blocks of a brightness, or of a part of the picture, from which on it is told that they may not have more noise: the
best tenth of fewer scatters by itself."""

WINDOW = (9, 9)
"""Of a pixel's own noise, and of its brightness, pixels."""

_MOST_OF_USUAL = 4.0
"""Times the noise of its brightness and place that a pixel may have: beyond, it is texture."""

_MOST_UNEVEN = 16.0
"""Most that a part's noise may differ from the picture's, as a factor of its variance."""


@dataclass(frozen=True)
class ViewNoise:
    """Noise at several brightnesses.

    Attributes
    ----------
    brightness : ndarray, shape (N,), float32
        Rising, 0..1.
    variance : ndarray, shape (N,), float32
        Of one channel, colours in 0..1.
    by_place : ndarray, shape (PARTS, PARTS), float32
        What that is multiplied with in parts of the picture, where a lens darkens it or its light is uneven.
    share : float
        Of the variance by which views differ, at most, what is noise of each view.
    agreement : float
        Ratio, at most 1, of the two standard deviations that are told within a view and between views, at the
        brightness where they agree least: 1 where nothing but noise can be what both see.
    """

    brightness: FloatMap
    variance: FloatMap
    by_place: FloatMap
    share: float
    agreement: float

    @property
    def usual(self) -> float:
        """Standard deviation at the brightness in the middle."""
        return float(np.sqrt(np.median(self.variance)))


def view_noise(light_field: LightField) -> ViewNoise:
    """Noise of the views of a light field.

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
    # beyond the picture nothing is known
    height, width = light_field.shape
    # as many from the one end as from the other: a picture that is turned has the same blocks
    rows, columns = (2 * (size // (2 * kernels.BLOCK)) or size // kernels.BLOCK for size in (height, width))
    differences = np.empty((rows, columns), np.float32)
    kernels.least_differences(views, *place, moves, differences)
    between = np.minimum(differences * unit**2 / 2, 1)
    brightness = np.mean(cv2.split(image), axis=0)
    within, level = (_of_blocks(values, between.shape, kernels.BLOCK) for values in (mask_energy(image), brightness))
    # what is black, overexposed or flat has none of the noise that the rest has
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
    """Power of brightness that a quarter of the variances lie below: the best of those through one of them each."""
    x, y = np.log(np.float64(brightness)), np.log(np.float64(variance))
    lines = y[:, None, None] + _SLOPES[:, None] * (x - x[:, None, None])
    above = y - lines
    loss = np.where(above > 0, _LOWER_SHARE * above, (_LOWER_SHARE - 1) * above).sum(axis=2)
    return np.asarray(np.exp(lines.reshape(-1, len(x))[loss.argmin()]), np.float32)


def _least_variance(dtype: npt.DTypeLike) -> float:
    """Of what views hold, however little noise there is; colours in 0..1."""
    return (_LEAST if dtype == np.float32 else _ROUNDING / full_scale(np.dtype(dtype))) ** 2


def expected_variance(light_field: LightField, noise: ViewNoise) -> npt.NDArray[np.float64]:
    """Variance of the noise of one channel that each pixel's brightness and place have.

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
    """Variance of the noise of one channel of a view, pixel by pixel.

    What the views vary by from pixel to pixel there, which texture adds to; at most so many times what their brightness
    and place have, at least what rounding adds.

    Parameters
    ----------
    light_field : LightField
        Whose noise it is, not denoised.
    noise : ViewNoise
    views : ndarray, shape (T, S), bool
        That are looked at.

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
    """Noise of each part of the picture, from energies of blocks in units of what their brightness has."""
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
    """One of ``PARTS`` x ``PARTS`` parts of a picture; what lies across a border of two belongs to both."""
    return tuple(slice(i * n // PARTS, -(-(i + 1) * n // PARTS)) for i, n in zip(number, shape, strict=True))


def _bounds(within: FloatMap, between: FloatMap) -> tuple[float, float]:
    """What the best blocks tell of the noise, within a view and between views."""
    of_one, of_two = (float(np.quantile(energy, BEST_SHARE)) for energy in (within, between))
    return _OF_ONE_VIEW * of_one, _OF_VIEWS * of_two


def _agreement(of_one: float, of_two: float) -> float:
    """Ratio, at most 1, of the standard deviations of two variances."""
    return float((min(of_one, of_two) / max(of_one, of_two, 1e-12)) ** 0.5)


def whole_pixel_moves(light_field: LightField) -> npt.NDArray[np.int64]:
    """Where the nearest views may have a pixel of the reference view, in whole pixels from it.

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
    others = light_field.present.copy()
    others[light_field.reference_position] = False
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
    """Means over blocks of ``size`` pixels that lie side by side from all borders."""
    rows, columns = shape
    for axis, number in enumerate(shape):
        beyond = values.shape[axis] - number * size
        middle = (number + 1) // 2 * size
        values = np.delete(values, np.s_[middle : middle + beyond], axis)
    blocks = values.reshape(rows, size, columns, size)
    return np.asarray(blocks.mean(axis=(1, 3)), np.float32)
