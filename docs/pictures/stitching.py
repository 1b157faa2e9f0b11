"""How the EPIs of the rows of views are stitched into one, from a light field of the package."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from pictures.style import Draw, Ink, new_sheet
from sepi.lightfield import FloatMap, LightField, as_unit_float
from sepi.matching.stitched_epi import StitchedEpi, stitched_epi
from sepi.scenes import render

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SCENE, VIEWS = "pyramids", 5
# columns shown on either side of the pixel
REACH = 20
# on pictures, whatever the page
LINE: dict[str, Any] = {"color": "#ffd400", "linewidth": 1.2, "linestyle": "--"}


@dataclass(frozen=True)
class Example:
    """A light field, a pixel of its reference view, and the disparity of what is there."""

    light_field: LightField
    y: int
    x: int
    disparity: float


def example(size: int) -> Example:
    """The nearest pixel of a built-in scene that is not at its border, where its texture is strong."""
    light_field = render(SCENE, size=size, views=VIEWS)
    truth = light_field.ground_truth
    assert truth is not None
    inner = np.zeros(truth.shape, bool)
    inner[REACH:-REACH, REACH:-REACH] = True
    slope = np.abs(np.gradient(light_field.reference_view.mean(axis=2), axis=1))
    wanted = np.where(inner & (truth > truth[inner].max() - 0.4), slope, -1)
    y, x = np.unravel_index(int(wanted.argmax()), truth.shape)
    return Example(light_field, int(y), int(x), float(truth[y, x]))


def corresponding_epis(found: Example) -> Draw:
    """The EPI of each row of views, at the height where that row shows the pixel."""
    stitched = stitched_epi(found.light_field, found.y, found.disparity)
    rows, columns = found.light_field.grid

    def draw(ink: Ink) -> Figure:
        sheet = new_sheet(6.8, 5.2)
        panels = sheet.subplots(rows, 2, width_ratios=(1, 2.2))
        for t, (view, epi) in enumerate(panels):
            j = t - found.light_field.reference_position[0]
            _show_row(view, found, t)
            part = stitched.rows[t * columns : (t + 1) * columns]
            _show(epi, part, found.x)
            epi.plot(found.x - found.disparity * np.arange(-(columns // 2), columns // 2 + 1), range(columns), **LINE)
            epi.set_ylabel(f"j = {j}", rotation=0, ha="right", va="center")
        panels[0, 0].set_title("row y0 - d j of the views")
        panels[0, 1].set_title("its EPI: x to the right, s down")
        return sheet

    return draw


def stitched_picture(found: Example) -> Draw:
    """The stitched EPI as Eq. 1 and 2 build it, and sheared for the right candidate and for two others."""
    steps = (0.0, 0.35, -0.7)

    def draw(ink: Ink) -> Figure:
        sheet = new_sheet(7.4, 3.4)
        first, *panels = sheet.subplots(1, 1 + len(steps))
        stitched = stitched_epi(found.light_field, found.y, found.disparity)
        first.imshow(stitched.image(), aspect="auto", interpolation="nearest")
        place = found.x - found.disparity * stitched.positions
        first.plot(place, range(len(place)), **LINE)
        first.set(xticks=[], yticks=[], xlabel="x", ylabel="s': all views, row by row")
        first.set(xlim=(place.min() - REACH / 2, place.max() + REACH / 2), title="stitched EPI\nof the true d")
        for axes, step in zip(panels, steps, strict=True):
            stitched = stitched_epi(found.light_field, found.y, found.disparity + step)
            _show_upright(axes, stitched, found.x)
            samples, valid = stitched.along_line(found.x)
            spread = float(samples[valid].std(axis=0).mean())
            axes.set_title(f"d = {stitched.disparity:.2f}{' (true)' if not step else ''}\ndeviation {spread:.3f}")
        return sheet

    return draw


def _show_upright(axes: Axes, stitched: StitchedEpi, x: int) -> None:
    """The picture, sheared so that the candidate's line stands upright."""
    columns = x + np.arange(-REACH, REACH + 1)
    upright = np.zeros((len(stitched.rows), len(columns), 3), np.float32)
    for number, column in enumerate(columns):
        samples, valid = stitched.along_line(int(column))
        upright[:, number] = np.where(valid[:, None], samples, 0)
    axes.imshow(upright, aspect="auto", interpolation="nearest", extent=(-REACH - 0.5, REACH + 0.5, len(upright), 0))
    axes.axvline(0, **LINE)
    axes.set(xticks=[], yticks=[], xlabel="x + d s'")


def _show_row(axes: Axes, found: Example, t: int) -> None:
    field = found.light_field
    down, across = field.baselines[t, field.grid[1] // 2]
    y, x = found.y - found.disparity * down, found.x - found.disparity * across
    axes.imshow(as_unit_float(field.rgb_views[t, field.grid[1] // 2]))
    axes.axhline(y, **LINE)
    axes.plot([x], [y], "o", color="#ffd400", markersize=4)
    axes.set(xticks=[], yticks=[], xlim=(found.x - 30, found.x + 30), ylim=(found.y + 9, found.y - 9))


def _show(axes: Axes, rows: FloatMap, x: int) -> None:
    axes.imshow(rows, aspect="auto", interpolation="nearest")
    axes.set(xticks=[], yticks=[], xlim=(x - REACH, x + REACH))
