"""Vectors of compiled functions do what NumPy does with their eight elements, and touch nothing beside them."""

import numpy as np

from sepi.compiled import fma, njit
from sepi.vectors import (
    WIDTH,
    at_most,
    exp,
    first_elements,
    larger,
    least_of,
    load,
    load_colours,
    minus,
    smaller,
    spread,
    spread_from,
    store,
    store_columns,
    store_rounded,
    sum_of,
    weighted_pairs,
    weights,
)

RANDOM = np.random.default_rng(0)


@njit()
def arithmetic(a, b, c, out):
    x, y, z = load(a, 1), load(b, (1, 2)), load(c, 0)
    store(out, (0, 1), (x + y) * z - minus(x) / y)
    store(out, (1, 1), fma(x, y, z))
    store(out, (2, 1), at_most(x, y, z, spread_from(a, 3)))
    store(out, (3, 1), first_elements(x, 3, np.float32(7)))
    store(out, (4, 1), smaller(x, y) + spread(np.float32(2)) * larger(x, y))
    return least_of(x), sum_of(x)


def test_arithmetic() -> None:
    a, b, c = (RANDOM.random(shape, np.float32) + 1 for shape in (WIDTH + 2, (3, 12), WIDTH))
    out = np.full((5, WIDTH + 2), -1, np.float32)
    least, total = arithmetic(a, b, c, out)
    x, y, z = a[1 : 1 + WIDTH], b[1, 2 : 2 + WIDTH], c
    expected = [
        (x + y) * z + x / y,
        x.astype(float) * y + z,
        np.where(x <= y, z, a[3]),
        np.where(np.arange(WIDTH) < 3, x, 7),
        np.minimum(x, y) + 2 * np.maximum(x, y),
    ]
    np.testing.assert_allclose(out[:, 1:-1], expected, rtol=1e-6)
    assert (out[:, [0, -1]] == -1).all()
    assert least == x.min()
    np.testing.assert_allclose(total, x.sum(), rtol=1e-6)


@njit()
def exponential(a, out):
    for i in range(0, len(a), 8):
        store(out, i, exp(load(a, i)))


def test_exponential() -> None:
    """The weights of the mean shift: a jump where a power of two ends would move surfaces."""
    x = np.concatenate([np.linspace(-90, 0, 80_000), -np.log(2) * np.arange(0.5, 64), [-1e9] * 64]).astype(np.float32)
    out = np.empty_like(x)
    exponential(x, out)
    np.testing.assert_allclose(out, np.exp(x.astype(float)), rtol=5e-7, atol=2e-38)


@njit()
def pairs_and_colours(pairs, pixels, out, whole):
    upper, lower = weights(16384, -32768), weights(-1, 32767)
    store(out, 0, weighted_pairs(pairs, (0, 1), (1, 0), upper, lower))
    red, green, blue = load_colours(pixels, (1, 2, 0))
    store(out, 8, red)
    store(out, 16, green)
    store(out, 24, blue)
    store_rounded(whole, 1, red * spread(np.float32(0.37)) - green)


def test_pairs_and_colours() -> None:
    """Numbers of 16 bits at either end, pixels of all types, and grey ones that are in memory once."""
    values = RANDOM.choice([-32768, -7, 0, 5, 32767], (2, 10))
    pairs = ((values[:, :-1] & 0xFFFF) | (values[:, 1:] << 16)).astype(np.uint32).view(np.int32)
    colours = RANDOM.integers(0, 256, (3, 12, 3))
    kinds = [colours.astype(dtype) for dtype in (np.uint8, np.uint16, np.float32)]
    kinds.append(np.broadcast_to(colours.astype(np.uint8)[..., :1], colours.shape))
    for pixels in kinds:
        out, whole = np.empty(32, np.float32), np.zeros(10, np.int32)
        pairs_and_colours(pairs, pixels, out, whole)
        expected = values[0, 1:9] * 16384 - values[0, 2:10] * 32768 - values[1, :8] + values[1, 1:9] * 32767
        np.testing.assert_array_equal(out[:8], ((expected + 2**31) % 2**32 - 2**31).astype(np.float32))
        eight = pixels[1, 2:10].astype(np.float32)
        np.testing.assert_array_equal(out[8:].reshape(3, 8), eight.T)
        np.testing.assert_array_equal(whole[1:9], np.rint(eight[:, 0] * np.float32(0.37) - eight[:, 1]))
        assert whole[0] == whole[9] == 0


@njit()
def transposed(a, out):
    rows = (
        load(a, (0, 0)), load(a, (1, 0)), load(a, (2, 0)), load(a, (3, 0)),
        load(a, (4, 0)), load(a, (5, 0)), load(a, (6, 0)), load(a, (7, 0)),
    )  # fmt: skip
    store_columns(out, (1, 2), rows)


def test_columns() -> None:
    a, out = RANDOM.random((8, 8), np.float32), np.zeros((10, 11), np.float32)
    transposed(a, out)
    np.testing.assert_array_equal(out[1:9, 2:10], a.T)
    out[1:9, 2:10] = 0
    assert not out.any()
