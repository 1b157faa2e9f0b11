"""Where cameras stood: a position that is off by a tenth of a step is off by pixels where views are far apart."""

from dataclasses import replace

import numpy as np
import pytest

from sepi.io.readers.options import ORDERS, ReadOptions
from sepi.io.readers.view_grid import off_grid, positions_from_cameras, rearrange, with_row_spacing
from sepi.lightfield import LightField

RNG = np.random.default_rng(3)
T, S = 4, 5
STRAYS = RNG.uniform(-0.15, 0.15, (T, S, 2))


def cameras(down: float, across: float, turn: float = 0.0, strays: np.ndarray = STRAYS) -> np.ndarray:
    """Coordinates (T, S, 2) of a gantry with these steps, in millimetres, turned by an angle, strays in steps."""
    grid = (np.indices((T, S)).transpose(1, 2, 0) + strays) * (down, across)
    return grid @ np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]]) + (-703.0, 459.0)


EVERY = np.ones((T, S), bool)


@pytest.mark.parametrize("exchanged", [False, True])
@pytest.mark.parametrize(("down", "across"), [(9.0, 10.0), (-9.0, 10.0), (9.0, -10.0), (-9.0, -10.0), (4.0, 12.0)])
def test_positions_run_along_the_grid_in_steps_of_columns(down: float, across: float, exchanged: bool) -> None:
    """Whatever the unit, the directions and the order of the coordinates, disparity keeps its sign and scale."""
    coordinates = cameras(down, across)[..., :: -1 if exchanged else 1]
    positions, row_spacing, _ = positions_from_cameras(coordinates, EVERY)
    assert row_spacing == pytest.approx(abs(down / across), rel=0.05)
    expected = (np.indices((T, S)).transpose(1, 2, 0) + STRAYS) * (abs(down / across), 1)
    # the step is fitted, so that it differs by what the strays make of it
    np.testing.assert_allclose(positions - positions[0, 0], expected - expected[0, 0], rtol=0.05, atol=0.02)
    assert 0.05 < off_grid(positions, row_spacing, EVERY) < 0.25


def test_missing_views_count_nothing_and_get_the_place_of_the_grid() -> None:
    coordinates, present = cameras(10, 10, 0, 0 * STRAYS), EVERY.copy()
    present[1, 2] = False
    coordinates[1, 2] = np.nan
    positions, row_spacing, _ = positions_from_cameras(coordinates, present)
    assert row_spacing == pytest.approx(1)
    np.testing.assert_allclose(positions, np.indices((T, S)).transpose(1, 2, 0), atol=1e-9)


def test_a_single_row_and_a_single_column_have_positions_along_them() -> None:
    row, spacing, _ = positions_from_cameras(cameras(9, -10)[1:2], EVERY[1:2])
    assert spacing == 1
    np.testing.assert_allclose(np.diff(row[0, :, 1]), np.diff(np.arange(S) + STRAYS[1, :, 1]), rtol=0.1)
    assert not row[..., 0].any()
    column, spacing, _ = positions_from_cameras(cameras(-9, 10)[:, :1], EVERY[:, :1])
    assert spacing == 1
    np.testing.assert_allclose(np.diff(column[:, 0, 0]), np.diff(np.arange(T) + STRAYS[:, 0, 0]), rtol=0.1)
    assert not column[..., 1].any()


def strayed(t: int, s: int, by: float) -> np.ndarray:
    coordinates = cameras(10, 10, 0, 0 * STRAYS)
    coordinates[t, s] += by
    return coordinates


REFUSED = {
    "noise": RNG.normal(size=(T, S, 2)),
    "one camera far off": strayed(1, 2, 6.0),
    "a frame turned by 45 degrees": cameras(10, 10, np.pi / 4),
    "one coordinate for both axes": cameras(10, 10)[..., [0, 0]],
    "all alike": np.zeros((T, S, 2)),
    "not finite": strayed(0, 0, np.nan),
}


@pytest.mark.parametrize("case", REFUSED)
def test_numbers_that_are_no_grid_are_no_positions(case: str) -> None:
    """Other numbers in the names, taken for positions, would tear the views apart."""
    assert positions_from_cameras(REFUSED[case], EVERY) is None


VIEWS = RNG.integers(1, 255, (T, S, 6, 8, 1), np.uint8)


@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.parametrize("central", [None, 3])
def test_every_view_stays_where_it_was_taken_in_every_order(order: str, central: int | None) -> None:
    """Distances between the same two views, in millimetres, are the same however the grid is turned."""
    positions, row_spacing, _ = positions_from_cameras(cameras(5, 10), EVERY)
    given = LightField(VIEWS, "a", positions=positions, row_spacing=row_spacing)
    found = rearrange(given, ReadOptions(order=order, central=central))
    step = row_spacing if "transpose" in order else 1.0
    assert found.row_spacing == pytest.approx(1 / row_spacing if "transpose" in order else row_spacing)
    # directions are those of the new rows and columns
    assert (np.diff(found.positions[..., 0], axis=0) > 0).all()
    assert (np.diff(found.positions[..., 1], axis=1) > 0).all()
    regular = rearrange(replace(given, positions=None), ReadOptions(order=order, central=central))
    for light_field, places in ((found, given), (regular, replace(given, positions=None))):
        before = {VIEWS[t, s].tobytes(): places.baselines[t, s] for t, s in np.ndindex(T, S)}
        after = {light_field.views[t, s].tobytes(): light_field.baselines[t, s] for t, s in np.ndindex(found.grid)}
        reference = before[light_field.views[light_field.reference_position].tobytes()]
        for view, place in after.items():
            moved = before[view] - reference
            distance = np.abs(moved[::-1] if "transpose" in order else moved)
            np.testing.assert_allclose(np.abs(place) * step, distance, atol=1e-9)


def test_the_row_spacing_that_is_given_stretches_known_positions() -> None:
    positions, row_spacing, _ = positions_from_cameras(cameras(5, 10), EVERY)
    given = LightField(VIEWS, "a", positions=positions, row_spacing=row_spacing)
    found = with_row_spacing(given, 2 * row_spacing)
    np.testing.assert_allclose(found.baselines, given.baselines * (2, 1))
    assert found.row_spacing == 2 * row_spacing
