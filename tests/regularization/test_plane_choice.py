"""Which plane a plain region is given: its border's, that of its light, or its own."""

import numpy as np
import numpy.typing as npt
import pytest

from sepi.lightfield import BoolMap, FloatMap
from sepi.regularization.border_planes import BorderPlane
from sepi.regularization.lit_planes import LitPlane
from sepi.regularization.plane_choice import (
    CONFIRMS,
    FAR,
    LIT_AREA,
    SURE,
    Chosen,
    chosen_plane,
    kept_pixels,
    own_plane,
)
from sepi.regularization.regions import Region

SIZE = 64
ALL = (slice(0, SIZE), slice(0, SIZE))
WHOLE = Region(ALL, np.ones((SIZE, SIZE), bool))
SMALL = np.zeros((SIZE, SIZE), bool)
SMALL[:20, :20] = True
HERE = np.full((SIZE, SIZE), 0.5, np.float32)


def lit_at(distance: float, deviation: float = 0.01, misfit: float = 1.0) -> LitPlane:
    covariance = np.diag([deviation**2, 1e-12, 1e-12])
    return LitPlane(np.array([0.5 + distance, 0, 0]), covariance, misfit)


@pytest.mark.parametrize(
    ("border", "lit", "noisy", "chosen"),
    [
        # without noise the border's, unless light contradicts it and what there is
        ((0.0, 300, 0.3), None, False, "border"),
        ((0.0, 300, 0.3), (-0.5, 0.01), False, "border"),
        ((0.0, 300, 0.3), (0.4, 0.01), False, "light"),
        ((0.0, 300, 0.3), (0.03, 0.01), False, "border"),
        ((0.0, 300, 0.3), (0.4, 0.01, 9.0), False, "border"),
        (None, (0.4, 0.01), False, "light"),
        (None, (0.4, 0.4 / SURE * 1.1), False, None),
        # in noise only of a border that is one plane, and of what may be one
        ((0.0, 300, 0.3), None, True, None),
        ((0.0, 40, 0.9), None, True, None),
        ((0.0, 300, 0.9), None, True, "border"),
        ((0.0, 300, 0.9), (-0.5, 0.01), True, "border"),
        ((0.0, 300, 0.9), (-0.5, 0.01, np.nan), True, "border"),
        ((0.0, 300, 0.9), (-0.5, 0.01, 9.0), True, None),
        ((0.0, 300, 0.9), (0.4, 0.01), True, "light"),
        (None, (0.4, 0.01), True, "light"),
        (None, (0.4, 0.01, 9.0), True, None),
        # and its own, where its light does not contradict that and the border's is farther from it
        (None, (0.4, 0.4 / SURE * 1.1), True, "own"),
        ((0.0, 300, 0.9), (-0.2, 0.09), True, "own"),
        ((0.0, 300, 0.9), (-0.2, 0.15), True, "own"),
        ((0.0, 300, 0.9), (-0.3, 0.1), True, "border"),
        ((0.0, 300, 0.9), (0.2, 0.7 / FAR * 1.1), True, "own"),
    ],
)
def test_which_plane_a_region_is_given(
    border: tuple[float, int, float] | None, lit: tuple[float, ...] | None, noisy: bool, chosen: str | None
) -> None:
    """Of the region's own disparity 0.5, a border's plane at 0 and its light's."""
    beside = None if border is None else BorderPlane(np.array([border[0], 0, 0]), *border[1:])
    told = None if lit is None else lit_at(*lit)
    found = chosen_plane(WHOLE, HERE, beside, told, noisy)
    if chosen is None:
        assert found is None
        return
    assert found.source == chosen
    # where there is no noise, nobody asks
    assert not noisy or found.confirmed == (told is not None and told.deviation(WHOLE.basis) < CONFIRMS)
    planes = {
        "border": beside and beside.plane,
        "light": told and told.plane,
        "own": np.array([0.5, 0, 0]),
    }
    np.testing.assert_allclose(found.plane, planes[chosen], atol=1e-9)


def test_a_small_region_in_noise_keeps_what_it_has() -> None:
    """Stripes of a few pixels would join the wall behind them."""
    assert SMALL.sum() < LIT_AREA
    border = BorderPlane(np.array([0.0, 0, 0]), 300, 0.9)
    assert chosen_plane(Region(ALL, SMALL), HERE, border, None, True) is None
    assert chosen_plane(Region(ALL, SMALL), HERE, border, None, False) is not None


