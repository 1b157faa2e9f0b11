"""Detects ground truth in a different convention from a map's: upside down, other sign or scale, or depth."""

from __future__ import annotations

import numpy as np

from sepi.camera.rig import Floats
from sepi.lightfield import BoolMap, FloatMap

# largest error that is close: fraction of the map's range (2nd to 98th percentile), and minimum in pixels per view step
_PART, _LEAST = 0.1, 0.07
# share of larger errors from which the fit is doubted, and the factor by which another fit must reduce it
_POOR, _BETTER = 0.2, 0.25
# tolerance for recognising a factor
_EQUAL = 0.05
# soft error limit of the line fit in pixels per view step, and the number of pixels that it uses
_CLOSE, _PIXELS = 0.003, 20000


def misfit(estimate: FloatMap, truth: FloatMap, grid: tuple[int, int] | None = None) -> str | None:
    """Conversion with which ground truth would fit a map far better.

    Parameters
    ----------
    estimate, truth : ndarray, shape (H, W), float32
        Pixels per view step; non-finite values are unknown.
    grid : (int, int), optional
        Rows and columns of views.

    Returns
    -------
    str or None
        None if the ground truth fits, or no conversion fits far better.

    Examples
    --------
    >>> import numpy as np
    >>> from sepi.scenes import render
    >>> from sepi.scoring.conventions import misfit
    >>> truth = render("pyramids", size=64, views=3).ground_truth
    >>> misfit(truth, truth) is None
    True
    >>> misfit(truth, 2 * truth, (3, 3))
    'multiplied by 0.5, as one in steps of the whole grid (--truth FILE --truth-scale 0.5)'
    """
    known = np.isfinite(estimate) & np.isfinite(truth)
    if not known.any():
        return None
    close = max(_LEAST, _PART * float(np.ptp(np.quantile(estimate[known], (0.02, 0.98)))))

    def off(values: FloatMap, where: BoolMap = known) -> tuple[float, float]:
        missed = np.minimum(np.abs(estimate - values)[where & np.isfinite(values)] / close, 1)
        return (round(float(np.mean(missed == 1)), 2), float(missed.mean())) if missed.size else (1.0, 1.0)

    (as_it_is, _), zero = off(truth), known & (truth == 0)
    if as_it_is < _POOR:
        return None
    if off(truth, zero)[0] > 1 - _POOR and off(truth, known & ~zero)[0] < _BETTER * as_it_is:
        return f"without its zeros, {100 * zero.sum() / known.sum():.0f} % of it; if 0 means unknown, write NaN"
    tried = {
        "upside down (a PFM begins with its bottom row)": truth[::-1],
        "mirrored": truth[:, ::-1],
        "rotated by 180 degrees": truth[::-1, ::-1],
    }
    with np.errstate(divide="ignore"):
        inverse: FloatMap = np.float32(1) / truth
    for values in (truth, inverse) if (truth[known] > 0).all() else (truth,):
        factor, more = _line(values[known], estimate[known])
        if abs(factor) * float(np.ptp(values[known])) > close:
            line = np.float32(factor) * values + np.float32(more)
            tried[_line_text(factor, more, close, values is not truth, grid)] = line
    how = min(tried, key=lambda name: off(tried[name]))
    return how if off(tried[how])[0] < _BETTER * as_it_is else None


def _line(values: FloatMap, wanted: FloatMap) -> tuple[float, float]:
    """Robust linear fit: factor and offset that bring most values close to the wanted ones."""
    from scipy.optimize import least_squares

    every = max(1, len(values) // _PIXELS)
    x, y = values[::every].astype(np.float64), wanted[::every].astype(np.float64)

    def errors(line: Floats) -> Floats:
        return np.asarray(line[0] * x + line[1] - y)

    found = least_squares(errors, (0.0, np.median(y)), x_scale="jac", loss="soft_l1", f_scale=_CLOSE).x
    return float(found[0]), float(found[1])


def _line_text(factor: float, more: float, close: float, inverse: bool, grid: tuple[int, int] | None) -> str:
    if inverse:
        return f"as depth, {factor:.3g} / it {more:+.3g}; expected disparity in pixels per view step"
    if abs(more) > close:
        return f"as {factor:.3g} * it {more:+.3g}; expected disparity in pixels per view step, 0 in focus"
    counts = [count - less for count in grid or () for less in (0, 1)]
    steps = next((n for n in counts if abs(abs(factor) * n - 1) < _EQUAL), None)
    size = f"{1 / steps if steps else abs(factor):.3g}"
    whole = ", as one in steps of the whole grid" if steps else ""
    signs = ["with its sign turned (greater is nearer)"] if factor < 0 else []
    scaled = [f"multiplied by {size}{whole} (--truth FILE --truth-scale {size})"]
    return " and ".join([*signs, *(scaled if abs(abs(factor) - 1) > _EQUAL else [])])
