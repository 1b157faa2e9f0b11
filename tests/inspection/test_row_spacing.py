"""Rows of views that are another distance apart than columns: found, measured, and not invented."""

import re
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from real_scenes import views_of

from sepi.inspection.arrangement import estimate_row_spacing, settle_row_spacing
from sepi.inspection.view_layouts import Views
from sepi.inspection.view_order import check_order
from sepi.io.readers.options import ORDERS
from sepi.lightfield import DisparityRange, LightField
from sepi.reading import read_light_field
from sepi.scenes import SCENES, render, write_hci


def every_other(name: str, rows: int, columns: int, views: int = 9) -> LightField:
    """Rows and columns of a scene left out: what is left is ``rows / columns`` times as far apart."""
    # 64 pixels do where one of them is a smaller part of the largest movement
    whole = render(name, size=96, views=views) if name == "curved_occluders" else render(name, size=64)
    t, s = whole.reference_position
    return LightField(whole.views[t % rows :: rows, s % columns :: columns], name)


@pytest.mark.parametrize("name", ["curved_occluders", "dots", "wall"])
@pytest.mark.parametrize(("rows", "columns"), [(2, 1), (1, 2), (3, 1), (4, 1)])
def test_spacing_is_measured(name: str, rows: int, columns: int) -> None:
    """Taken for equal, no disparity fits rows and columns at once, and depth is nonsense."""
    light_field = settle_row_spacing(every_other(name, rows, columns))
    assert light_field.row_spacing == pytest.approx(rows / columns, rel=0.03)
    assert f"{light_field.row_spacing:g} times as far apart as columns" in light_field.notes[-1]


def stretched(views: np.ndarray, factor: float) -> LightField:
    """Pictures that are higher: what moves across rows of views does so by more pixels."""
    T, S, H, W, C = views.shape
    size = (W, round(factor * H))
    higher = [cv2.resize(view, size, interpolation=cv2.INTER_AREA) for view in views.reshape(T * S, H, W, C)]
    return LightField(np.stack(higher).reshape(T, S, size[1], W, C), "stretched")


@pytest.mark.parametrize("factor", [0.85, 1.2])
def test_a_spacing_near_one_is_measured(hci: Path, factor: float) -> None:
    views = views_of(hci / "antinous").views[2:7, 2:7]
    light_field = settle_row_spacing(stretched(views, factor))
    assert light_field.row_spacing == pytest.approx(factor, rel=0.03)


@pytest.mark.parametrize("name", SCENES)
def test_equal_spacing_is_left_alone(name: str) -> None:
    light_field = render(name, size=96, views=5)
    assert settle_row_spacing(light_field) is light_field


@pytest.mark.parametrize("order", ["as-given", "flip-rows", "transpose", "transpose-flip-both"])
def test_the_order_is_found_beside_the_spacing(order: str) -> None:
    """Both are unknown at first; the one must not hide the other."""
    right = every_other("curved_occluders", 2, 1)
    T, S = right.grid
    turned_grid = (S, T) if order.startswith("transpose") else (T, S)
    numbers = ORDERS[order](np.arange(T * S).reshape(turned_grid))
    views = np.empty((T * S, *right.views.shape[2:]), right.views.dtype)
    views[numbers.ravel()] = right.views.reshape(views.shape)
    turned = LightField(views.reshape(*turned_grid, *views.shape[1:]), "turned")
    # as light fields are read: both look at the same views
    looked_at = Views(turned)
    read = settle_row_spacing(turned, looked_at)
    assert read.row_spacing == pytest.approx(0.5 if order.startswith("transpose") else 2, rel=0.03)
    found = check_order(read, views=looked_at)
    assert found.clear
    assert found.best == order


def test_one_baseline_in_a_benchmark_folder_is_that_of_rows_and_columns(tmp_path: Path) -> None:
    """Whoever says how far cameras stood apart is not told otherwise by the views."""
    light_field = replace(every_other("curved_occluders", 2, 1), disparity_range=DisparityRange(-2, 2, "given"))
    write_hci(light_field, tmp_path / "scene")
    assert read_light_field(tmp_path / "scene").row_spacing == 1
    parameters = tmp_path / "scene/parameters.cfg"
    parameters.write_text(re.sub("baseline_mm.*", "", parameters.read_text()))
    assert read_light_field(tmp_path / "scene").row_spacing == pytest.approx(2, rel=0.03)


def test_what_is_known_is_not_estimated() -> None:
    light_field = every_other("dots", 2, 1)
    told = LightField(light_field.views, "told", row_spacing=1.9)
    assert settle_row_spacing(told) is told
    positions = np.stack(np.meshgrid(2.0 * np.arange(5), np.arange(9.0), indexing="ij"), axis=2)
    placed = LightField(light_field.views, "placed", positions=positions)
    assert settle_row_spacing(placed) is placed


@pytest.mark.parametrize("part", [np.s_[2:3], np.s_[:, 2:3]])
def test_a_single_row_or_column_has_no_spacing(part: tuple[slice, ...]) -> None:
    light_field = LightField(render("dots", size=96, views=5).views[part], "line")
    assert estimate_row_spacing(Views(light_field)) is None
