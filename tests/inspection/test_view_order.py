"""The check of the views' order: what it names must set the views right, and it must not cry wolf."""

import itertools
from collections.abc import Iterable
from dataclasses import replace
from functools import cache
from pathlib import Path

import cv2
import numpy as np
import pytest
from real_scenes import views_of

from sepi.inspection.disparity_sign import add_pairs
from sepi.inspection.view_order import check_order
from sepi.io.readers.options import ORDERS
from sepi.lightfield import LightField
from sepi.scenes import SCENES, render

TURNED = {
    "as-given": "flip-both",
    "flip-rows": "flip-columns",
    "transpose": "transpose-flip-both",
    "transpose-flip-rows": "transpose-flip-columns",
}
TURNED |= {second: first for first, second in TURNED.items()}
SOME_ORDERS = ("flip-both", "flip-rows", "transpose-flip-columns")
"""Inside out, one axis, and axes exchanged: for real views that take long; the built-in scenes have all."""
"""One of each two orders that differ by half a turn, where either may be named."""
MIDDLE = np.s_[2:7, 2:7]
"""Of a benchmark scene's views, as many as it takes."""
OBJECTS = np.s_[:, :, 60:252, 100:292]
"""Of a benchmark scene's pictures, where things hide others."""


@cache
def scene(name: str, size: int = 96, views: int = 5) -> LightField:
    return render(name, size=size, views=views)


def misread(light_field: LightField, word: str, name: str = "misread") -> LightField:
    """The light field as files of another order hold it: reading it in order ``word`` sets it right."""
    T, S = light_field.grid
    grid = (S, T) if word.startswith("transpose") else (T, S)
    right = ORDERS[word](np.arange(T * S).reshape(grid))
    views = np.empty((T * S, *light_field.views.shape[2:]), light_field.views.dtype)
    present = np.zeros(T * S, bool)
    for t, s in np.ndindex(T, S):
        views[right[t, s]] = light_field.views[t, s]
        present[right[t, s]] = light_field.present[t, s]
    return LightField(views.reshape(*grid, *views.shape[1:]), name, present=present.reshape(grid))


def grey_field(pictures: np.ndarray) -> LightField:
    return LightField(np.ascontiguousarray(pictures), "field")


@pytest.mark.parametrize("word", ORDERS)
@pytest.mark.parametrize("name", ["curved_occluders", "dots", "stripes"])
def test_the_order_that_sets_a_scene_right_is_named(name: str, word: str) -> None:
    field = misread(scene(name), word)
    found = check_order(field)
    assert found.clear
    assert found.sign_clear
    assert found.best == word
    assert list(found.fits) == list(ORDERS)
    assert found.fits[word] < min(fit for other, fit in found.fits.items() if other != word)
    warning = found.warning()
    if word == "as-given":
        assert warning is None
        assert found.verdict() == "the views are in the right order"
    else:
        assert warning == found.verdict()
        assert warning.endswith(f"read it with --order {word}")


@pytest.mark.parametrize("word", ORDERS)
def test_a_scene_without_occlusion_leaves_near_and_far_open(word: str) -> None:
    found = check_order(misread(scene("slanted_plane"), word))
    assert found.clear
    assert not found.sign_clear
    assert found.best in (word, TURNED[word])
    assert found.fits[word] == found.fits[TURNED[word]]
    # in such a scene the order as it is may be right
    warned = found.warning()
    assert (warned is None) == (word in ("as-given", "flip-both"))
    assert warned is None or (f"--order {found.best}" in warned and TURNED[found.best] in warned)


@pytest.mark.parametrize("given", ORDERS)
def test_an_order_that_was_asked_for_is_replaced_not_added_to(given: str) -> None:
    """Read in a wrong order by the user's own flag, the flag that is named is the one to give instead."""
    right = scene("curved_occluders")
    files = misread(right, "transpose-flip-rows")
    read = misread_by_flag(files, given)
    found = check_order(read, given)
    assert found.best == "transpose-flip-rows"
    assert (found.warning() is None) == (given == "transpose-flip-rows")


def misread_by_flag(files: LightField, word: str) -> LightField:
    """What a reader makes of the files in order ``word``."""
    T, S = files.grid
    numbers = ORDERS[word](np.arange(T * S).reshape(T, S))
    return LightField(files.views.reshape(T * S, *files.views.shape[2:])[numbers], "read")


