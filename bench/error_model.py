"""Fit of the error model (:mod:`sepi.error_bars`) by maximum likelihood, and its evaluation on left-out scenes.

Every light field and variant has the same weight. Powers are weakly regularised towards 0, in units of the variation of
their cue's logarithm. A cue that rests at its least value on most scenes can be added without moving the bars of these:
its powers alone are fitted.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.optimize import minimize

from bench.error_samples import Sample
from sepi.error_bars.bars import TAIL, mixture_of
from sepi.error_bars.calibration import CONSTANT, Calibration
from sepi.error_bars.cues import FLOORS
from sepi.error_bars.mixture import LEAST_RIM, RIM_WIDTH, described
from sepi.scoring.error_bars import ause, reliability
from sepi.stage import CLOSE

FloatArray = npt.NDArray[np.float64]

PULL = 1e-3
"""Weight of the sum of squared powers relative to the mean likelihood of a pixel."""

_PARTS = ("scale", "outlier_scale", "outlier", "rim")
_CLIP = 12.0


class Judged(NamedTuple):
    """Scores of a calibration on a sample.

    Attributes
    ----------
    coverage, width : float
        Share of the errors within the interval, %, and its median width, pixels per view step.
    ause, ause_smooth : float
        Area under the sparsification error curve (:func:`sepi.scoring.error_bars.ause`) by the standard deviation, and
        by the smoothness of the map and the information of the views.
    """

    coverage: float
    width: float
    ause: float
    ause_smooth: float


def fitted(samples: Sequence[Sample], form: Calibration, only: Collection[str] = ()) -> Calibration:
    """The calibration with the same cues as ``form`` that maximises the likelihood of the errors.

    Of cues ``only``, the powers alone are fitted, from 0 up: where these have their least values, nothing changes.
    """
    names = [list(part) for part in form]
    columns = [np.concatenate([_columns(one, part) for one in samples]) for part in names]
    middle, spread = _scaling(columns, names, only)
    designs = [(column - m) / s for column, m, s in zip(columns, middle, spread, strict=True)]
    data = _Data(
        np.concatenate([one.error for one in samples]),
        np.concatenate([one.cues["above"] for one in samples]),
        np.concatenate([one.cues["below"] for one in samples]),
        np.concatenate([np.full(one.error.size, one.step**2 / 12) for one in samples]),
        np.concatenate([np.full(one.error.size, 1 / (one.error.size * len(samples))) for one in samples]),
    )
    start = [
        np.append(first, np.zeros(len(part) - 1)) for first, part in zip((-5.0, -2.0, -2.0, -3.0), names, strict=True)
    ]
    bounds: list[tuple[float | None, float | None]] = [(None, None)] * sum(map(len, names))
    if only:
        start = [np.array(list(part.values())) * s for part, s in zip(form, spread, strict=True)]
        for values, m, s, part in zip(start, middle, spread, names, strict=True):
            values[0] += values[1:] @ (m / s)[1:]
            values[[label in only for label in part]] = 0
        free = [label in only for part in names for label in part]
        bounds = [(0, None) if one else (value, value) for one, value in zip(free, np.concatenate(start), strict=True)]
    pulled = [np.arange(len(part)) > 0 for part in names]
    ends = np.cumsum([len(part) for part in names])[:-1]

    def loss(all_powers: FloatArray) -> tuple[float, FloatArray]:
        powers = np.split(all_powers, ends)
        value, slopes = _likelihood(designs, powers, data)
        value += PULL * sum(float(np.sum(p[on] ** 2)) for p, on in zip(powers, pulled, strict=True))
        slopes = [g + 2 * PULL * p * on for g, p, on in zip(slopes, powers, pulled, strict=True)]
        return value, np.concatenate(slopes)

    options = {"maxiter": 500}
    found = minimize(loss, np.concatenate(start), jac=True, method="L-BFGS-B", bounds=bounds, options=options).x
    parts: list[dict[str, float]] = []
    for labels, powers, m, s in zip(names, np.split(found, ends), middle, spread, strict=True):
        raw = powers / s
        raw[0] = powers[0] - float(np.sum(raw[1:] * m[1:]))
        parts.append({label: round(float(value), 3) for label, value in zip(labels, raw, strict=True)})
    scale, outlier_scale, outlier, rim = parts
    return Calibration(scale, outlier_scale, outlier, rim)


def judged(one: Sample, calibration: Calibration) -> Judged:
    """Scores of a calibration on a sample; intervals are not limited to the disparity range here."""
    bars = described(mixture_of(_pictures(one), calibration), TAIL, CLOSE)
    margin = one.step / 2
    held = (one.error <= bars.above[0] + margin) & (one.error >= -bars.below[0] - margin)
    width = float(np.median(bars.above + bars.below))
    doubts = bars.sigma[0], (1 - one.cues["smooth_confidence"]).astype(np.float32)
    orders = [ause(doubt, one.error.astype(np.float32)) for doubt in doubts]
    return Judged(100 * float(held.mean()), width, *orders)


def judgements(samples: Sequence[Sample], fits: Mapping[str, Calibration], other: Calibration) -> list[dict[str, str]]:
    """A row for each light field, with the calibration of its scene or ``other``."""
    rows: dict[str, dict[str, str]] = {}
    for one in samples:
        found = judged(one, fits.get(one.world, other))
        row = rows.setdefault(one.name, {"light field": one.name})
        row[f"`{one.variant}`, coverage %"] = f"{found.coverage:.1f}"
        row.setdefault("width", f"{found.width:.3f}")
        row.setdefault("AUSE by `sigma` / by smoothness", f"{found.ause:.2f} / {found.ause_smooth:.2f}")
    return list(rows.values())


def pooled(samples: Sequence[Sample], calibration: Calibration) -> dict[str, str]:
    """All samples together: mean and range of coverage, reliability of confidences, and ranking of errors."""
    worth = [judged(one, calibration) for one in samples]
    ratios = np.array([one.ause / one.ause_smooth for one in worth])
    confidences = [described(mixture_of(_pictures(one), calibration), TAIL, CLOSE).probability[0] for one in samples]
    error = np.concatenate([one.error for one in samples]).astype(np.float32)
    tenths = reliability(np.concatenate(confidences), error, CLOSE)
    coverages = [one.coverage for one in worth]
    said, found = tenths.said, tenths.found
    off = np.where(tenths.enough, np.abs(found - said), 0)
    worst = int(off.argmax())
    return {
        "coverage, mean % (range)": f"{np.mean(coverages):.1f} ({min(coverages):.1f} to {max(coverages):.1f})",
        "`confidence` off by at most": f"{off[worst]:.2f} ({said[worst]:.2f} said, {found[worst]:.2f} found)",
        "AUSE by `sigma`, of that by smoothness": f"{np.exp(np.log(ratios).mean()):.2f}",
    }


def left_out(samples: Sequence[Sample], form: Calibration, only: Collection[str] = ()) -> dict[str, Calibration]:
    """Scene to the calibration that is fitted to all other scenes."""
    worlds = dict.fromkeys(one.world for one in samples)
    return {world: fitted([one for one in samples if one.world != world], form, only) for world in worlds}


def as_code(name: str, calibration: Calibration) -> str:
    """The calibration as code for ``sepi/error_bars/calibration.py``."""

    def written(part: Mapping[str, float]) -> str:
        inner = "".join(f'        "{key}": {value!r},\n' for key, value in part.items())
        return "{\n" + inner.replace(f'"{CONSTANT}"', "CONSTANT") + "    }"

    parts = "".join(f"    {part}={written(getattr(calibration, part))},\n" for part in _PARTS)
    return f"{name} = Calibration(\n{parts})"


class _Data(NamedTuple):
    """Errors, distances of other surfaces, variance of the rounding of ground truth, and weights; shapes (N,)."""

    error: FloatArray
    above: FloatArray
    below: FloatArray
    rounding: FloatArray
    weight: FloatArray


def _pictures(one: Sample) -> dict[str, npt.NDArray[np.float32]]:
    return {name: values[None].astype(np.float32) for name, values in one.cues.items()}


def _columns(one: Sample, part: Sequence[str]) -> FloatArray:
    columns = [np.log(np.maximum(one.cues[name], FLOORS[name])) for name in part if name != CONSTANT]
    return np.stack([np.ones(one.error.size), *columns], axis=1)


def _scaling(
    columns: Sequence[FloatArray], names: Sequence[Sequence[str]], only: Collection[str]
) -> tuple[list[FloatArray], list[FloatArray]]:
    middle, spread = [column.mean(axis=0) for column in columns], [column.std(axis=0) + 1e-6 for column in columns]
    if only:
        middle = [np.array([np.log(FLOORS.get(label, 1.0)) for label in part]) for part in names]
    for m, s in zip(middle, spread, strict=True):
        m[0], s[0] = 0, 1
    return middle, spread


def _likelihood(
    designs: Sequence[FloatArray], powers: Sequence[FloatArray], data: _Data
) -> tuple[float, list[FloatArray]]:
    """Negative log likelihood, mean over the pixels, and its derivatives by the powers."""
    linear = [np.clip(design @ power, -_CLIP, _CLIP) for design, power in zip(designs, powers, strict=True)]
    scale, outlier_scale, outlier, rim = np.exp(linear)
    whole = 1 + outlier + rim
    outlier, rim = outlier / whole, rim / whole
    size = np.abs(data.error)
    wide = np.sqrt(scale**2 + data.rounding)
    core = (1 - outlier - rim) * np.exp(-size / wide) / (2 * wide)
    outlying = outlier * np.exp(-size / outlier_scale) / (2 * outlier_scale)
    other = rim * _density_of_rims(data)
    total = core + outlying + other + 1e-12
    slopes: list[Any] = [
        -core * (size / wide - 1) * (scale / wide) ** 2 / total,
        -outlying * (size / outlier_scale - 1) / total,
        outlier - outlying / total,
        rim - other / total,
    ]
    value = -float(np.sum(data.weight * np.log(total)))
    return value, [design.T @ (slope * data.weight) for design, slope in zip(designs, slopes, strict=True)]


def _density_of_rims(data: _Data) -> FloatArray:
    share = (data.above**2 + 1e-6) / (data.above**2 + data.below**2 + 2e-6)
    up, down = RIM_WIDTH * data.above + LEAST_RIM, RIM_WIDTH * data.below + LEAST_RIM
    nearer = np.exp(-np.abs(data.error - data.above) / up) / (2 * up)
    return np.asarray(share * nearer + (1 - share) * np.exp(-np.abs(data.error + data.below) / down) / (2 * down))