def test_a_clear_border_fills_what_is_no_surface() -> None:
    """Real views differ by more than light's model knows: a bare wall would keep depths all over the range."""
    scattered = np.random.default_rng(2).uniform(-2, 2, (SIZE, SIZE)).astype(np.float32)
    clear, unclear = (BorderPlane(np.array([0.0, 0, 0]), 300, share) for share in (0.95, 0.85))
    lit = lit_at(-0.5, misfit=9.0)
    found = chosen_plane(WHOLE, scattered, clear, lit, True)
    assert found.source == "border"
    assert not kept_pixels(WHOLE.pixels, np.zeros_like(scattered), scattered, found).any()
    assert chosen_plane(WHOLE, scattered, unclear, lit, True) is None
    assert chosen_plane(WHOLE, HERE, clear, lit, True) is None


def disparities(far: float, spread: float) -> tuple[FloatMap, npt.NDArray[np.float64]]:
    """A plane in noise of ``spread``, and a share ``far`` of it that lies 2 px off."""
    random = np.random.default_rng(5)
    plane = np.array([0.3, 0.002, -0.001])
    values = (WHOLE.basis @ plane).reshape(SIZE, SIZE) + random.normal(0, spread, (SIZE, SIZE))
    values[: round(far * SIZE)] += 2
    return values.astype(np.float32), plane


def test_what_a_region_has_is_a_plane_without_what_lies_off_it() -> None:
    """Otherwise a few pixels that noise threw to the other end of the range tilt a wall."""
    lit = LitPlane(np.array([0.35, 0.002, -0.001]), np.diag([0.05**2, 1e-12, 1e-12]), 1.0)
    values, plane = disparities(far=0.25, spread=0.02)
    own = own_plane(WHOLE, values, lit)
    assert np.abs(WHOLE.basis @ (own - plane)).max() < 0.005
    # nothing is known where most of it lies off, or where it scatters more than its light is unsure
    assert own_plane(WHOLE, disparities(far=0.6, spread=0.02)[0], lit) is None
    assert own_plane(WHOLE, disparities(far=0.0, spread=0.15)[0], lit) is None


def fold() -> tuple[BoolMap, FloatMap, FloatMap]:
    """A region, its plane and what it has: the wall, a bridge to a fold within a coat, and the wall's outermost pixels,
    which the coat was carried over.
    """
    before = np.zeros((60, 80), np.float32)
    before[:, 50:] = 1.5
    pixels = np.zeros(before.shape, bool)
    pixels[5:55, 5:50] = pixels[29:31, 50:60] = pixels[25:35, 60:75] = True
    pixels[10:20, 50:53] = True
    return pixels, np.zeros_like(before), before


@pytest.mark.parametrize("confirmed", [True, False])
def test_a_fold_that_goes_on_beyond_a_region_is_none_of_it(confirmed: bool) -> None:
    """If this fails, a dark fold of a coat takes the depth of the dark wall behind it."""
    pixels, plane, before = fold()
    kept = kept_pixels(pixels, plane, before, Chosen(np.zeros(3), "border", confirmed))
    assert kept[25:35, 60:75].all()
    assert not kept[10:20, 50:53].any()
    assert not kept[:, :50].any()
    assert not kept_pixels(pixels, plane, plane, Chosen(np.zeros(3), "border", confirmed)).any()


def test_large_parts_leave_their_depth_only_where_the_light_agrees() -> None:
    """A border of the wall said of the dark floor below it, which nothing told apart, that it is the wall."""
    pixels = np.zeros((60, 80), bool)
    pixels[5:55, 5:75] = True
    before = np.where(np.arange(60)[:, None] < 40, 0, 1.2) * np.ones((60, 80))
    before[~pixels] = 5
    before[10:14, 10:14] = 1
    plane = np.zeros((60, 80), np.float32)
    unsure = kept_pixels(pixels, plane, before.astype(np.float32), Chosen(np.zeros(3), "border", False))
    np.testing.assert_array_equal(unsure, pixels & (before == 1.2))
    sure = kept_pixels(pixels, plane, before.astype(np.float32), Chosen(np.zeros(3), "border", True))
    assert not sure.any()


def test_of_its_own_plane_a_region_takes_what_lies_off_it() -> None:
    """Faint texture is more than a plane; if this fails it is flattened."""
    values, plane = disparities(far=0.0, spread=0.05)
    values[30:34, 30:34] += 1
    flat = (WHOLE.basis @ plane).reshape(SIZE, SIZE).astype(np.float32)
    kept = kept_pixels(WHOLE.pixels, flat, values, Chosen(plane, "own", True))
    taken = np.zeros((SIZE, SIZE), bool)
    taken[30:34, 30:34] = True
    np.testing.assert_array_equal(~kept, taken)
