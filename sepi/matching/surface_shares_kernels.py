"""Compiled loops of the decision by shares of the views (:mod:`sepi.matching.surface_shares`)."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from numba import njit, prange

from sepi.lightfield import FloatMap
from sepi.matching.depth_step_kernels import Rim

FEWEST_VIEWS = 3
"""That see a piece of background, before its colour counts."""

FEWEST_SAMPLES = 8
"""Views from which a share is told."""

SHARES = 12
"""That are tried, from 0 to 1; none is one half."""

_CLEAN_RADIUS = 4  # how far away clean colours of the nearer surface are looked for, pixels
_SAME_SURFACE = 0.25  # difference of disparity, pixels per view step
# standard deviation of a surface's colour from its clean neighbours', beyond theirs; by what its square is divided, as
# errors of views go together; the same where the colour is free, and where no clean one is known; colours in 0..1
_CLEAN_DEVIATION = 0.02
_HELD = 4.0
_FREE_DEVIATION = 0.3
_UNKNOWN_DEVIATION = 1.0
_MOST_DEVIATION2 = 0.01  # squared residual that one view counts at most in the background's variance
_STRIDE = 4  # pixels from one to the next that tell the brightness of a view
_MOST_DIFFERENCE = 0.1  # of one channel, that counts in a view's residual
_UNKNOWN = 1e3  # cost where nothing tells


class RimViews(NamedTuple):
    """The views that are compared, and what hides what in them.

    Attributes
    ----------
    pixels : ndarray, shape (T, S, H, W, C), uint8, uint16 or float32
    units : ndarray, shape (N,), float32
        What the pixels of each view that is compared are multiplied with to be 0..1, and as bright as the reference.
    places : ndarray, shape (N, 2), int64
        Row and column in the grid of each view that is compared.
    baselines : ndarray, shape (N, 2), float64
        Theirs, down and across, in view steps.
    nearest : ndarray, shape (T, S, n, W), float32
        z-buffers of the map, its nearer surfaces widened by a pixel, so that no mixed pixel counts as background.
    low : int
        First row of ``nearest``.
    """

    pixels: npt.NDArray[Any]
    units: FloatMap
    places: npt.NDArray[np.int64]
    baselines: npt.NDArray[np.float64]
    nearest: FloatMap
    low: int


class Background(NamedTuple):
    """What the views show behind the nearer surfaces.

    Attributes
    ----------
    colour : ndarray, shape (H, W, 3), float32
    variance : ndarray, shape (H, W), float32
        Of the views' colours, mean of the channels.
    views : ndarray, shape (H, W), int32
        How many see it.
    """

    colour: FloatMap
    variance: FloatMap
    views: npt.NDArray[np.int32]


@njit(inline="always")
def _sees(views: RimViews, view: int, d: Any, y: int, x: int, margin: Any) -> Any:
    """Whether a view shows a pixel of disparity ``d``, and where: row and column of the sample, and its fractions."""
    H, W = views.pixels.shape[2], views.pixels.shape[3]
    down, across = y - d * views.baselines[view, 0], x - d * views.baselines[view, 1]
    if down < 0 or across < 0 or down >= H - 1 or across >= W - 1:
        return False, 0, 0, 0.0, 0.0
    row, column = int(down), int(across)
    nearest = views.nearest[
        views.places[view, 0], views.places[view, 1], int(down + 0.5) - views.low, int(across + 0.5)
    ]
    return nearest <= d + margin, row, column, down - row, across - column


@njit(inline="always")
def _cubic(f: Any) -> Any:
    """Weights of four neighbours, the second and third of which a sample lies between (Catmull and Rom's)."""
    return (
        f * (-0.5 + f * (1 - 0.5 * f)),
        1 + f * f * (-2.5 + 1.5 * f),
        f * (0.5 + f * (2 - 1.5 * f)),
        f * f * (-0.5 + 0.5 * f),
    )


@njit(inline="always")
def _sample(views: RimViews, view: int, row: int, column: int, fy: Any, fx: Any, out: Any) -> None:
    """Colour between pixels of a view into ``out (3,)``, 0..1; grey counts as three equal channels.

    Cubic, since a bilinear sample takes from the peak of what is two pixels wide.
    """
    picture = views.pixels[views.places[view, 0], views.places[view, 1]]
    H, W, C = picture.shape
    down, across = _cubic(fy), _cubic(fx)
    for c in range(C):
        total = 0.0
        for i in range(4):
            line = picture[min(max(row - 1 + i, 0), H - 1)]
            along = 0.0
            for j in range(4):
                along += across[j] * line[min(max(column - 1 + j, 0), W - 1), c]
            total += down[i] * along
        out[c] = total * views.units[view]
    for c in range(C, 3):
        out[c] = out[0]


@njit(parallel=True, cache=True)
def brightness_of_views(views: RimViews, disparity: Any, guide: Any, clean: Any, missing: Any) -> Any:
    """How bright each view is beside the reference, and how badly it shows the same.

    Parameters
    ----------
    views : RimViews
        Its z-buffers are not looked at.
    disparity : ndarray, shape (H, W), float32
    guide : ndarray, shape (H, W, 3), float32
        Reference view, 0..1.
    clean : ndarray, shape (H, W), bool
        Pixels that are looked at, some of them.
    missing : ndarray, shape (T, S, H, W) or (T, S, 0, 0), bool
        Pixels that a view does not show; empty: none.

    Returns
    -------
    brightness, residual : ndarray, shape (N,), float64
        Ratio of the sums of the colours; mean absolute difference of one channel, 0..1, that is left, NaN of views that
        show none of the pixels.
    """
    H, W = disparity.shape
    N = len(views.places)
    brightness, residual = np.ones(N), np.zeros(N)
    for view in prange(N):
        colour = np.empty(3)
        of_view = missing[views.places[view, 0], views.places[view, 1]]
        for turn in range(2):
            own, other, rest, n = 1e-9, 1e-9, 0.0, 1
            for y in range(0, H, _STRIDE):
                for x in range(0, W, _STRIDE):
                    down = y - disparity[y, x] * views.baselines[view, 0]
                    across = x - disparity[y, x] * views.baselines[view, 1]
                    if not clean[y, x] or down < 0 or across < 0 or down >= H - 1 or across >= W - 1:
                        continue
                    row, column = int(down), int(across)
                    if of_view.size > 0 and of_view[row : row + 2, column : column + 2].any():
                        continue
                    _sample(views, view, row, column, down - row, across - column, colour)
                    for c in range(3):
                        own += guide[y, x, c]
                        other += colour[c]
                        rest += min(abs(colour[c] / brightness[view] - guide[y, x, c]), _MOST_DIFFERENCE)
                        n += 1
            if turn == 0:
                brightness[view] = other / own
            else:
                residual[view] = rest / n if n > 1 else np.nan
    return brightness, residual


@njit(parallel=True, cache=True)
def background_of(views: RimViews, layer: Any, wanted: Any, margin: Any, begin: int, end: int) -> Any:
    """Colours of the more distant surfaces, medians over the views that see them.

    Parameters
    ----------
    views : RimViews
    layer : ndarray, shape (H, W), float32
        Disparity of the more distant surface, also where a nearer one hides it.
    wanted : ndarray, shape (H, W), bool
    margin : float32
        By how much an occluder must be nearer, pixels per view step.
    begin, end : int
        Rows that are made; others are left undefined.

    Returns
    -------
    Background
    """
    H, W = layer.shape
    N = len(views.places)
    colour, variance = np.empty((H, W, 3), np.float32), np.empty((H, W), np.float32)
    count = np.zeros((H, W), np.int32)
    for y in prange(begin, end):
        samples, colour_there = np.empty((3, N), np.float32), np.empty(3)
        for x in range(W):
            if not wanted[y, x]:
                continue
            n = 0
            for view in range(N):
                seen, row, column, fy, fx = _sees(views, view, layer[y, x], y, x, margin)
                if seen:
                    _sample(views, view, row, column, fy, fx, colour_there)
                    samples[:, n] = colour_there
                    n += 1
            count[y, x] = n
            if n < FEWEST_VIEWS:
                continue
            total = 0.0
            for c in range(3):
                middle = np.median(samples[c, :n])
                colour[y, x, c] = middle
                for v in range(n):
                    total += min((samples[c, v] - middle) ** 2, _MOST_DEVIATION2)
            variance[y, x] = total / (3 * n)
    return Background(colour, variance, count)


@njit(inline="always")
def _behind(background: Background, row: int, column: int, fy: Any, fx: Any, out: Any) -> Any:
    """Colour between pixels of the background into ``out (3,)``, and its variance; negative where it is not known."""
    for i in range(row, row + 2):
        for j in range(column, column + 2):
            if background.views[i, j] < FEWEST_VIEWS:
                return -1.0
    a, b, c, d = (1 - fy) * (1 - fx), (1 - fy) * fx, fy * (1 - fx), fy * fx
    for k in range(3):
        B = background.colour[:, :, k]
        out[k] = a * B[row, column] + b * B[row, column + 1] + c * B[row + 1, column] + d * B[row + 1, column + 1]
    V = background.variance
    return a * V[row, column] + b * V[row, column + 1] + c * V[row + 1, column] + d * V[row + 1, column + 1]


@njit(inline="always")
def _nearer_colour(
    guide: Any, clean: Any, disparity: Any, near: Any, middle: Any, y: int, x: int, out: Any, limits: Any
) -> Any:
    """Colour of the nearer surface beside a pixel into ``out (3,)``, and its variance.

    That of clean pixels, or else the pixel's own. ``limits (2, 3)`` are the least and most that the surface shows.
    """
    H, W = disparity.shape
    weights, squares = 0.0, 0.0
    out[:] = 0
    limits[0], limits[1] = 1.0, 0.0
    for i in range(max(0, y - _CLEAN_RADIUS), min(H, y + _CLEAN_RADIUS + 1)):
        for j in range(max(0, x - _CLEAN_RADIUS), min(W, x + _CLEAN_RADIUS + 1)):
            if disparity[i, j] > middle:
                for c in range(3):
                    limits[0, c] = min(limits[0, c], guide[i, j, c])
                    limits[1, c] = max(limits[1, c], guide[i, j, c])
            if clean[i, j] and abs(disparity[i, j] - near) < _SAME_SURFACE:
                weight = 1 / (1 + (i - y) ** 2 + (j - x) ** 2) ** 2
                weights += weight
                for c in range(3):
                    out[c] += weight * guide[i, j, c]
                    squares += weight * guide[i, j, c] ** 2
    if weights == 0:
        out[:] = guide[y, x]
        return _UNKNOWN_DEVIATION**2
    variance = squares / weights
    for c in range(3):
        out[c] /= weights
        variance -= out[c] ** 2
    return (max(variance, 0.0) / 3 + _CLEAN_DEVIATION**2) / _HELD


@njit(inline="always")
def _along_near(
    views: RimViews, background: Background, near: Any, far: Any, y: int, x: int, margin: Any, out: Any, behind: Any,
    noise: Any,
) -> int:  # fmt: skip
    """What the views show of a pixel that moves with ``near``, and what is behind it there; how many tell both.

    Into ``out`` and ``behind (N, 3)``, and the variance of the latter into ``noise (N,)``.
    """
    H, W = background.views.shape
    n = 0
    for view in range(len(views.places)):
        seen, row, column, fy, fx = _sees(views, view, near, y, x, margin)
        # where the background that is there in the view is in the reference view
        down = y - (near - far) * views.baselines[view, 0]
        across = x - (near - far) * views.baselines[view, 1]
        if not seen or down < 0 or across < 0 or down >= H - 1 or across >= W - 1:
            continue
        i, j = int(down), int(across)
        noise[n] = _behind(background, i, j, down - i, across - j, behind[n])
        if noise[n] >= 0:
            _sample(views, view, row, column, fy, fx, out[n])
            n += 1
    return n


@njit(inline="always")
def _cost_of_share(
    share: Any, colours: Any, behind: Any, noise: Any, own: Any, held: Any, limits: Any, scale2: Any
) -> Any:
    """Mean robust residual of views that show a share of one colour before the background, 0..1.

    The colour is that which fits best within ``limits (2, 3)``, and is held near ``own (3,)`` with the weight of
    ``held`` views. ``colours`` and ``behind (N, 3)`` and the variance ``noise (N,)`` of the latter are the samples.
    """
    n = len(noise)
    rest = 1 - share
    fit = np.empty(3)
    total = 0.0
    for c in range(3):
        along = 0.0
        for v in range(n):
            along += colours[v, c] - rest * behind[v, c]
        best = (share * along + held * own[c]) / (share * share * n + held)
        fit[c] = min(max(best, limits[0, c]), limits[1, c])
        total += held * (fit[c] - own[c]) ** 2 / scale2
    for v in range(n):
        half = scale2 + rest * rest * noise[v]
        for c in range(3):
            residual = (colours[v, c] - share * fit[c] - rest * behind[v, c]) ** 2
            total += residual / (residual + half)
    return total / (3 * n)


@njit(inline="always")
def _cost_alone(views: RimViews, guide: Any, d: Any, y: int, x: int, margin: Any, scale2: Any, colour: Any) -> Any:
    """Mean robust residual of a pixel that moves with ``d``, over views that see it; ``colour`` is scratch."""
    total, n = 0.0, 0
    for view in range(len(views.places)):
        if views.baselines[view, 0] == 0 and views.baselines[view, 1] == 0:
            # the reference view itself always fits
            continue
        seen, row, column, fy, fx = _sees(views, view, d, y, x, margin)
        if seen:
            _sample(views, view, row, column, fy, fx, colour)
            for c in range(3):
                residual = (colour[c] - guide[y, x, c]) ** 2
                total += residual / (residual + scale2)
            n += 1
    return total / (3 * n) if n >= FEWEST_VIEWS else _UNKNOWN


@njit(parallel=True, cache=True)
def evidence_of_shares(
    views: RimViews, rim: Rim, background: Background, disparity: Any, guide: Any, clean: Any, margin: Any,
    scales2: Any, begin: int, end: int, evidence: Any,
) -> None:  # fmt: skip
    """By how much the other surface explains the views better than the one that a pixel has.

    Along the nearer surface's disparity each view shows the same share of that surface before another piece of
    background. More than half is near, less is far.

    Parameters
    ----------
    views : RimViews
    rim : Rim
    background : Background
    disparity : ndarray, shape (H, W), float32
    guide : ndarray, shape (H, W, 3), float32
        Reference view, 0..1.
    clean : ndarray, shape (H, W), bool
        Pixels of one surface alone.
    margin : float32
        By how much an occluder must be nearer, pixels per view step.
    scales2 : tuple of float
        Square of the residual at which a view counts half: the least, and what the squared difference of both surfaces'
        colours adds to it, times this; errors of samples grow with it.
    begin, end : int
        Rows that are made.
    evidence : ndarray, shape (H, W), float32
        Filled with differences of mean costs, -1..1; left alone where the views do not tell.
    """
    W = disparity.shape[1]
    N = len(views.places)
    for y in prange(begin, end):
        colours, behind, noise = np.empty((N, 3)), np.empty((N, 3)), np.empty(N)
        own, limits, scratch = np.empty(3), np.empty((2, 3)), np.empty(3)
        for x in range(W):
            if not rim.inside[y, x]:
                continue
            near, far = rim.near[y, x], rim.far[y, x]
            n = _along_near(views, background, near, far, y, x, margin, colours, behind, noise)
            if n < FEWEST_SAMPLES:
                continue
            variance = _nearer_colour(guide, clean, disparity, near, (near + far) / 2, y, x, own, limits)
            if rim.is_near[y, x]:
                # surfaces get darker or brighter towards their edge: to be far, a pixel must be so whatever its colour.
                # To be near it must have the surface's colour: before a bare background, any is a share of another
                variance = _FREE_DEVIATION**2
            apart2 = 0.0
            for v in range(n):
                for c in range(3):
                    apart2 += (own[c] - behind[v, c]) ** 2
            scale2 = scales2[0] + scales2[1] * apart2 / (3 * n)
            low = high = _UNKNOWN
            for k in range(SHARES):
                share = k / (SHARES - 1)
                cost = _cost_of_share(share, colours[:n], behind[:n], noise[:n], own, scale2 / variance, limits, scale2)
                if 2 * k < SHARES - 1:
                    low = min(low, cost)
                else:
                    high = min(high, cost)
            if rim.is_near[y, x]:
                evidence[y, x] = high - low
            else:
                evidence[y, x] = min(low, _cost_alone(views, guide, far, y, x, margin, scale2, scratch)) - high
