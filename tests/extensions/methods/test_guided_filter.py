"""The guided filter: in each window a linear function of the guide's colours, each pixel the mean over its windows."""

import numpy as np
import pytest

from sepi.extensions.methods.costs import GuidedFilter

RANDOM = np.random.default_rng(4)
GUIDE = RANDOM.uniform(0, 1, (12, 15, 3)).astype(np.float32)
VALUES = RANDOM.normal(0, 1, (12, 15)).astype(np.float32)


def twin(values: np.ndarray, guide: np.ndarray, radius: int, epsilon: float) -> np.ndarray:
    """The ridge regression of each window as it is defined; beyond its border the picture is mirrored."""
    H, W = values.shape
    border = ((radius, radius), (radius, radius))
    colours = np.pad(guide.astype(np.float64), (*border, (0, 0)), mode="symmetric")
    target = np.pad(values.astype(np.float64), border, mode="symmetric")
    slope, offset = np.empty((H, W, 3)), np.empty((H, W))
    for y, x in np.ndindex(H, W):
        window = np.s_[y : y + 2 * radius + 1, x : x + 2 * radius + 1]
        c, t = colours[window].reshape(-1, 3), target[window].ravel()
        centred = c - c.mean(axis=0)
        slope[y, x] = np.linalg.solve(centred.T @ centred / len(t) + epsilon * np.eye(3), centred.T @ t / len(t))
        offset[y, x] = t.mean() - slope[y, x] @ c.mean(axis=0)
    slopes, offsets = np.pad(slope, (*border, (0, 0)), mode="symmetric"), np.pad(offset, border, mode="symmetric")
    out = np.empty((H, W))
    for y, x in np.ndindex(H, W):
        window = np.s_[y : y + 2 * radius + 1, x : x + 2 * radius + 1]
        out[y, x] = slopes[window].reshape(-1, 3).mean(axis=0) @ guide[y, x] + offsets[window].mean()
    return out


@pytest.mark.parametrize("radius", [1, 2, 4])
@pytest.mark.parametrize("epsilon", [1e-4, 0.1])
def test_equals_the_regressions_of_all_windows(radius: int, epsilon: float) -> None:
    """Else filtered costs, and the depths chosen by them, are not those of the publication."""
    found = GuidedFilter(GUIDE, radius, epsilon)(VALUES)
    np.testing.assert_allclose(found, twin(VALUES, GUIDE, radius, epsilon), atol=2e-4)


def test_a_guide_of_hardly_any_contrast_keeps_its_digits() -> None:
    """A bright surface without texture must not bring out rounding errors as depth."""
    guide = np.float32(0.97) + GUIDE * np.float32(0.01)
    found = GuidedFilter(guide, 2, 1e-6)(VALUES)
    np.testing.assert_allclose(found, twin(VALUES, guide, 2, 1e-6), atol=2e-3)
