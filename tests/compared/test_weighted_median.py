"""The weighted median: the value at which half of a window's weight lies below, and no other."""

import numpy as np
import pytest

from sepi.compared.weighted_median import weighted_median

RANDOM = np.random.default_rng(3)
VALUES = RANDOM.normal(0, 1, (11, 14)).astype(np.float32)
GUIDE = RANDOM.uniform(0, 1, (11, 14, 3)).astype(np.float32)
WEIGHT = RANDOM.uniform(0, 1, (11, 14)).astype(np.float32)
ONES = np.ones((11, 14), np.float32)


def twin(values: np.ndarray, guide: np.ndarray, radius: int, sigma: float, weight: np.ndarray) -> np.ndarray:
    """The same, window by window."""
    out = values.copy()
    for y, x in np.ndindex(values.shape):
        window = np.s_[max(0, y - radius) : y + radius + 1, max(0, x - radius) : x + radius + 1]
        distance = ((guide[window].astype(np.float64) - guide[y, x]) ** 2).sum(axis=2)
        weights = (weight[window] * np.exp(-0.5 * distance / sigma**2)).ravel()
        if weights.sum() > 0:
            order = np.argsort(values[window].ravel())
            share = np.cumsum(weights[order]) / weights.sum()
            out[y, x] = values[window].ravel()[order[np.argmax(share >= 0.5)]]
    return out


@pytest.mark.parametrize("radius", [1, 2, 20])
@pytest.mark.parametrize("sigma", [0.1, 1.0])
def test_each_pixel_is_the_weighted_median_of_its_window(radius: int, sigma: float) -> None:
    """Else a filtered depth map holds depths that the pixels around do not have; windows are cut at borders, and may
    be wider than the picture.
    """
    found = weighted_median(VALUES, GUIDE, radius, sigma, WEIGHT)
    np.testing.assert_array_equal(found, twin(VALUES, GUIDE, radius, sigma, WEIGHT))


def test_equal_colours_and_weights_give_the_median() -> None:
    found = weighted_median(VALUES, np.zeros_like(GUIDE), 1, 0.1, ONES)
    assert found[5, 5] == np.median(VALUES[4:7, 4:7])
    # four pixels in the corner: the lower of the two in the middle
    assert found[0, 0] == np.sort(VALUES[:2, :2].ravel())[1]


def test_radius_0_changes_nothing() -> None:
    np.testing.assert_array_equal(weighted_median(VALUES, GUIDE, 0, 0.1, WEIGHT), VALUES)


def test_windows_without_weight_keep_their_value() -> None:
    """Where no pixel around is trusted, the map stays as it is, finite."""
    weight = ONES.copy()
    weight[:, :9] = 0
    found = weighted_median(VALUES, GUIDE, 2, 0.5, weight)
    np.testing.assert_array_equal(found[:, :7], VALUES[:, :7])
    np.testing.assert_array_equal(found, twin(VALUES, GUIDE, 2, 0.5, weight))


def test_a_pixel_of_no_weight_takes_a_trusted_value() -> None:
    """An outlier of no confidence must not stay because it lies in the middle of its window."""
    values, weight = np.full((7, 7), 0.25, np.float32), np.ones((7, 7), np.float32)
    values[3, 3], weight[3, 3] = 9, 0
    np.testing.assert_array_equal(weighted_median(values, np.zeros((7, 7, 3), np.float32), 1, 0.1, weight), 0.25)


def test_an_edge_of_the_guide_parts_the_windows() -> None:
    """The depth of one surface must not be replaced with that of its neighbour of another colour."""
    values = np.zeros((9, 12), np.float32)
    values[:, 6:] = 1
    guide = np.repeat(values[..., None], 3, axis=2)
    values[4, 7] = -5
    found = weighted_median(values, guide, 3, 0.05, np.ones_like(values))
    np.testing.assert_array_equal(found, guide[..., 0])
