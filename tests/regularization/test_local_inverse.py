"""The variance of a smoothed map against the exact inverse of its system, on small pictures."""

import numpy as np
import pytest
from scipy.sparse import diags

from sepi.regularization.multilevel import MARGIN
from sepi.regularization.second_order import inverse_diagonal, second_difference_stencil

SIZE = 40
INNER = np.s_[7:-7, 7:-7]


def exact_diagonal(weight: np.ndarray, smoothness: list[np.ndarray]) -> np.ndarray:
    """By the dense inverse."""
    stencil = second_difference_stencil(smoothness, weight.shape)[:, MARGIN:-MARGIN, MARGIN:-MARGIN]
    size, width = weight.size, weight.shape[1]
    matrix = diags(stencil[0].ravel() + weight.ravel()).toarray()
    for values, offset in zip(stencil[1:], (1, 2, width, 2 * width, width + 1, width - 1), strict=True):
        entries = values.ravel()[: size - offset]
        matrix += diags([entries, entries], [offset, -offset]).toarray()
    return np.diag(np.linalg.inv(matrix)).reshape(weight.shape)


def pieces(strength: np.ndarray) -> list[np.ndarray]:
    """Weights of the second differences along x, along y and across, by that of each pixel."""
    return [strength[:, 1:-1], strength[1:-1], strength[:-1, :-1]]


@pytest.mark.parametrize("strength", [0.0, 0.3, 7.0, 200.0])
def test_even_weights_have_the_exact_variance(strength: float) -> None:
    weight = np.full((SIZE, SIZE), 0.7, np.float32)
    smoothness = pieces(np.full((SIZE, SIZE), strength))
    found, expected = inverse_diagonal(weight, smoothness), exact_diagonal(weight, smoothness)
    # farther from the ends than a pixel's neighbours count
    middle = np.s_[15:-15, 15:-15]
    np.testing.assert_allclose(found[middle], expected[middle], rtol=0.02)


def test_uneven_weights_have_it_within_a_quarter() -> None:
    """Texture that comes and goes, and an edge across which nothing is smoothed."""
    rng = np.random.default_rng(2)
    y, x = np.mgrid[:SIZE, :SIZE]
    weight = (0.05 + 0.5 * np.cos(x / 7) ** 2 * rng.uniform(0.5, 1, (SIZE, SIZE))).astype(np.float32)
    strength = np.where(np.abs(y - 20) < 2, 0.01, 7 * (0.3 + 0.7 * np.sin(x / 9 + y / 11) ** 2))
    found, expected = (f(weight, pieces(strength))[INNER] for f in (inverse_diagonal, exact_diagonal))
    ratio = np.sqrt(found / expected)
    assert 0.9 < np.median(ratio) < 1.1
    assert np.quantile(ratio, 0.05) > 0.7
    assert np.quantile(ratio, 0.95) < 1.3
    # that of the data alone is three times as large
    assert np.median(np.sqrt(1 / weight[INNER] / expected)) > 2
