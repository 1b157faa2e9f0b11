"""Compiled loops of the decision by shares of the views (:mod:`sepi.boundaries.surface_shares`)."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from sepi.boundaries.arrays import RimViews, Sides
from sepi.boundaries.rim_kernels import Rim
from sepi.compiled import njit, prange
from sepi.lightfield import FloatMap

FEWEST_VIEWS = 3
"""That see a piece of background, before its colour counts."""

FEWEST_SAMPLES = 8
"""Views from which a share is told."""

EXACT = {"nnan", "ninf", "nsz"}
"""Fast-math flags that keep every rounding as written: see :mod:`sepi.matching.plane_sweep_kernels`."""

SHARES = 12
"""That are tried, from 0 to 1; none is one half."""

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

# columns of what the views show of a pixel (N, 7): its colours, those behind it, and the variance of the latter
_BEHIND, _NOISE = 3, 6
# rows of the nearer surface beside a pixel (3, 3): its colour, and the least and the most that it shows
_OWN, _LEAST, _MOST = 0, 1, 2


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


@njit(forceinline=True)
def _sees(views: RimViews, view: int, d: Any, y: int, x: int) -> Any:
    """Whether a view shows a pixel of disparity ``d``, and where: row and column of the sample, and its fractions."""
    H, W = views.lines.shape[2], views.lines.shape[3] // views.channels
    down, across = y - d * views.baselines[view, 0], x - d * views.baselines[view, 1]
    if down < 0 or across < 0 or down >= H - 1 or across >= W - 1:
        return False, 0, 0, 0.0, 0.0
    row, column = int(down), int(across)
    nearest = views.nearest[
        views.places[view, 0], views.places[view, 1], int(down + 0.5) - views.low, int(across + 0.5)
    ]
    return nearest <= d + views.margin, row, column, down - row, across - column


@njit(forceinline=True)
def _cubic(f: Any) -> Any:
    """Weights of four neighbours, the second and third of which a sample lies between (Catmull and Rom's)."""
    half, one, more = np.float32(0.5), np.float32(1), np.float32(1.5)
    return (
        f * (f * (one - half * f) - half),
        one + f * f * (more * f - np.float32(2.5)),
        f * (half + f * (np.float32(2) - more * f)),
        f * f * (half * f - half),
    )


@njit(forceinline=True)
def _sample(views: RimViews, view: int, row: int, column: int, fy: Any, fx: Any, out: Any) -> None:
    """Colour between pixels of a view into ``out (3,)``, 0..1; grey counts as three equal channels.

    Cubic, since a bilinear sample takes from the peak of what is two pixels wide.
    """
    picture = views.lines[views.places[view, 0], views.places[view, 1]]
    H, C = picture.shape[0], views.channels
    down, across = _cubic(np.float32(fy)), _cubic(np.float32(fx))
    a, b, c, d = picture[max(row - 1, 0)], picture[row], picture[row + 1], picture[min(row + 2, H - 1)]
    # green and blue of a grey picture are its last channel, too
    second, third = min(1, C - 1), min(2, C - 1)
    first, last = (column - 1) * C, (column + 2) * C
    red, green, blue = np.float32(0), np.float32(0), np.float32(0)
    columns = max(first, 0), first + C, first + 2 * C, min(last, a.size - C)
    for j in range(4):
        i = columns[j]
        red += across[j] * (down[0] * a[i] + down[1] * b[i] + down[2] * c[i] + down[3] * d[i])
        i = columns[j] + second
        green += across[j] * (down[0] * a[i] + down[1] * b[i] + down[2] * c[i] + down[3] * d[i])
        i = columns[j] + third
        blue += across[j] * (down[0] * a[i] + down[1] * b[i] + down[2] * c[i] + down[3] * d[i])
    unit = views.units[view]
    out[0], out[1], out[2] = red * unit, green * unit, blue * unit


@njit(parallel=True, cache=True)
def brightness_of_views(views: RimViews, sides: Sides, missing: Any) -> Any:
    """How bright each view is beside the reference, and how badly it shows the same.

    Parameters
    ----------
    views : RimViews
        Its z-buffers are not looked at.
    sides : Sides
        Some of its clean pixels are looked at.
    missing : ndarray, shape (T, S, H, W) or (T, S, 0, 0), bool
        Pixels that a view does not show; empty: none.

    Returns
    -------
    brightness, residual : ndarray, shape (N,), float64
        Ratio of the sums of the colours; mean absolute difference of one channel, 0..1, that is left, NaN of views that
        show none of the pixels.
    """
    disparity, guide, clean = sides.disparity, sides.guide, sides.clean
    H, W = disparity.shape
    N = len(views.places)
    brightness, residual = np.ones(N), np.zeros(N)
    for view in prange(N):
        # of each pixel that the view shows: its colours there, and the reference's
        shown = np.empty((((H - 1) // _STRIDE + 1) * ((W - 1) // _STRIDE + 1), 2, 3))
        of_view = missing[views.places[view, 0], views.places[view, 1]]
        own, other, rest, n = 1e-9, 1e-9, 0.0, 0
        for y in range(0, H, _STRIDE):
            for x in range(0, W, _STRIDE):
                down = y - disparity[y, x] * views.baselines[view, 0]
                across = x - disparity[y, x] * views.baselines[view, 1]
                if not clean[y, x] or down < 0 or across < 0 or down >= H - 1 or across >= W - 1:
                    continue
                row, column = int(down), int(across)
                if of_view.size > 0 and (
                    of_view[row, column]
                    or of_view[row, column + 1]
                    or of_view[row + 1, column]
                    or of_view[row + 1, column + 1]
                ):
                    continue
                _sample(views, view, row, column, down - row, across - column, shown[n, 0])
                for c in range(3):
                    shown[n, 1, c] = guide[y, x, c]
                    own += shown[n, 1, c]
                    other += shown[n, 0, c]
                n += 1
        brightness[view] = other / own
        for k in range(n):
            for c in range(3):
                rest += min(abs(shown[k, 0, c] / brightness[view] - shown[k, 1, c]), _MOST_DIFFERENCE)
        residual[view] = rest / (3 * n + 1) if n > 0 else np.nan
    return brightness, residual


@njit(forceinline=True, fastmath=EXACT)
def _median(values: Any) -> Any:
    """Median of values, by halving the interval that it lies in: counting vectorises, and sorting does not.

    NumPy's, compiled, would have every process load SciPy's linear algebra.
    """
    n, middle = values.size, values.size // 2
    low = high = values[0]
    for v in range(1, n):
        low, high = min(low, values[v]), max(high, values[v])
    least, below = low, 0
    while below != middle:
        # as many or fewer lie below ``low``
        half = low + (high - low) * np.float32(0.5)
        if half <= low or half >= high:
            break
        below = 0
        for v in range(n):
            below += values[v] < half
        if below <= middle:
            low = half
        else:
            high = half
    after, before, below = high, least, 0
    for v in range(n):
        if values[v] >= low:
            after = min(after, values[v])
    for v in range(n):
        below += values[v] < after
        if values[v] < after:
            before = max(before, values[v])
    # of an even number, the mean of both in the middle
    return after if n % 2 == 1 or below < middle else (before + after) * np.float32(0.5)


@njit(parallel=True, cache=True)
def background_of(views: RimViews, layer: Any, wanted: Any, begin: int, end: int) -> Any:
    """Colours of the more distant surfaces, medians over the views that see them.

    Parameters
    ----------
    views : RimViews
    layer : ndarray, shape (H, W), float32
        Disparity of the more distant surface, also where a nearer one hides it.
    wanted : ndarray, shape (H, W), bool
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
        # not NumPy's: where it is compiled, every process loads SciPy
        columns, few = np.empty(W, np.int64), 0
        for x in range(W):
            if wanted[y, x]:
                columns[few] = x
                few += 1
        samples, ordered = np.empty((few, 3, N), np.float32), np.empty(N, np.float32)
        colour_there = np.empty(3, np.float32)
        # view by view: neighbours are near each other in its memory
        for view in range(N):
            for i in range(few):
                x = columns[i]
                seen, row, column, fy, fx = _sees(views, view, layer[y, x], y, x)
                if seen:
                    _sample(views, view, row, column, fy, fx, colour_there)
                    for c in range(3):
                        samples[i, c, count[y, x]] = colour_there[c]
                    count[y, x] += 1
        for i in range(few):
            x = columns[i]
            n = count[y, x]
            if n < FEWEST_VIEWS:
                continue
            total = 0.0
            for c in range(3):
                for v in range(n):
                    ordered[v] = samples[i, c, v]
                middle = _median(ordered[:n])
                colour[y, x, c] = middle
                for v in range(n):
                    total += min((samples[i, c, v] - middle) ** 2, _MOST_DEVIATION2)
            variance[y, x] = total / (3 * n)
    return Background(colour, variance, count)


@njit(forceinline=True)
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


@njit(forceinline=True)
def _nearer_colour(sides: Sides, near: Any, middle: Any, y: int, x: int, surface: Any) -> Any:
    """Fill in the nearer surface beside a pixel: clean pixels' colour, or else the pixel's own; its variance."""
    H, W = sides.disparity.shape
    radius, out = sides.clean_radius, surface[_OWN]
    weights, squares = 0.0, 0.0
    out[:] = 0
    surface[_LEAST], surface[_MOST] = 1.0, 0.0
    for i in range(max(0, y - radius), min(H, y + radius + 1)):
        for j in range(max(0, x - radius), min(W, x + radius + 1)):
            if sides.disparity[i, j] > middle:
                for c in range(3):
                    surface[_LEAST, c] = min(surface[_LEAST, c], sides.guide[i, j, c])
                    surface[_MOST, c] = max(surface[_MOST, c], sides.guide[i, j, c])
            if sides.clean[i, j] and abs(sides.disparity[i, j] - near) < _SAME_SURFACE:
                weight = 1 / (1 + (i - y) ** 2 + (j - x) ** 2) ** 2
                weights += weight
                for c in range(3):
                    out[c] += weight * sides.guide[i, j, c]
                    squares += weight * sides.guide[i, j, c] ** 2
    if weights == 0:
        out[:] = sides.guide[y, x]
        return _UNKNOWN_DEVIATION**2
    variance = squares / weights
    for c in range(3):
        out[c] /= weights
        variance -= out[c] ** 2
    return (max(variance, 0.0) / 3 + _CLEAN_DEVIATION**2) / _HELD


@njit(forceinline=True)
def _along_near(views: RimViews, background: Background, near: Any, far: Any, y: int, x: int, samples: Any) -> int:
    """What the views show of a pixel that moves with ``near``, and what is behind it there; how many tell both."""
    H, W = background.views.shape
    n = 0
    for view in range(len(views.places)):
        seen, row, column, fy, fx = _sees(views, view, near, y, x)
        # where the background that is there in the view is in the reference view
        down = y - (near - far) * views.baselines[view, 0]
        across = x - (near - far) * views.baselines[view, 1]
        if not seen or down < 0 or across < 0 or down >= H - 1 or across >= W - 1:
            continue
        i, j = int(down), int(across)
        samples[n, _NOISE] = _behind(background, i, j, down - i, across - j, samples[n, _BEHIND:_NOISE])
        if samples[n, _NOISE] >= 0:
            _sample(views, view, row, column, fy, fx, samples[n])
            n += 1
    return n


@njit(forceinline=True)
def _cost_of_share(share: Any, samples: Any, n: int, surface: Any, held: Any, scale2: Any) -> Any:
    """Mean robust residual of ``n`` views that show a share of one colour before the background, 0..1.

    The colour is that which fits best within the surface's limits, and is held near its own with the weight of
    ``held`` views.
    """
    rest = 1 - share
    fit = np.empty(3)
    total = 0.0
    for c in range(3):
        along = 0.0
        for v in range(n):
            along += samples[v, c] - rest * samples[v, _BEHIND + c]
        best = (share * along + held * surface[_OWN, c]) / (share * share * n + held)
        fit[c] = min(max(best, surface[_LEAST, c]), surface[_MOST, c])
        total += held * (fit[c] - surface[_OWN, c]) ** 2 / scale2
    for v in range(n):
        half = scale2 + rest * rest * samples[v, _NOISE]
        for c in range(3):
            residual = (samples[v, c] - share * fit[c] - rest * samples[v, _BEHIND + c]) ** 2
            total += residual / (residual + half)
    return total / (3 * n)


@njit(forceinline=True)
def _cost_alone(views: RimViews, own: Any, d: Any, y: int, x: int, scale2: Any, colour: Any) -> Any:
    """Mean robust residual of a pixel of colour ``own (3,)`` that moves with ``d``, over views that see it."""
    total, n = 0.0, 0
    for view in range(len(views.places)):
        if views.baselines[view, 0] == 0 and views.baselines[view, 1] == 0:
            # the reference view itself always fits
            continue
        seen, row, column, fy, fx = _sees(views, view, d, y, x)
        if seen:
            _sample(views, view, row, column, fy, fx, colour)
            for c in range(3):
                residual = (colour[c] - own[c]) ** 2
                total += residual / (residual + scale2)
            n += 1
    return total / (3 * n) if n >= FEWEST_VIEWS else _UNKNOWN


@njit(parallel=True, cache=True)
def evidence_of_shares(
    views: RimViews, rim: Rim, background: Background, sides: Sides, scales2: Any, begin: int, end: int, evidence: Any
) -> None:
    """By how much the other surface explains the views better than the one that a pixel has.

    Along the nearer surface's disparity each view shows the same share of that surface before another piece of
    background. More than half is near, less is far.

    Parameters
    ----------
    views : RimViews
    rim : Rim
    background : Background
    sides : Sides
    scales2 : tuple of float
        Square of the residual at which a view counts half: the least, and what the squared difference of both surfaces'
        colours adds to it, times this; errors of samples grow with it.
    begin, end : int
        Rows that are made.
    evidence : ndarray, shape (H, W), float32
        Filled with differences of mean costs, -1..1; left alone where the views do not tell.
    """
    W = sides.disparity.shape[1]
    N = len(views.places)
    for y in prange(begin, end):
        samples, surface, colour = np.empty((N, 7)), np.empty((3, 3)), np.empty(3)
        for x in range(W):
            if not rim.inside[y, x]:
                continue
            near, far = rim.near[y, x], rim.far[y, x]
            n = _along_near(views, background, near, far, y, x, samples)
            if n < FEWEST_SAMPLES:
                continue
            variance = _nearer_colour(sides, near, (near + far) / 2, y, x, surface)
            if rim.is_near[y, x]:
                # surfaces get darker or brighter towards their edge: to be far, a pixel must be so whatever its colour.
                # To be near it must have the surface's colour: before a bare background, any is a share of another
                variance = _FREE_DEVIATION**2
            apart2 = 0.0
            for v in range(n):
                for c in range(3):
                    apart2 += (surface[_OWN, c] - samples[v, _BEHIND + c]) ** 2
            scale2 = scales2[0] + scales2[1] * apart2 / (3 * n)
            low = high = _UNKNOWN
            for k in range(SHARES):
                share = k / (SHARES - 1)
                cost = _cost_of_share(share, samples, n, surface, scale2 / variance, scale2)
                if 2 * k < SHARES - 1:
                    low = min(low, cost)
                else:
                    high = min(high, cost)
            if rim.is_near[y, x]:
                evidence[y, x] = high - low
            else:
                alone = _cost_alone(views, sides.guide[y, x], far, y, x, scale2, colour)
                evidence[y, x] = min(low, alone) - high
