"""Copies of light fields with added noise or few of their views, and scores of variants on copies with noise."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from bench.allowed import deviations_allowed, scores_allowed
from sepi.lightfield import LightField, full_scale
from sepi.matching.view_noise import view_noise
from sepi.pipeline import estimate_depth
from sepi.scoring.scores import score

Row = dict[str, str]

ALLOWED = {"allowed, alone": 0, "allowed, 5x5": 2}
"""Column of scores that noise allows, to the radius of the window of pixels."""

DIGITS = {"mse100": 2, "q25": 2, "badpix007": 1}
"""Score to its number of decimals."""


NO_NOISE = 1e-9
"""Noise so small that unknown pixels stay unknown."""


def with_noise(light_field: LightField, sigma: float) -> LightField:
    """A copy with white noise of this standard deviation (of 255), rounded and clipped like a camera's.

    Equal arguments give equal bytes.
    """
    views: npt.NDArray[np.generic] = light_field.views
    full = full_scale(views.dtype)
    noise = np.random.default_rng(0).standard_normal(views.shape, np.float32)
    noisy = np.clip(views.astype(np.float32) + sigma / 255 * full * noise, 0, full)
    return replace(light_field, views=(noisy if views.dtype == np.float32 else np.rint(noisy)).astype(views.dtype))


def rows(
    light_fields: Iterable[LightField],
    sigmas: Sequence[float],
    variants: Sequence[str],
    scores: Sequence[str],
    allowed: bool,
) -> Iterator[Row]:
    """A row for each light field and level of noise: scores of each variant, and those that the noise allows."""
    for light_field in light_fields:
        assert light_field.ground_truth is not None
        of_unit_noise = {
            name: deviations_allowed(light_field, 1.0, radius) for name, radius in ALLOWED.items() if allowed
        }
        for sigma in sigmas:
            noisy = with_noise(light_field, sigma) if sigma else light_field
            measured = view_noise(noisy).usual
            row = {"light field": light_field.name + (f" + {sigma:g}" if sigma else "")}
            for variant in variants:
                found = score(estimate_depth(noisy, variant).disparity, light_field.ground_truth)
                row[f"`{variant}`"] = " / ".join(f"{found[name]:.{DIGITS[name]}f}" for name in scores)
            for name, deviations in of_unit_noise.items():
                least = scores_allowed(max(measured, NO_NOISE) * deviations)
                row[name] = f"{least['q25']:.2f} / {least['badpix007']:.1f}"
            yield row


def few_views(light_field: LightField, rows: int, columns: int) -> LightField:
    """So many rows and columns of the views, from the reference view on."""
    t, s = light_field.reference_position
    views = np.ascontiguousarray(light_field.views[t : t + rows, s : s + columns])
    known, truth = light_field.disparity_range, light_field.ground_truth
    return LightField(views, light_field.name, disparity_range=known, view=(0, 0), ground_truth=truth)
