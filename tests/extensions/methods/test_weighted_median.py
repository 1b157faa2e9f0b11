"""The weighted median: the value at which half of a window's weight lies below, and no other."""

import numpy as np
import pytest

from sepi.extensions.methods.costs import weighted_median

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


def test_windows_without_weight_keep_their_value() -> None:
    """Where no pixel around is trusted, the map stays as it is, finite."""
    weight = ONES.copy()
    weight[:, :9] = 0
    found = weighted_median(VALUES, GUIDE, 2, 0.5, weight)
    np.testing.assert_array_equal(found[:, :7], VALUES[:, :7])
    np.testing.assert_array_equal(found, twin(VALUES, GUIDE, 2, 0.5, weight))
