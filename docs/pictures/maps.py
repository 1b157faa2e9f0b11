"""Rows of pictures with titles: views, disparity maps, errors."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from pictures.style import Draw, Ink, new_sheet
from sepi.lightfield import FloatMap, LightField
from sepi.report.pictures import Picture, disparity_limits, error_picture, map_picture, reference_picture

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PANEL = 1.75
"""Width of a picture in inches."""

Titled = tuple[str, Picture]


def view_panel(light_field: LightField, title: str = "reference view") -> Titled:
    """The reference view."""
    return title, reference_picture(light_field)


def truth_panel(light_field: LightField) -> Titled:
    """The true disparity, in the scene's colours."""
    assert light_field.ground_truth is not None
    return "true disparity", map_picture(light_field.ground_truth, disparity_limits(light_field))


def map_panel(light_field: LightField, disparity: FloatMap, title: str) -> Titled:
    """A disparity map, in the same colours."""
    return title, map_picture(disparity, disparity_limits(light_field))


def error_panel(light_field: LightField, disparity: FloatMap) -> Titled:
    """Its signed error, with the share of pixels that are off by more than a tenth of a pixel."""
    assert light_field.ground_truth is not None
    error = disparity - light_field.ground_truth
    share = 100 * float(np.mean(~(np.abs(error) <= 0.1)))
    return f"error; {share:.1f} % off by > 0.1", error_picture(error)


def squared_error_panel(light_field: LightField, disparity: FloatMap) -> Titled:
    """The same with the mean squared error, which the paper's tables have."""
    assert light_field.ground_truth is not None
    score = 100 * float(np.mean((disparity - light_field.ground_truth) ** 2))
    return f"error; MSE x100 {score:.2f}", error_panel(light_field, disparity)[1]


def sheet_of(rows: Sequence[Sequence[Titled]]) -> Draw:
    """All pictures on one sheet, a row below the other."""

    def draw(ink: Ink) -> Figure:
        columns = max(map(len, rows))
        sheet = new_sheet(PANEL * columns, (PANEL + 0.3) * len(rows))
        axes = sheet.subplots(len(rows), columns, squeeze=False)
        for row, places in zip(rows, axes, strict=True):
            for place in places:
                place.set_axis_off()
            for (title, picture), place in zip(row, places, strict=False):
                place.imshow(picture, interpolation="nearest")
                place.set_title(title, color=ink.text, fontsize=8)
        return sheet

    return draw
