"""What a polished floor mirrors is no deeper than the floor, and what is seen past a table's edge is no reflection."""

import numpy as np
import pytest

from sepi.lightfield import DisparityRange
from sepi.regularization.floor_reflections import FloorReflectionsParameters, without_reflections

SIZE, HORIZON, TILE = 96, 40, 14
RANGE = DisparityRange(-1.3, 1.3, "given")
Y, X = np.mgrid[:SIZE, :SIZE]
FLOOR = np.float32(-1) + np.float32(0.04) * (Y - HORIZON).astype(np.float32)
BOX = (slice(52, 70), slice(30, 44))


def hall() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """View, its true disparity, and the insides of the floor's dark tiles: a wall, and a box on a floor of tiles."""
    rng = np.random.default_rng(0)
    ground = Y >= HORIZON
    dark = ((Y - HORIZON) // TILE + X // TILE) % 2 == 1
    view = np.where(ground, np.where(dark, 0.2, 0.7), 0.5) + rng.normal(0, 0.005, (SIZE, SIZE))
    disparity = np.where(ground, FLOOR, -1).astype(np.float32)
    view[BOX], disparity[BOX] = rng.uniform(0, 1, view[BOX].shape), 1.1
    inside = np.minimum((Y - HORIZON) % TILE, X % TILE) >= 3
    inside &= np.maximum((Y - HORIZON) % TILE, X % TILE) < TILE - 3
    tiles = ground & dark & inside
    tiles[BOX] = False
    return np.repeat(view[..., None], 3, axis=2).astype(np.float32), disparity, tiles


def put_back(view: np.ndarray, disparity: np.ndarray, known: DisparityRange = RANGE) -> tuple[np.ndarray, np.ndarray]:
    return without_reflections(view, disparity, known, FloorReflectionsParameters())


def test_tiles_that_mirror_the_wall_lie_on_the_floor() -> None:
    """If this fails, a glossy floor has holes; or the box on it, or the wall, is taken for a part of it."""
    view, true, tiles = hall()
    reflected = np.where(tiles, true - 0.6, true).astype(np.float32)
    found, mirrored = put_back(view, reflected)
    # whole tiles; of those beside the box some are hidden, and those at two borders of the picture are open
    assert mirrored[tiles].mean() > 0.8
    assert not (mirrored & ~tiles).any()
    assert np.abs(found - true)[mirrored].max() < 0.02
    assert np.array_equal(found[~mirrored], reflected[~mirrored])
    assert mirrored.mean() > 0.05


@pytest.mark.parametrize("change", ["relief", "shallow", "sideways"])
def test_what_is_no_reflection_stays(change: str) -> None:
    """Holes that show texture of their own, dents, and openings in a wall that one looks along."""
    view, true, tiles = hall()
    depth = np.where(tiles, true - (0.08 if change == "shallow" else 0.6), true).astype(np.float32)
    if change == "relief":
        view[tiles] = np.random.default_rng(1).uniform(0, 1, (tiles.sum(), 1))
    known = RANGE
    if change == "sideways":
        # nearer to the right more than below
        view, depth = np.rot90(view).copy(), (np.rot90(depth) + 0.03 * (Y - SIZE / 2)).astype(np.float32)
        known = DisparityRange(-2.8, 2.8, "given")
    found, mirrored = put_back(view, depth, known)
    assert np.array_equal(found, depth)
    assert not mirrored.any()


def test_what_is_seen_past_the_edge_of_a_table_stays() -> None:
    """The plane of a table goes on in the air; what lies behind it there has it on two sides at most."""
    view, true, tiles = hall()
    beyond = (X >= 60) & (Y >= HORIZON)
    depth = np.where(beyond, -1.2, np.where(tiles, true - 0.6, true)).astype(np.float32)
    view[beyond] = 0.4
    found, mirrored = put_back(view, depth)
    assert mirrored[tiles & (X < 46)].any()
    assert np.array_equal(found[beyond], depth[beyond])


def test_a_wall_behind_one_thing_on_the_ground_stays() -> None:
    """The plane of what stands before a wall cuts the wall; what of it lies behind the plane is no picture in it."""
    plane = (FLOOR + 0.015 * (X - SIZE / 2)).astype(np.float32)
    thing = (Y >= 80) & (X >= 58) & (X < 80)
    wall = np.full((SIZE, SIZE), -1, np.float32)
    view = np.where(thing, np.random.default_rng(0).uniform(0, 1, (SIZE, SIZE)), 0.5)
    view = np.repeat(view[..., None], 3, axis=2).astype(np.float32)
    disparity = np.where(thing, plane, wall)
    found, mirrored = put_back(view, disparity, DisparityRange(-1.3, 1.7, "given"))
    assert not mirrored.any()
    assert np.array_equal(found, disparity)
