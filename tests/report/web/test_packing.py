"""Maps as text in a page: what is packed comes out again, by a plain twin of the page's script, and by the script."""

import base64
import math
import zlib
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from sepi.report.web.packing import packed_map, packed_mask, packed_size
from sepi.report.web.viewer import PRECISIONS

STEPS = sorted({step for steps in PRECISIONS for step in steps})


def unpacked(packed: dict[str, Any], height: int, width: int) -> npt.NDArray[np.float64]:
    """The map again, pixel by pixel as the script does it, in Python's own numbers."""
    data = zlib.decompress(base64.b64decode(packed["data"]))
    assert len(data) == 2 * height * width
    following = list(packed["starts"])
    levels = [[0] * width for _ in range(height)]

    def level(y: int, x: int) -> int:
        return levels[y][x] if y >= 0 and 0 <= x < width else 0

    for y in range(height):
        for x in range(width):
            left, up, corner, ahead = level(y, x - 1), level(y - 1, x), level(y - 1, x - 1), level(y - 1, x + 1)
            activity = abs(left - corner) + abs(up - corner) + abs(up - ahead)
            kind = sum(activity >= least for least in (1, 2, 3, 5, 9, 17, 33))
            place = following[kind]
            following[kind] += 1
            predicted = sorted((left, up, left + up - corner))[1]
            folded = data[place] + 256 * data[place + height * width]
            missed = -(folded + 1) // 2 if folded % 2 else folded // 2
            levels[y][x] = (predicted + missed) % 2**16
    # every class was read to where the next one begins
    assert following == [*packed["starts"][1:], height * width]
    step, base = packed["step"], packed["base"]
    return np.array([[(level - 1 + base) * step if level else math.nan for level in row] for row in levels])


def require_equal(values: npt.NDArray[np.float32], found: npt.NDArray[np.float64], step: float) -> None:
    """Finite values within half a step, all others unknown."""
    known = np.isfinite(values)
    np.testing.assert_array_equal(np.isfinite(found), known)
    # float32 values are not whole steps exactly
    slack = 1e-9 * max(1.0, float(np.abs(values[known]).max(initial=0)))
    assert np.abs(found[known] - values[known].astype(np.float64)).max(initial=0) <= step / 2 + slack


