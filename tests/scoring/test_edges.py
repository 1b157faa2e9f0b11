"""Depth discontinuities for evaluation: where they are, and to which side of them an estimate errs."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from sepi.io.disparity_maps import read_pfm
from sepi.io.scores import Scores
from sepi.report.scores import edge_budget
from sepi.scoring.regions import LEAST_DISCONTINUITY, REACH, edges_of, fattening_and_thinning
from sepi.scoring.scores import score

SQUARE = np.zeros((30, 40), np.float32)
SQUARE[10:20, 12:28] = 1
EVERYWHERE = np.ones(SQUARE.shape, bool)


def grown(by: int) -> np.ndarray:
    """The square, its outline moved outwards."""
    moved = np.zeros_like(SQUARE)
    moved[10 - by : 20 + by, 12 - by : 28 + by] = 1
    return moved


def plain(ground_truth: np.ndarray, estimate: np.ndarray) -> tuple[np.ndarray, list[bool], list[bool]]:
    """The region, and for the pixels of its background and foreground whether they are on the wrong side: in words."""
    height, width = ground_truth.shape

    def has_step(y: int, x: int) -> bool:
        beside = [(y - 1, x), (y + 1, x), (y, x - 1), (y, x + 1)]
        values = [ground_truth[q] for q in beside if 0 <= q[0] < height and 0 <= q[1] < width]
        return any(abs(value - ground_truth[y, x]) > LEAST_DISCONTINUITY for value in values if np.isfinite(value))

    region, background, foreground = np.zeros(ground_truth.shape, bool), [], []
    for y, x in np.ndindex(height, width):
        near = [(v, u) for v in range(y - 1, y + 2) for u in range(x - 1, x + 2) if 0 <= v < height and 0 <= u < width]
        region[y, x] = np.isfinite(ground_truth[y, x]) and any(has_step(*q) for q in near)
        if region[y, x]:
            window = ground_truth[max(0, y - REACH) : y + REACH + 1, max(0, x - REACH) : x + REACH + 1]
            known = window[np.isfinite(window)]
            middle = (known.max() + known.min()) / 2
            if ground_truth[y, x] > middle:
                foreground.append(bool(estimate[y, x] < middle))
            else:
                background.append(bool(estimate[y, x] > middle))
    return region, background, foreground


@pytest.mark.parametrize("by", [-2, -1, 0, 1, 2])
def test_a_moved_outline_is_fat_or_thin_and_not_both(by: int) -> None:
    """Someone reads from the two which way the edges of a method err."""
    fattening, thinning = fattening_and_thinning(grown(by), edges_of(SQUARE), EVERYWHERE)
    assert (fattening > 0) == (by > 0)
    assert (thinning > 0) == (by < 0)
    if abs(by) == REACH:
        assert max(fattening, thinning) == 100


def test_slanted_surfaces_have_no_discontinuity() -> None:
    """A floor that runs away from the camera is no edge."""
    floor = 0.12 * np.arange(30, dtype=np.float32)[:, None] * np.ones((1, 20), np.float32)
    assert not edges_of(floor).region.any()
    assert np.isnan(fattening_and_thinning(floor, edges_of(floor), np.ones(floor.shape, bool))).all()
    assert edges_of(floor * 1.1).region.all()


def test_equals_a_plain_twin() -> None:
    """With slanted surfaces, several steps in a window, and holes in ground truth and estimate."""
    random = np.random.default_rng(4)
    ground_truth = np.repeat(np.repeat(random.normal(size=(5, 6)), 4, 0), 4, 1).astype(np.float32)
    ground_truth += np.float32(0.02) * np.arange(24, dtype=np.float32)
    estimate = (ground_truth + random.normal(scale=0.5, size=ground_truth.shape)).astype(np.float32)
    ground_truth[random.random(ground_truth.shape) < 0.1] = np.nan
    ground_truth[3, 4] = np.inf
    estimate[random.random(ground_truth.shape) < 0.1] = np.nan
    edges = edges_of(ground_truth)
    region, background, foreground = plain(ground_truth, estimate)
    np.testing.assert_array_equal(edges.region, region)
    found = fattening_and_thinning(estimate, edges, np.ones(region.shape, bool))
    assert found == pytest.approx((100 * np.mean(background), 100 * np.mean(foreground)))
    scores = score(estimate, ground_truth)
    assert (scores["fattening"], scores["thinning"]) == pytest.approx(found)


def budget(whole: Scores, there: Scores) -> pd.Series:
    return edge_budget(*(pd.DataFrame([one]) for one in (whole, there))).iloc[0]


def test_the_budget_adds_up() -> None:
    """What lies there and what lies away are the whole, or the table's shares mislead."""
    random = np.random.default_rng(5)
    estimate = (grown(1) + random.normal(scale=0.05, size=SQUARE.shape)).astype(np.float32)
    estimate[2, 3] = estimate[10, 15] = np.nan
    region = edges_of(SQUARE).region
    there, away = score(estimate, SQUARE, region=region), score(estimate, SQUARE, region=~region)
    found = budget(score(estimate, SQUARE), there)
    assert found["area"] == pytest.approx(100 * region.mean())
    assert found["mse100_away"] == pytest.approx(away["mse100"])
    assert found["badpix007_away"] == pytest.approx(away["badpix007"])
    squares = np.nan_to_num(estimate - SQUARE) ** 2
    assert found["squared_error"] == pytest.approx(100 * squares[region].sum() / squares.sum())


@pytest.mark.real
@pytest.mark.parametrize(("name", "area"), [("cotton", 3.6), ("antinous", 4.1)])
def test_real_scenes_have_thin_bands(hci: Path, name: str, area: float) -> None:
    """Slanted floors and walls would show as a larger part of the picture."""
    ground_truth = read_pfm(hci / name / "gt_disp_lowres.pfm")
    assert 100 * edges_of(ground_truth).region.mean() == pytest.approx(area, abs=0.1)
