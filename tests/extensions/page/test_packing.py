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

from sepi.extensions.page.viewer import STEPS as STEPS_OF_ROLES
from sepi.extensions.page.viewer import packed

STEPS = sorted({step for steps in STEPS_OF_ROLES for step in steps})


def unpacked(found: dict[str, Any], height: int, width: int) -> npt.NDArray[np.float64]:
    """The map again, pixel by pixel as the script does it, in Python's own numbers."""
    data = zlib.decompress(base64.b64decode(found["data"]))
    assert len(data) == 2 * height * width
    levels: list[int] = []
    for low, high in zip(data[: height * width], data[height * width :], strict=True):
        folded = low + 256 * high
        above = levels[-width] if len(levels) >= width else 0
        levels.append((above + (-(folded + 1) // 2 if folded % 2 else folded // 2)) % 2**16)
    step, base = found["step"], found["base"]
    values = [(level - 1 + base) * step if level else math.nan for level in levels]
    return np.array(values).reshape(height, width)


def require_equal(values: npt.NDArray[np.float32], found: npt.NDArray[np.float64], step: float) -> None:
    """Finite values within half a step, all others unknown."""
    known = np.isfinite(values)
    np.testing.assert_array_equal(np.isfinite(found), known)
    # float32 values are not whole steps exactly
    slack = 1e-9 * max(1.0, float(np.abs(values[known]).max(initial=0)))
    assert np.abs(found[known] - values[known].astype(np.float64)).max(initial=0) <= step / 2 + slack


def random_map(kind: str, shape: tuple[int, int] = (23, 31)) -> npt.NDArray[Any]:
    """Maps and a mask that are hard to pack, each in its own way."""
    random = np.random.default_rng(5)
    y, x = np.indices(shape)
    smooth = np.sin(y / 7) + x / 20
    if kind == "mask":
        return random.random(shape) < 0.4
    values = {
        "noise": random.normal(0, 1, shape),
        "constant": np.full(shape, -1.234),
        "unknown": np.full(shape, np.nan),
        "holes": np.where(random.random(shape) < 0.1, random.choice([np.inf, -np.inf, np.nan], shape), smooth),
        "wide": random.choice([-5e5, 3.3, 1e6], shape),
        "astronomic": random.choice([-3e38, 0, 3e38], shape),
    }
    return values[kind].astype(np.float32)


KINDS = ("noise", "constant", "unknown", "holes", "wide", "astronomic", "mask")


@pytest.mark.parametrize("step", STEPS)
@pytest.mark.parametrize("kind", KINDS)
def test_a_map_comes_out_again(kind: str, step: float) -> None:
    values = random_map(kind)
    found = packed(values, step)
    require_equal(values, unpacked(found, *values.shape), found["step"])


@settings(max_examples=60, deadline=None)
@given(
    arrays.arrays(np.float32, st.tuples(st.integers(1, 6), st.integers(1, 6)), elements=st.floats(width=32)),
    st.sampled_from(STEPS),
)
def test_any_map_comes_out_again(values: npt.NDArray[np.float32], step: float) -> None:
    found = packed(values, step)
    assert found["step"] >= step
    require_equal(values, unpacked(found, *values.shape), found["step"])


@pytest.mark.parametrize(("span", "step"), [(65.0, 0.001), (65.533, 0.001), (65.6, 0.01), (700.0, 0.1), (1e7, 1000)])
def test_the_step_grows_only_where_it_must(span: float, step: float) -> None:
    values = np.linspace(-span / 2, span / 2, 60, dtype=np.float64).reshape(6, 10).astype(np.float32)
    assert packed(values, 0.001)["step"] == pytest.approx(step)


def test_the_script_of_the_page_reads_the_same(browser: Any, example: Any) -> None:
    """Bit by bit what the plain twin reads, for maps and masks."""
    cases = [(random_map(kind), step) for kind in KINDS for step in (0.001, 0.05, 1.0)]
    cases += [(random_map("holes", shape), 0.001) for shape in ((1, 1), (1, 40), (40, 1))]
    page = browser.new_page()
    page.goto(example.page.as_uri())
    for values, step in cases:
        found = packed(values, step)
        height, width = values.shape
        read = page.evaluate(
            "async (given) => Array.from(await Sepi.unpack(...given), (v) => (Number.isNaN(v) ? null : v))",
            [found, width],
        )
        shown = np.array([math.nan if value is None else value for value in read], np.float32)
        np.testing.assert_array_equal(shown.reshape(height, width), unpacked(found, height, width).astype(np.float32))
    page.close()
