"""View geometry and signs: the grid of views, what is seen from above, and how a point moves from view to view."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.patches import Rectangle

from pictures.style import Ink, new_sheet

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

GRID = 5
# distances in units of the focus distance; disparity is proportional to 1 / distance - 1
NEAR, FOCUS, FAR = 0.6, 1.0, 1.9


def grid_of_views(ink: Ink) -> Figure:
    """Rows and columns of views, the reference view, and the baseline of another one."""
    sheet = new_sheet(3.6, 3.4)
    axes = _empty(sheet)
    centre = GRID // 2
    for t, s in np.ndindex(GRID, GRID):
        chosen = (t, s) == (centre, centre)
        colour = ink.marked if chosen else ink.faint
        axes.add_patch(
            Rectangle((s - 0.35, t - 0.35), 0.7, 0.7, fill=False, color=colour, linewidth=2 if chosen else 1)
        )
    axes.annotate("", (centre + 2, centre + 1), (centre, centre), arrowprops={"arrowstyle": "->", "color": ink.near})
    axes.text(centre + 2, centre + 1.45, "baseline (1, 2)", color=ink.near, ha="center", va="top")
    axes.text(centre, centre - 0.42, "reference", color=ink.marked, ha="center", va="bottom")
    axes.annotate("", (-0.75, GRID - 0.6), (-0.75, -0.4), arrowprops={"arrowstyle": "->", "color": ink.text})
    axes.annotate("", (GRID - 0.6, -0.75), (-0.4, -0.75), arrowprops={"arrowstyle": "->", "color": ink.text})
    axes.text(-0.85, centre, "t: rows, down", rotation=90, ha="right", va="center")
    axes.text(centre, -0.85, "s: columns, to the right", ha="center", va="bottom")
    axes.set(xlim=(-1.3, GRID - 0.2), ylim=(GRID + 0.1, -1.3))
    return sheet


def seen_from_above(ink: Ink) -> Figure:
    """A row of cameras, and rays to points before, on and behind the focus plane."""
    sheet = new_sheet(4.4, 3.6)
    axes = _empty(sheet)
    cameras = range(-2, 3)
    axes.axhline(FOCUS, color=ink.faint, linestyle="--", linewidth=1)
    axes.text(3.3, FOCUS + 0.02, "focus distance: d = 0", color=ink.faint, ha="right", va="bottom")
    for distance, x, colour, words in (
        (NEAR, -0.6, ink.near, "nearer: d > 0"),
        (FAR, 0.9, ink.far, "farther: d < 0"),
    ):
        for camera in cameras:
            axes.plot([camera, x], [0, distance], color=colour, linewidth=0.8, alpha=0.8)
        axes.plot([x], [distance], "o", color=colour, markersize=7)
        axes.text(x, distance + 0.08, words, color=colour, ha="center", va="bottom")
    for camera in cameras:
        colour = ink.marked if camera == 0 else ink.text
        axes.plot([camera], [0], "s", color=colour, markersize=8)
        axes.text(camera, -0.1, f"s0{camera:+d}" if camera else "s0", ha="center", va="top", color=colour)
    axes.set(xlim=(-3.3, 3.4), ylim=(-0.3, FAR + 0.35), aspect="auto")
    return sheet


def points_in_views(ink: Ink) -> Figure:
    """Where the views of one row show a near and a far point."""
    sheet = new_sheet(6.6, 2.6)
    panels = sheet.subplots(1, 3)
    for step, axes in zip((-1, 0, 1), panels, strict=True):
        _frame(axes, ink, marked=step == 0)
        for disparity, (x, y), colour, name in (
            (1.5, (4.0, 2.0), ink.near, "d = 1.5"),
            (-1.0, (5.0, 4.6), ink.far, "d = -1"),
        ):
            place = x - disparity * step
            axes.plot([x, x], [y - 0.8, y + 0.8], color=ink.faint, linewidth=1, linestyle=":")
            axes.plot([place], [y], "o", color=colour, markersize=8)
            if step:
                axes.annotate("", (place, y), (x, y), arrowprops={"arrowstyle": "->", "color": colour, "shrinkB": 5})
            else:
                axes.text(place + 0.4, y, name, color=colour, va="center")
        axes.set_title({-1: "view s0 - 1: x + d", 0: "reference view s0: x", 1: "view s0 + 1: x - d"}[step])
    return sheet


def _empty(sheet: Figure) -> Axes:
    axes = sheet.subplots()
    axes.set_axis_off()
    axes.set_aspect("equal")
    return axes


def _frame(axes: Axes, ink: Ink, marked: bool) -> None:
    axes.set(xlim=(0, 9), ylim=(6, 0), xticks=[], yticks=[], aspect="equal")
    for spine in axes.spines.values():
        spine.set_color(ink.marked if marked else ink.faint)
        spine.set_linewidth(2 if marked else 1)
    axes.patch.set_visible(False)
