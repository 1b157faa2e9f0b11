"""Wrong arguments in Python are told at once and in one line, not by wrong maps or another exception later."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import sepi
from sepi.scenes import render
from sepi.variants import VARIANTS, stage_parameters

VIEWS = np.zeros((3, 3, 64, 64, 3), np.uint8)


def field(**more: Any) -> Callable[[], object]:
    return lambda: sepi.LightField(**{"views": VIEWS, "name": "mine", **more})


WRONG: dict[str, tuple[Callable[[], object], str]] = {
    "pixels before views": (
        field(views=np.zeros((64, 64, 5, 5, 3), np.uint8)),
        r"mine: .*64x64 views of 5x5.*transpose",
    ),
    "equal positions": (field(positions=np.zeros((3, 3, 2))), "mine: positions must differ"),
    "positions of text": (field(positions=np.full((3, 3, 2), "a")), "mine: positions must be finite"),
    "list of positions": (field(positions=[[0, 0]]), "mine: positions: expected an array"),
    "far range": (field(disparity_range=sepi.DisparityRange(-1e6, 1e6, "given")), "mine: disparity range .*from 64 on"),
    "range as tuple": (
        field(disparity_range=(-1, 1)),
        r"mine: disparity_range: expected a DisparityRange, got \(-1, 1\)",
    ),
    "range of text": (lambda: sepi.DisparityRange("a", 1, "given"), "got 'a' and 1"),  # type: ignore[arg-type]
    "camera as tuple": (field(camera=(1, 2, 3)), "mine: camera: expected a Camera"),
    "camera of text": (lambda: sepi.Camera("a", 1, 1), "camera: expected"),  # type: ignore[arg-type]
    "view of three": (field(view=(0, 0, 0)), "mine: view: expected two whole numbers"),
    "view between": (field(view=(0.5, 0)), "mine: view: expected two whole numbers"),
    "path as name": (field(name=Path("mine")), "name of the light field: expected text"),
    "masks of numbers": (
        field(masks={"sky": np.ones((64, 64), np.uint8)}),
        "mine: masks must be bool, got sky of uint8",
    ),
    "spacing of text": (field(row_spacing="a"), "mine: row_spacing must be a positive number, got 'a'"),
    "options: grid": (lambda: sepi.ReadOptions(grid="5x5"), "options: grid: expected two whole"),  # type: ignore[arg-type]
    "options: exclude": (lambda: sepi.ReadOptions(exclude=((0, 0),)), "options: exclude: "),  # type: ignore[arg-type]
    "options: central": (lambda: sepi.ReadOptions(central="3"), "options: central: "),  # type: ignore[arg-type]
    "options: pattern": (lambda: sepi.ReadOptions(pattern=3), "options: pattern: "),  # type: ignore[arg-type]
}


@pytest.mark.parametrize("wrong", WRONG)
def test_a_wrong_argument_is_told_in_one_line(wrong: str) -> None:
    make, message = WRONG[wrong]
    with pytest.raises(sepi.SepiError, match=message):
        make()


def test_lists_and_numbers_of_numpy_are_what_they_look_like() -> None:
    light_field = render("dots", size=64, views=3)
    assert replace(light_field, view=[0, 2]).reference_position == (0, 2)  # type: ignore[arg-type]
    assert sepi.ReadOptions(view=np.array([0, 2])).view == (0, 2)  # type: ignore[arg-type]
    settings = stage_parameters(VARIANTS["paper"], {"initial": {"num_disparities": np.int64(31)}})
    assert settings["initial"].num_disparities == 31  # type: ignore[attr-defined]
