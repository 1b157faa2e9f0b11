"""Ground truth of another convention is named, and whatever else is wrong with a map is not taken for one."""

import re

import numpy as np
import pytest

from sepi.lightfield import FloatMap
from sepi.scenes import render
from sepi.scoring.conventions import misfit

SHAPE = (64, 80)


def _truth() -> FloatMap:
    """Slanted ground with two things before it; nothing of it is symmetric."""
    y, x = np.indices(SHAPE).astype(np.float32)
    truth = -1 + 0.01 * y + 0.004 * x
    truth[8:30, 10:40] = 0.5 + 0.01 * x[8:30, 10:40]
    truth[35:60, 50:75] = 2
    return truth.astype(np.float32)


def _estimate(noise: float = 0.03) -> FloatMap:
    """A map like those of the method: a twentieth of it is wrong."""
    rng = np.random.default_rng(1)
    found = _truth() + rng.normal(0, noise, SHAPE)
    wrong = rng.random(SHAPE) < 0.05
    return np.where(wrong, rng.uniform(-1, 2, SHAPE), found).astype(np.float32)


@pytest.mark.parametrize(
    ("truth", "told"),
    [
        (_truth()[::-1], "upside down"),
        (_truth()[:, ::-1], "mirrored"),
        (_truth()[::-1, ::-1], "180 degrees"),
        (-_truth(), "sign turned"),
        (4 * _truth(), r"0\.25, as one in steps of the whole grid \(--truth FILE --truth-scale 0\.25\)"),
        (_truth() / 3, r"multiplied by 3\b(?!.*whole grid)"),
        (-4 * _truth(), "sign turned .* and multiplied by 0.25"),
        (_truth() + 1.5, r"as (1|0\.99\d|1\.0\d) \* it -1\.[45]"),
        (8 / (_truth() + 3.2), r"as depth, (8|7\.9\d|8\.0\d) / it -3\.[12]"),
        (np.where(np.indices(SHAPE)[0] < 12, 0, _truth()), "without its zeros, 19 % of it"),
    ],
)
def test_what_the_truth_is_instead_is_named(truth: FloatMap, told: str) -> None:
    said = misfit(_estimate(), truth.astype(np.float32), (5, 5))
    assert re.search(told, said), said


def test_a_map_of_a_part_is_held_against_that_part() -> None:
    """What the map does not have tells nothing, be it zero in the truth or not finite."""
    estimate, truth = _estimate(), 2 * np.abs(_truth())
    estimate[:, :20] = np.nan
    truth[:, :10] = 0
    truth[50:] = np.inf
    said = misfit(np.abs(estimate), truth, None)
    assert re.match(r"multiplied by 0\.(5|49\d|50\d) ", said), said
    assert misfit(estimate, np.full(SHAPE, np.nan, np.float32)) is None


@pytest.mark.parametrize(
    "estimate",
    [
        _estimate(),
        _estimate(0.5),
        _truth() + np.float32(0.06),
        np.roll(_truth(), 9, axis=1),
        np.zeros(SHAPE, np.float32),
        np.random.default_rng(0).normal(size=SHAPE).astype(np.float32),
        np.clip(_truth(), -0.5, 0.6),
    ],
)
def test_a_poor_map_is_no_doubt_of_the_truth(estimate: FloatMap) -> None:
    assert misfit(estimate, _truth(), (5, 5)) is None


def test_a_scene_that_is_zero_in_focus_has_no_unknown_pixels() -> None:
    """A wall at the focus distance is zero, and a map that fits there says that it is one."""
    truth = render("fronto_parallel", size=64, views=3).ground_truth
    truth = np.where(truth < np.median(truth), np.float32(0), truth)
    assert misfit(truth + np.float32(0.01), truth) is None
