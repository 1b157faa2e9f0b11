"""What is seen through a gap is as far away as the wall, and a plain panel of a box stays on the box."""

from typing import Any

import cv2
import numpy as np
import pytest

from sepi.kernels import gaps as kernels
from sepi.lightfield import BoolMap, DisparityRange, FloatMap, LightField
from sepi.matching.gaps import GapParameters, with_open_gaps
from sepi.matching.view_subsets import spread_views

SIZE, VIEWS = 64, 5
WALL, BOX = -1.4, 0.8
Y, X = np.mgrid[:SIZE, :SIZE]
# a box, and five rows of it that are open, or a panel
INSIDE = (abs(Y - 32) < 20) & (abs(X - 32) < 20)
SLIT = (abs(Y - 32) < 3) & (abs(X - 32) < 15)
NOTHING = np.zeros((SIZE, SIZE), bool)


def box_before_a_wall(opening: BoolMap = NOTHING, panel: BoolMap = NOTHING) -> LightField:
    """A wall of colours that hardly change, a spotted box with an opening, and a panel of such colours on it."""
    rng = np.random.default_rng(0)
    # beyond the picture, too: nobody sees its end
    wall = cv2.GaussianBlur(rng.normal(0, 1, (2 * SIZE, 2 * SIZE, 3)), (0, 0), 3)
    wall = (0.5 + 0.012 / wall.std() * wall).astype(np.float32)
    spots = cv2.GaussianBlur(rng.uniform(-1, 1, (SIZE, SIZE, 3)).astype(np.float32), (0, 0), 1.0)
    spots += np.float32([0.8, 0.2, 0.2])
    spots[panel] = wall[SIZE // 2 : -SIZE // 2, SIZE // 2 : -SIZE // 2][panel]
    solid = (INSIDE & ~opening).astype(np.float32)
    views = np.empty((VIEWS, VIEWS, SIZE, SIZE, 3), np.float32)
    for t, s in np.ndindex(VIEWS, VIEWS):
        down, across = float(t - VIEWS // 2), float(s - VIEWS // 2)

        def seen(picture: FloatMap, disparity: float, first: int, v: float = down, u: float = across) -> FloatMap:
            rows, columns = Y + disparity * v + first, X + disparity * u + first
            return cv2.remap(picture, columns.astype(np.float32), rows.astype(np.float32), cv2.INTER_LINEAR)

        before = seen(solid, BOX, 0)[..., None]
        views[t, s] = before * seen(spots, BOX, 0) + (1 - before) * seen(wall, WALL, SIZE // 2)
    return LightField(views, "box", disparity_range=DisparityRange(-2, 2, "given"))


def opened(light_field: LightField) -> FloatMap:
    """Of a map that has the slit filled: what matching makes of it."""
    filled = np.where(INSIDE, BOX, WALL).astype(np.float32)
    return with_open_gaps(light_field, filled, spread_views(light_field, 25), GapParameters())


def test_a_wall_seen_through_a_slit_is_behind_it() -> None:
    """If this fails, gaps between near things that a plain wall shows through are filled, with full confidence."""
    found = opened(box_before_a_wall(opening=SLIT))
    assert (found[SLIT] == np.float32(WALL)).mean() > 0.9
    assert np.array_equal(found[~SLIT], np.where(INSIDE, np.float32(BOX), np.float32(WALL))[~SLIT])


def test_a_panel_of_the_walls_colours_stays_on_the_box() -> None:
    """If this fails, near things have holes wherever they are coloured like what is behind them."""
    found = opened(box_before_a_wall(panel=SLIT))
    assert np.array_equal(found, np.where(INSIDE, np.float32(BOX), np.float32(WALL)))


def test_a_plain_slit_that_says_nothing_stays_as_matching_has_it() -> None:
    """Where both depths fit as well the one is no better than the other, and maps must not flicker between them."""
    field = box_before_a_wall(opening=SLIT)
    pure = field.views.copy()
    # the wall, through the slit and beside the box
    pure[abs(pure - 0.5).max(axis=-1) < 0.06] = 0.5
    found = opened(LightField(pure, "plain", disparity_range=field.disparity_range))
    assert (found[SLIT] == np.float32(BOX)).all()


def closest_farther(disparity: FloatMap, colours: FloatMap, reach: int, step: float, distance2: float) -> FloatMap:
    """Plain loops over the definition of ``farther_alike``."""
    found = disparity.copy()
    height, width = disparity.shape
    for y, x in np.ndindex(height, width):
        alike: dict[int, list[Any]] = {}
        for dy, dx in set(np.ndindex(3, 3)) - {(1, 1)}:
            for n in range(1, reach + 1):
                row, column = y + n * (dy - 1), x + n * (dx - 1)
                if not (0 <= row < height and 0 <= column < width):
                    break
                far = disparity[row, column] < disparity[y, x] - np.float32(step)
                if far and ((colours[row, column] - colours[y, x]) ** 2).sum() < distance2:
                    alike.setdefault(n, []).append(disparity[row, column])
        if alike:
            found[y, x] = min(alike[min(alike)])
    return found


# the second reaches farther than the picture is wide
@pytest.mark.parametrize(("reach", "shape"), [(5, (13, 17)), (16, (40, 6))])
def test_closest_farther_pixels_of_a_like_colour_are_found(reach: int, shape: tuple[int, int]) -> None:
    rng = np.random.default_rng(3)
    disparity = rng.uniform(-1, 1, shape).astype(np.float32)
    colours = rng.choice([0.2, 0.25, 0.7], (*shape, 3)).astype(np.float32)
    lowest = cv2.erode(disparity, np.ones((2 * reach + 1, 2 * reach + 1), np.uint8))
    found = np.empty_like(disparity)
    kernels.farther_alike(disparity, lowest, colours, reach, 0.6, 0.03, found)
    expected = closest_farther(disparity, colours, reach, 0.6, 0.03)
    assert 0.2 < (expected != disparity).mean() < 0.9
    np.testing.assert_array_equal(found, expected)
