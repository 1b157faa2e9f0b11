"""The distribution of errors against plain NumPy: bounds, standard deviation and probability of a small error."""

import numpy as np
import numpy.typing as npt
import pytest

from sepi.error_bars.mixture import LEAST_RIM, RIM_WIDTH, Mixture, described


def laplace(x: npt.NDArray[np.float64], middle: float, width: float) -> npt.NDArray[np.float64]:
    return np.exp(-np.abs(x - middle) / width) / (2 * width)


def density(x: npt.NDArray[np.float64], p: Mixture) -> npt.NDArray[np.float64]:
    """Of a single pixel's error."""
    scale, outlier_scale, outlier, rim, above, below = (float(value[0, 0]) for value in p)
    share = (above**2 + 1e-6) / (above**2 + below**2 + 2e-6)
    other = share * laplace(x, above, RIM_WIDTH * above + LEAST_RIM)
    other += (1 - share) * laplace(x, -below, RIM_WIDTH * below + LEAST_RIM)
    return (1 - outlier - rim) * laplace(x, 0, scale) + outlier * laplace(x, 0, outlier_scale) + rim * other


def one(*parameters: float) -> Mixture:
    return Mixture(*(np.full((1, 1), value, np.float32) for value in parameters))


PIXELS = {
    "sure": one(0.002, 0.3, 0.001, 0.001, 0.01, 0.01),
    "outlier": one(0.01, 0.5, 0.3, 0.02, 0.05, 0.0),
    "beside a nearer surface": one(0.005, 0.2, 0.02, 0.3, 0.9, 0.02),
    "between two": one(0.02, 0.2, 0.05, 0.6, 1.2, 0.7),
    "beside a farther surface": one(0.005, 0.2, 0.0, 0.07, 0.0, 2.5),
}


@pytest.mark.parametrize("name", PIXELS)
@pytest.mark.parametrize("tail", [0.05, 0.02])
def test_bounds_and_deviation_are_those_of_the_distribution(name: str, tail: float) -> None:
    """Who reads 90 % must get them, on each side a half, however lopsided the error is."""
    pixel = PIXELS[name]
    x = np.linspace(-12, 12, 2_400_001)
    p = density(x, pixel)
    p /= p.sum()
    found = described(pixel, tail, 0.07)
    below, above = float(found.below[0, 0]), float(found.above[0, 0])
    assert p[x < -below].sum() == pytest.approx(tail, rel=0.01)
    assert p[x > above].sum() == pytest.approx(tail, rel=0.01)
    # of a normal distribution the mean absolute value is so much less
    assert found.sigma[0, 0] == pytest.approx((p * np.abs(x)).sum() * np.sqrt(np.pi / 2), rel=1e-3)
    assert found.probability[0, 0] == pytest.approx(p[np.abs(x) <= 0.07].sum(), abs=1e-3)
