"""Straight edges through the pixels beside a depth step: exact on exact edges, and equal to a plain twin."""

import itertools
import math

import numpy as np
import numpy.typing as npt
import pytest

from sepi.boundaries.edge_lines import line_evidence
from sepi.boundaries.rim import rim_of

SHARES = np.linspace(0, 1, 12, dtype=np.float32)


def twin(
    disparity: npt.NDArray[np.float32], middle: npt.NDArray[np.float32], number: npt.NDArray[np.int64],
    costs: npt.NDArray[np.float32], y: int, x: int,
) -> float:  # fmt: skip
    """Least cost of all edges with the middle on the near side, less that of those with it on the far side."""
    best = {True: math.inf, False: math.inf}
    for direction, (curvature, of_edge) in itertools.product(range(16), ((0.0, 0.0), (0.6, 0.003))):
        angle = 2 * math.pi * direction / 16
        for offset in (-1.05, -0.75, -0.45, -0.15, 0.15, 0.45, 0.75, 1.05):
            total = of_edge
            for dy, dx in np.ndindex(3, 3):
                row, column = y + dy - 1, x + dx - 1
                if not (0 <= row < disparity.shape[0] and 0 <= column < disparity.shape[1]):
                    continue
                distance = offset + math.sin(angle) * (dy - 1) + math.cos(angle) * (dx - 1)
                distance -= curvature * (math.cos(angle) * (dy - 1) - math.sin(angle) * (dx - 1)) ** 2 / 2
                share = round(33 * min(max(0.5 + distance / 1.2, 0), 1)) / 33
                if number[row, column] < 0:
                    cost = 0.3 * (1 - share if disparity[row, column] > middle[y, x] else share)
                else:
                    own = costs[number[row, column]] - costs[number[row, column]].min()
                    cost = float(np.interp(share, SHARES, own))
                    if (dy, dx) != (1, 1):
                        cost = min(cost, 0.2)
                total += math.exp(-((dy - 1) ** 2 + (dx - 1) ** 2) / (2 * 0.8**2)) * cost
            best[offset > 0] = min(best[offset > 0], total)
    return best[True] - best[False]


def test_kernel_equals_a_plain_twin() -> None:
    """Also at the border of the picture, and where pixels away from all steps are in the patch."""
    random = np.random.default_rng(1)
    disparity = np.zeros((9, 11), np.float32)
    disparity[:5, 3:8] = 1
    rim = rim_of(disparity, 1, 0.3)
    assert rim.inside[0].any()
    costs = random.random((int(rim.inside.sum()), len(SHARES)), np.float32)
    number = np.full(disparity.shape, -1)
    number[rim.inside] = np.arange(len(costs))
    middle = (rim.near + rim.far) / 2
    expected = [twin(disparity, middle, number, costs, y, x) for y, x in np.argwhere(rim.inside)]
    np.testing.assert_allclose(line_evidence(disparity, rim, costs), expected, atol=1e-5)


@pytest.mark.parametrize("angle", [0.0, 0.3, 0.8, 1.3, 2.0, 2.7])
@pytest.mark.parametrize("offset", [-0.3, 0.0, 0.4])
def test_an_edge_goes_on_through_pixels_that_views_do_not_tell(angle: float, offset: float) -> None:
    """Every third pixel says nothing of itself, and the map is a pixel too wide: the edge is found all the same."""
    y, x = np.mgrid[:30, :30] - 14.5
    distance = offset + math.sin(angle) * y + math.cos(angle) * x
    near = distance > 0
    disparity = (distance > -1).astype(np.float32)
    rim = rim_of(disparity, 2, 0.3)
    share = np.clip(0.5 + distance / 1.2, 0, 1)[rim.inside]
    costs = ((SHARES - share[:, None]) ** 2).astype(np.float32)
    costs[::3] = 0
    evidence = line_evidence(disparity, rim, costs)
    sure = abs(distance[rim.inside]) > 0.3
    assert ((evidence[sure] < 0) == near[rim.inside][sure]).mean() > 0.98


def test_something_small_and_round_keeps_its_pixels() -> None:
    """A disc of five pixels has no straight edge."""
    y, x = np.mgrid[:15, :15] - 7.0
    distance = 2.5 - np.hypot(y, x)
    disparity = (distance > 0).astype(np.float32)
    rim = rim_of(disparity, 2, 0.3)
    share = np.clip(0.5 + distance / 1.2, 0, 1)[rim.inside]
    evidence = line_evidence(disparity, rim, ((SHARES - share[:, None]) ** 2).astype(np.float32))
    np.testing.assert_array_equal(evidence < 0, disparity[rim.inside] > 0)
