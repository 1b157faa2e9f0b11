"""Views that are only numbered: the grid that they fill is found, or it is said that it cannot be."""

from functools import cache

import numpy as np
import pytest

from sepi.errors import SepiError, SepiWarning
from sepi.inspection.arrangement import arrange, arrangements
from sepi.io.readers.options import ReadOptions
from sepi.lightfield import LightField
from sepi.scenes import render

GRID = np.arange(25).reshape(5, 5)
INNER = GRID[1:4, 1:4]


@cache
def scene() -> LightField:
    return render("curved_occluders", size=64, views=5)


def sequence(numbers: np.ndarray) -> LightField:
    """These views of the scene one after the other, as numbered files are read."""
    views = scene().views.reshape(25, *scene().views.shape[2:])
    return LightField(views[numbers.ravel()][None], "sequence", source="folder", arranged=False)


def back_and_forth(grid: np.ndarray) -> np.ndarray:
    grid = grid.copy()
    grid[1::2] = grid[1::2, ::-1]
    return grid


@pytest.mark.parametrize(
    ("numbers", "name", "grid"),
    [
        (GRID, "5x5 row by row", GRID),
        (INNER.T, "3x3 column by column", INNER),
        (back_and_forth(GRID), "5x5 row by row, back and forth", GRID),
        (back_and_forth(GRID.T), "5x5 column by column, back and forth", GRID),
        (GRID[1:4], "3x5 row by row", GRID[1:4]),
        (GRID[:, :3], "5x3 row by row", GRID[:, :3]),
        (GRID[:, :3].T, "5x3 column by column", GRID[:, :3]),
        (GRID[2], "a single row of 5", GRID[2:3]),
        (GRID[:, 2], "a single column of 5", GRID[:, 2:3]),
    ],
)
def test_grids_are_recognised(numbers: np.ndarray, name: str, grid: np.ndarray) -> None:
    """In another grid neighbours are not neighbours, and depth is nonsense."""
    found = arrange(sequence(numbers), ReadOptions())
    assert found.arranged
    assert name in found.notes[-1]
    np.testing.assert_array_equal(found.views, scene().views.reshape(25, *scene().views.shape[2:])[grid])
    assert found.present.all()


@pytest.mark.parametrize(
    ("numbers", "name"),
    [
        (np.r_[GRID[2], GRID[[0, 1, 3, 4], 2]], "a cross of 5x5, the row first"),
        (np.r_[GRID[:, 2], GRID[2, [0, 1, 3, 4]]], "a cross of 5x5, the column first"),
        (np.sort(np.r_[GRID[2], GRID[[0, 1, 3, 4], 2]]), "a cross of 5x5 row by row"),
    ],
)
def test_crosses_are_recognised(numbers: np.ndarray, name: str) -> None:
    """Nine views of a cross are easily taken for 3x3."""
    found = arrange(sequence(numbers), ReadOptions())
    assert name in found.notes[-1]
    t, s = np.mgrid[-2:3, -2:3]
    np.testing.assert_array_equal(found.present, (t == 0) | (s == 0))
    np.testing.assert_array_equal(found.views[found.present], scene().views[found.present])
    assert not found.views[~found.present].any()


def test_missing_views_of_a_sequence_stay_missing() -> None:
    present = np.ones((1, 25), bool)
    present[0, [3, 17]] = False
    found = arrange(LightField(sequence(GRID).views, "holes", present=present, arranged=False), ReadOptions())
    np.testing.assert_array_equal(found.present.ravel(), present[0])


def test_options_speak_of_the_grid() -> None:
    """Which view is excluded, and from which depth is made, is said in rows and columns."""
    options = ReadOptions(central=3, order="flip-rows", exclude=("0,0",), view=(1, 2))
    found = arrange(sequence(GRID), options)
    inner = scene().views[1:4, 1:4][::-1]
    assert found.reference_position == (1, 2)
    assert not found.present[0, 0]
    np.testing.assert_array_equal(found.views[found.present], inner[found.present])


def test_views_that_fit_in_no_arrangement_are_refused() -> None:
    """Pictures of different things in a folder would be taken for views, and their depth for one."""
    rng = np.random.default_rng(1)
    noise = LightField(
        rng.integers(0, 256, (1, 9, 64, 64, 3), dtype=np.uint8), "noise", source="folder", arranged=False
    )
    with pytest.raises(SepiError, match=r"folder: 9 views .*in no arrangement tried \(3x3 row by row.*--grid"):
        arrange(noise, ReadOptions())


def test_views_that_do_not_tell() -> None:
    """Nothing moves: a square is taken with a warning, and what is no square is asked for."""
    still = np.broadcast_to(scene().views[2, 2], (1, 9, *scene().views.shape[2:])).copy()
    with pytest.warns(SepiWarning, match="taken for 3x3 row by row, .*--grid"):
        assert arrange(LightField(still, "still", arranged=False), ReadOptions()).grid == (3, 3)
    with pytest.raises(SepiError, match=r"6 views .*give --grid"):
        arrange(LightField(still[:, :6].copy(), "still", arranged=False), ReadOptions())


@pytest.mark.parametrize("count", [2, 3, 5, 9, 12, 25, 33, 81, 289, 797])
def test_arrangements_hold_each_view_once(count: int) -> None:
    tried = list(arrangements(count))
    assert len({way.name for way in tried}) == len(tried)
    for way in tried:
        assert len(np.unique(way.positions, axis=0)) == count
        assert way.positions.min() == 0