@pytest.mark.parametrize(("size", "views"), [(64, 9), (96, 3), (96, 5), (96, 2), (64, 4)])
@pytest.mark.parametrize("name", SCENES)
def test_no_built_in_scene_is_warned_of(name: str, size: int, views: int) -> None:
    # a scene of each size is drawn once, with the arguments of other tests
    whole = render(name, size=64) if size == 64 else scene(name, size)
    first = (whole.grid[0] - views + 1) // 2
    middle = slice(first, first + views)
    assert check_order(grey_field(whole.views[middle, middle])).warning() is None


@pytest.mark.parametrize("shape", ["cross", "star", "holes", "rows"])
@pytest.mark.parametrize("word", ["as-given", "flip-columns", "transpose"])
def test_missing_views_neither_hide_the_order_nor_invent_one(shape: str, word: str) -> None:
    light_field = scene("curved_occluders")
    t, s = np.mgrid[-2:3, -2:3]
    present = {
        "cross": (t == 0) | (s == 0),
        "star": (t == 0) | (s == 0) | (abs(t) == abs(s)),
        "holes": ~(((t == 1) & (s == 0)) | ((t == -2) & (s == -2))),
        "rows": abs(t) <= 1,
    }[shape]
    views = np.where(present[:, :, None, None, None], light_field.views, 0).astype(np.uint8)
    found = check_order(misread(LightField(views, "missing", present=present), word))
    assert found.clear
    assert found.best == word


@pytest.mark.parametrize("place", [np.s_[2:3], np.s_[:, 2:3], np.s_[2:3, 1:4], np.s_[:, 2:4], np.s_[2:4, 2:4]])
@pytest.mark.parametrize("name", ["curved_occluders", "dots", "slanted_plane", "wall"])
def test_thin_and_small_grids_bring_no_warning(name: str, place: tuple[slice, ...]) -> None:
    light_field = grey_field(scene(name).views[place])
    assert check_order(light_field).warning() is None


def test_a_row_of_views_that_runs_the_other_way_is_found() -> None:
    """Of a single row only the direction matters, and one word for it is enough."""
    row = grey_field(scene("curved_occluders").views[2:3])
    found = check_order(misread(row, "flip-columns"))
    assert found.sign_clear
    assert found.best == "flip-columns"


def test_pictures_of_noise_are_left_undecided() -> None:
    rng = np.random.default_rng(5)
    noise = grey_field(rng.integers(0, 256, (5, 5, 80, 80, 3), dtype=np.uint8))
    found = check_order(noise)
    assert not found.clear
    assert "no order fits clearly better" in found.verdict()
    assert found.warning() is None


@pytest.mark.parametrize("kind", ["shuffled", "frames for columns", "not rectified"])
def test_views_that_fit_together_in_no_order_are_told(kind: str) -> None:
    """Too little texture is another matter: here depth would be made of nonsense without a word."""
    rng = np.random.default_rng(9)
    views = scene("curved_occluders").views[1:4, 1:4].reshape(9, 96, 96, 3)
    if kind == "shuffled":
        changed = views[rng.permutation(9)].reshape(3, 3, 96, 96, 3)
    elif kind == "frames for columns":
        changed = np.stack([np.roll(views, 3 * frame, axis=2) for frame in range(3)], axis=1)
    else:
        changed = np.stack([np.roll(view, rng.integers(-3, 4, 2), (0, 1)) for view in views]).reshape(3, 3, 96, 96, 3)
    found = check_order(grey_field(changed))
    assert found.fits_none
    assert not found.clear
    assert found.verdict() == found.warning()
    assert "fit together in no order" in found.verdict()