def random_map(kind: str, shape: tuple[int, int] = (23, 31)) -> npt.NDArray[np.float32]:
    """Maps that are hard to pack, each in its own way."""
    random = np.random.default_rng(5)
    y, x = np.indices(shape)
    smooth = np.sin(y / 7) + x / 20
    values = {
        "smooth": smooth,
        "noise": random.normal(0, 1, shape),
        "steps": np.where(x > shape[1] // 2, 2.0, -2.0) + 0.01 * y,
        "constant": np.full(shape, -1.234),
        "zero": np.zeros(shape),
        "unknown": np.full(shape, np.nan),
        "holes": np.where(random.random(shape) < 0.3, np.nan, smooth),
        "infinite": np.where(random.random(shape) < 0.1, random.choice([np.inf, -np.inf, np.nan], shape), smooth),
        "extremes": random.choice([-32.7, 32.7], shape),
        "wide": random.choice([-5e5, 3.3, 1e6], shape),
        "astronomic": random.choice([-3e38, 0, 3e38], shape),
        "huge constant": np.full(shape, 1e20),
        "tiny": random.normal(0, 1e-30, shape),
    }
    return np.asarray(values[kind], np.float32)


KINDS = (
    "smooth", "noise", "steps", "constant", "zero", "unknown", "holes", "infinite", "extremes", "wide", "astronomic",
    "huge constant", "tiny",
)  # fmt: skip


@pytest.mark.parametrize("step", STEPS)
@pytest.mark.parametrize("kind", KINDS)
def test_a_map_comes_out_again(kind: str, step: float) -> None:
    values = random_map(kind)
    packed = packed_map(values, step)
    require_equal(values, unpacked(packed, *values.shape), packed["step"])


@pytest.mark.parametrize("shape", [(1, 1), (1, 40), (40, 1), (2, 2)])
@pytest.mark.parametrize("kind", ["noise", "holes", "unknown"])
def test_maps_of_one_row_or_column(kind: str, shape: tuple[int, int]) -> None:
    values = random_map(kind, shape)
    require_equal(values, unpacked(packed_map(values, 0.001), *shape), 0.001)


@settings(max_examples=60, deadline=None)
@given(
    arrays.arrays(np.float32, st.tuples(st.integers(1, 6), st.integers(1, 6)), elements=st.floats(width=32)),
    st.sampled_from(STEPS),
)
def test_any_map_comes_out_again(values: npt.NDArray[np.float32], step: float) -> None:
    packed = packed_map(values, step)
    assert packed["step"] >= step
    require_equal(values, unpacked(packed, *values.shape), packed["step"])


@pytest.mark.parametrize(("span", "step"), [(65.0, 0.001), (65.533, 0.001), (65.6, 0.01), (700.0, 0.1), (1e7, 1000)])
def test_the_step_grows_only_where_it_must(span: float, step: float) -> None:
    values = np.linspace(-span / 2, span / 2, 60, dtype=np.float64).reshape(6, 10).astype(np.float32)
    assert packed_map(values, 0.001)["step"] == pytest.approx(step)


def test_usual_disparities_are_shown_as_they_are_rounded() -> None:
    """What the read-out prints with three decimals is what the file's value rounds to."""
    values = np.random.default_rng(0).uniform(-4, 4, (60, 60)).astype(np.float32)
    found = unpacked(packed_map(values, 0.001), *values.shape)
    assert [f"{value + 0.0:.3f}" for value in found.ravel()] == [
        f"{float(f'{value:.3f}') + 0.0:.3f}" for value in values.ravel()
    ]


@pytest.mark.parametrize("shape", [(1, 1), (7, 9), (16, 16)])
def test_a_mask_comes_out_again(shape: tuple[int, int]) -> None:
    mask = np.random.default_rng(1).random(shape) < 0.4
    bits = np.unpackbits(np.frombuffer(zlib.decompress(base64.b64decode(packed_mask(mask)["data"])), np.uint8))
    np.testing.assert_array_equal(bits[: mask.size].reshape(shape), mask)


def test_equal_maps_give_equal_text() -> None:
    values = random_map("holes")
    assert packed_map(values, 0.01) == packed_map(values.copy(), 0.01)


@pytest.mark.parametrize("kind", KINDS)
def test_the_size_is_told_beforehand(kind: str) -> None:
    """It decides how fine a scene may be: never less than what is written, and not much more."""
    values = random_map(kind, (120, 120))
    written = len(packed_map(values, 0.001)["data"])
    told = packed_size(values, 0.001)
    assert written <= told + 4
    # repetitions, which noise lacks, are only found by the slower way
    assert told <= 1.5 * written + 200 or kind in ("extremes", "wide", "astronomic")


def test_smooth_maps_are_small() -> None:
    """A plane of real disparities takes a fraction of the two bytes that a pixel would."""
    y, x = np.indices((128, 128))
    plane = (0.01 * x - 0.003 * y).astype(np.float32)
    assert packed_size(plane, 0.001) < 0.4 * plane.size
    assert packed_size(plane + np.random.default_rng(0).normal(0, 0.002, plane.shape), 0.001) < 0.9 * plane.size


def test_the_script_of_the_page_reads_the_same(browser: Any, example: Any) -> None:
    """Bit by bit what the plain twin reads, for maps and masks."""
    cases = [(random_map(kind), step) for kind in KINDS for step in (0.001, 0.05)]
    cases += [(random_map("holes", shape), 0.001) for shape in ((1, 1), (1, 40), (40, 1))]
    page = browser.new_page()
    page.goto(example.page.as_uri())
    for values, step in cases:
        packed = packed_map(values, step)
        height, width = values.shape
        read = page.evaluate(
            "async (given) => Array.from(await Sepi.unpackMap(...given), (v) => (Number.isNaN(v) ? null : v))",
            [packed, width, height],
        )
        found = np.array([math.nan if value is None else value for value in read], np.float32)
        np.testing.assert_array_equal(found.reshape(values.shape), unpacked(packed, height, width).astype(np.float32))
        mask = np.isfinite(values)
        given = [packed_mask(mask), width, height]
        bits = page.evaluate("async (given) => [...(await Sepi.unpackMask(...given))]", given)
        np.testing.assert_array_equal(np.reshape(bits, mask.shape), mask)
    page.close()
