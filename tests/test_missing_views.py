"""Light fields without some of their views: a cross or a star of cameras, dark or damaged views left out."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from sepi.inspection.disparity_range import estimate_range
from sepi.lightfield import LightField
from sepi.pipeline import estimate_depth
from sepi.scenes import render
from sepi.scoring.scores import score
from sepi.variants import compared_methods

pytestmark = pytest.mark.slow

# those that have a choice, or a way through it, that no other has; the rest leave parts of these out
DIFFERENT = ("paper", "no_sepi", "wang", "best", "best_no_detail", "fast", *compared_methods())
# so many that quick variants look at some of them only
VIEWS = 7
C = VIEWS // 2
T, S = np.mgrid[:VIEWS, :VIEWS]
SHAPES = {
    "cross": (T == C) | (S == C),
    "star": (T == C) | (S == C) | (T == S) | (T + S == 2 * C),
    "row": T == C,
    "upper left": (T <= C) & (S <= C),
    "diagonals": (T == S) | (T + S == 2 * C),
}


@cache
def scene() -> LightField:
    whole = render("pyramids", size=64, views=VIEWS)
    views, truth = whole.views[:, :, 8:56, 8:56].copy(), whole.ground_truth[8:56, 8:56].copy()
    return replace(whole, views=views, ground_truth=truth, masks={})


def without(light_field: LightField, present: np.ndarray, filling: int = 0) -> LightField:
    views = np.where(present[:, :, None, None, None], light_field.views, filling).astype(light_field.views.dtype)
    return replace(light_field, views=views, present=present)


def disparity_of(light_field: LightField, variant: str) -> np.ndarray:
    few = {} if variant == "no_sepi" else {"initial": {"num_disparities": 61}}
    return estimate_depth(light_field, variant, few).disparity


@cache
def whole_mse(variant: str) -> float:
    return score(disparity_of(scene(), variant), scene().ground_truth)["mse100"]


@cache
def disparity_without(shape: str, variant: str) -> np.ndarray:
    """Of the scene whose missing views are black."""
    return disparity_of(without(scene(), SHAPES[shape]), variant)


# compared methods are slow, and look at all views, or at those of a row and a column; no_sepi at these alone
@pytest.mark.parametrize(
    ("shape", "variant"),
    [(s, v) for s in SHAPES for v in DIFFERENT if v not in compared_methods() or s in ("star", "row", "diagonals")
     if (s, v) != ("diagonals", "no_sepi")],
)  # fmt: skip
def test_every_variant_does_without_some_views(shape: str, variant: str) -> None:
    """A stage that counts on the full grid would fail here, or give a map that is far worse."""
    disparity = disparity_without(shape, variant)
    assert np.isfinite(disparity).all()
    assert score(disparity, scene().ground_truth)["mse100"] <= 2.5 * whole_mse(variant) + 1


@pytest.mark.parametrize("variant", DIFFERENT)
def test_what_missing_views_hold_is_never_used(variant: str) -> None:
    """A view is left out because it is dark or damaged; it must not shine through."""
    bright = disparity_of(without(scene(), SHAPES["star"], filling=255), variant)
    np.testing.assert_array_equal(disparity_without("star", variant), bright)


@pytest.mark.parametrize("shape", SHAPES)
def test_range_is_estimated_without_some_views(shape: str) -> None:
    whole = render("pyramids", size=96, views=VIEWS)
    known = estimate_range(without(whole, SHAPES[shape]))
    assert known.minimum <= whole.ground_truth.min() + 0.05
    assert known.maximum >= whole.ground_truth.max() - 0.05
    assert known.maximum - known.minimum < 3 * (whole.ground_truth.max() - whole.ground_truth.min())