@pytest.mark.parametrize("word", ["as-given", "flip-columns", "transpose"])
@pytest.mark.parametrize("turned", [1, -1])
def test_camera_positions_tell_near_from_far_where_the_views_do_not(word: str, turned: int) -> None:
    """X grows to the right; y may be either, and which coordinate is which axis the views tell."""
    field = misread(scene("slanted_plane"), word)
    rows, columns = (ORDERS[word](axis) for axis in np.mgrid[:5, :5])
    # of the file at row 1 of column 0, and at row 0 of column 1, how far to the right it was taken
    right = {(int(rows[t, s]), int(columns[t, s])): s * turned for t, s in np.ndindex(5, 5)}
    directions = tuple(int(np.sign(right[at] - right[0, 0])) for at in ((1, 0), (0, 1)))
    found = check_order(replace(field, directions=directions))
    assert found.sign_clear
    assert found.best == (word if turned == 1 else TURNED[word])
    assert found.note() is None


def test_dark_and_noisy_views_are_not_warned_of() -> None:
    light_field = scene("curved_occluders")
    rng = np.random.default_rng(7)
    noisy = light_field.views + rng.normal(0, 40, light_field.views.shape)
    assert check_order(grey_field(np.clip(noisy, 0, 255).astype(np.uint8))).warning() is None
    for divisor in (12, 30, 60):
        for name in ("curved_occluders", "wall", "stripes"):
            assert check_order(grey_field(scene(name).views // divisor)).warning() is None


@pytest.mark.parametrize("name", ["cotton", "antinous"])
def test_real_scenes_in_any_order(hci: Path, name: str) -> None:
    light_field = views_of(hci / name)
    orders_are_named(grey_field(light_field.views[MIDDLE][OBJECTS]), SOME_ORDERS)


def test_a_lytro_picture_in_any_order(real_data: Path) -> None:
    folder = real_data / "lytro" / "2067"
    # the left half of the views in the middle, with dark corners
    rows = [[cv2.imread(str(folder / f"2067_{t:02}_{s:02}.png"))[:, :276] for s in range(3, 8)] for t in range(3, 8)]
    orders_are_named(grey_field(np.array(rows)[..., ::-1]), SOME_ORDERS)


@pytest.mark.parametrize(("kind", "part"), [("noise of 10/255", np.s_[:, :, :320, 128:]), ("half size", OBJECTS)])
def test_near_and_far_are_told_in_noise_and_in_small_pictures(hci: Path, kind: str, part: tuple[slice, ...]) -> None:
    """One axis of views is too few where texture is faint: depth inside out would go unnoticed."""
    from bench.disturbed import DISTURBANCES

    light_field = grey_field(views_of(hci / "cotton").views[part])
    orders_are_named(DISTURBANCES[kind].change(light_field), ["flip-both"])


def orders_are_named(light_field: LightField, orders: Iterable[str]) -> None:
    assert check_order(light_field).warning() is None
    for word in orders:
        found = check_order(misread(light_field, word))
        assert found.clear
        assert found.sign_clear
        assert found.best == word


@pytest.mark.parametrize(("down", "across"), [(0, 1), (0, -1), (1, 0), (-1, 0)])
def test_pairs_that_meet_in_a_view_are_counted_in_the_region_of_the_farther(down: int, across: int) -> None:
    """What is in front would be told by other pixels, or the wrong way round."""
    rng = np.random.default_rng(0)
    disparity, rise, residual = rng.uniform((-2,), (2,), (3, 30, 40)).astype(np.float32)
    usable = rng.random(disparity.shape) < 0.7
    length, hidden, side, farthest = np.float32(3.5), np.float32(0.4), 8, 12
    total, count = np.zeros((2, 4, 5))
    add_pairs(rise, residual, disparity, usable, (down, across), farthest, length, hidden, side, total, count)
    expected = np.zeros((2, 4, 5))
    for (y, x), distance in itertools.product(np.argwhere(usable).tolist(), range(2, farthest + 1)):
        i, j = y + down * distance, x + across * distance
        if not (0 <= i < 30 and 0 <= j < 40 and usable[i, j]):
            continue
        shift = float((disparity[i, j] - disparity[y, x]) * length)
        hides = max(residual[y, x], residual[i, j]) > hidden and max(rise[y, x], rise[i, j]) > 1
        if hides and shift >= 1.5 and abs(shift - distance) <= 0.75:
            expected[:, y // side, x // side] += np.clip(rise[y, x] - rise[i, j], -2, 2), 1
    np.testing.assert_array_equal(count, expected[1])
    np.testing.assert_allclose(total, expected[0], atol=1e-6)
    assert count.sum() > 30
