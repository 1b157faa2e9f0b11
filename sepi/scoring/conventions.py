"""Ground truth of another convention than a map's: upside down, of the other sign or scale, or depth."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from sepi.lightfield import BoolMap, FloatMap

# errors are close up to this part of the range that nearly all of a map lies within, or so many pixels per view step
_PART, _LEAST = 0.05, 0.07
# share of pixels with a larger error from which a fit is in doubt, and how much better another must be
_POOR, _BETTER = 0.2, 0.25
# rounds of reweighting, of so many pixels
_ROUNDS, _PIXELS = 30, 20000


def misfit(estimate: FloatMap, truth: FloatMap, grid: tuple[int, int] | None = None) -> str | None:
    """How ground truth would fit a map far better than as it is.

    Parameters
    ----------
    estimate, truth : ndarray, shape (H, W), float32
        Pixels per view step; what is not finite is unknown.
    grid : (int, int), optional
        Rows and columns of views.

    Returns
    -------
    str or None
        None where it fits, or nothing tried fits far better.

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

    def missed(values: FloatMap, where: BoolMap = known) -> npt.NDArray[np.float32]:
        return np.minimum(np.abs(estimate - values)[where & np.isfinite(values)] / close, 1)

    def off(values: FloatMap, where: BoolMap = known) -> float:
        return float(np.mean(missed(values, where) == 1)) if where.any() else 1.0

    as_it_is, zero = off(truth), known & (truth == 0)
    if as_it_is < _POOR:
        return None
    if off(truth, zero) > 1 - _POOR and off(truth, known & ~zero) < _BETTER * as_it_is:
        return f"without its zeros, {100 * zero.sum() / known.sum():.0f} % of it; where 0 is unknown, NaN says so"
    tried = {
        "upside down (a PFM begins with its bottom row)": truth[::-1],
        "mirrored": truth[:, ::-1],
        "turned by half a turn": truth[::-1, ::-1],
    }
    for values in (truth, 1 / truth) if (truth[known] > 0).all() else (truth,):
        factor, more = _line(values[known], estimate[known])
        if abs(factor) * float(np.ptp(values[known])) > close:
            tried[_line_text(factor, more, close, values is not truth, grid)] = factor * values + more
    how = min(tried, key=lambda name: (round(off(tried[name]), 2), float(missed(tried[name]).mean())))
    return how if off(tried[how]) < _BETTER * as_it_is else None


def _line(values: FloatMap, wanted: FloatMap) -> tuple[float, float]:
    """Factor and summand that bring most values closest to what is wanted: least absolute deviations."""
    every = max(1, len(values) // _PIXELS)
    x, y = values[::every].astype(np.float64), wanted[::every].astype(np.float64)
    weights, design = np.ones(len(x)), np.column_stack([x, np.ones(len(x))])
    for _ in range(_ROUNDS):
        found = np.linalg.lstsq(design * weights[:, None], y * weights, rcond=None)[0]
        weights = 1 / np.sqrt(np.maximum(np.abs(y - design @ found), 1e-4))
    return float(found[0]), float(found[1])


def _line_text(factor: float, more: float, close: float, inverse: bool, grid: tuple[int, int] | None) -> str:
    if inverse:
        return f"as depth, {factor:.3g} / it {more:+.3g}; disparity in pixels per view step is expected"
    if abs(more) > close:
        return f"as {factor:.3g} * it {more:+.3g}; disparity is 0 in focus, and in pixels per view step"
    if abs(factor + 1) < _PART:
        return "with its sign turned; disparity is greater where the scene is nearer"
    steps = () if grid is None else (grid[1] - 1, grid[1], grid[0] - 1, grid[0])
    whole = ", as one in steps of the whole grid" if any(abs(abs(factor) * n - 1) < _PART for n in steps) else ""
    return f"multiplied by {factor:.3g}{whole} (--truth FILE --truth-scale {factor:.3g})"
