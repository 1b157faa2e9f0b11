"""Figure of probes: position, SEPIs, angular patch and cost curves (figures 3 and 4 of the paper)."""

from collections.abc import Sequence
from pathlib import Path
from typing import Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from sepi.extensions.page.probe import Probe
from sepi.report.drawing import new_figure, save
from sepi.report.pictures import Picture

# colours that colour-blind people can distinguish: Okabe and Ito, https://jfly.uni-koeln.de/color/
_CURVES = {"full": "#000000", "left": "#E69F00", "right": "#56B4E9", "up": "#009E73", "down": "#D55E00"}
_QUARTER = "#999999"
# disparities of final maps: colour, dashes, width and name; the narrow line lies on the wide one, as many coincide
_MARKS: dict[str, tuple[str, Literal["-", "--", ":"], float, str]] = {
    "chosen": ("#0072B2", "-", 3.0, "chosen (final map)"),
    "best": ("#CC79A7", "--", 1.6, "variant best, 90 % interval"),
    "ground_truth": ("#000000", ":", 1.2, "ground truth"),
}
_PIXEL = "#F0E442"

_SEPIS = {"wrong": "worst candidate", "minimum": "lowest cost", "chosen": "chosen"}

# pixels of the reference view on each side of the pixel
_CROP_RADIUS = 40

_DPI = 100
# inches: a SEPI of 81 rows and 49 columns has two dots to a pixel
_HEIGHT, _SEPI_WIDTH, _PATCH = 1.62, 0.98, 0.81
_WIDTH, _ROW, _HEAD, _FOOT = 11.0, 2.14, 0.3, 0.26
_GAP, _MARGIN = 0.22, 0.1
_PICTURES = _HEIGHT + 3 * (_GAP + _SEPI_WIDTH) + _GAP + _PATCH
_PLOT = _MARGIN + _PICTURES + 0.6


def write_probes(path: Path, probes: Sequence[Probe], view: Picture) -> None:
    """Draw probes, a row each, into ``path`` with ``.png`` and with ``.pdf`` added; equal probes give equal bytes.

    A row shows the surroundings of the pixel; its SEPI at the worst candidate, at the candidate of lowest cost and at
    the final disparity, sheared so that the candidate's line is upright between the two ticks; the angular patch at the
    final disparity; and the cost curves of all views and of the halves. If the occlusion stage dropped views, bars
    beside the SEPIs mark the rows of the views kept, in the colour of their curve. SEPIs and patch of a row have the
    same stretched contrast.

    Parameters
    ----------
    path : Path
        Without ending.
    probes : sequence of Probe
        At least one.
    view : ndarray, shape (H, W, 3), uint8
        The reference view.

    Raises
    ------
    SepiError
        If a file cannot be written.
    """
    height = _HEAD + _ROW * len(probes) + _FOOT
    figure = new_figure(_WIDTH, height, layout=None)
    # one frame for all pictures, in inches, since many frames are slow
    sheet = figure.add_axes((0, 0, 1, 1))
    sheet.set_axis_off()
    for number, found in enumerate(probes):
        bottom = _FOOT + _ROW * (len(probes) - 1 - number) + 0.2
        _draw_pictures(sheet, found, view, bottom)
        area = (_PLOT / _WIDTH, bottom / height, 1 - (_PLOT + _MARGIN) / _WIDTH, _HEIGHT / height)
        _draw_curves(figure.add_axes(area), found, last=number == len(probes) - 1)
    # drawing pictures has changed the limits
    sheet.set_xlim(0, _WIDTH)
    sheet.set_ylim(0, height)
    _draw_legend(figure, probes)
    save(figure, path.parent, path.name)


def _draw_pictures(sheet: Axes, found: Probe, view: Picture, bottom: float) -> None:
    """Surroundings, SEPIs and angular patch of a probe, from ``bottom`` inches on."""
    y, x, label = found.pixel
    sheet.text(_MARGIN, bottom + _HEIGHT + 0.11, f"(y, x) = ({y}, {x}): {label}", fontsize=8, weight="bold")
    _draw_surroundings(sheet, view, y, x, bottom)
    pictures = found.stretched
    left = _MARGIN + _HEIGHT + _GAP
    for name, title in _SEPIS.items():
        _place(sheet, pictures[name], left, bottom, _SEPI_WIDTH, _HEIGHT)
        middle = left + _SEPI_WIDTH / 2
        sheet.plot([middle], [bottom - 0.03], marker="^", markersize=4, color="black")
        sheet.plot([middle], [bottom + _HEIGHT + 0.03], marker="v", markersize=4, color="black")
        _write_below(sheet, middle, bottom, f"{title}: {found.pictures[name].disparity:+.2f}")
        if not found.kept.all():
            _draw_kept(sheet, found, left - 0.06, bottom)
        left += _SEPI_WIDTH + _GAP
    T, S = found.kept.shape
    scale = _PATCH / max(T, S)
    _place(sheet, found.patch, left, bottom, S * scale, T * scale)
    _write_below(sheet, left + S * scale / 2, bottom, "views, chosen")


def _place(sheet: Axes, picture: Picture, left: float, bottom: float, width: float, height: float) -> None:
    # pixels stay visible unless there are more of them than dots
    between = "nearest" if picture.shape[0] <= height * _DPI else "antialiased"
    sheet.imshow(picture, extent=(left, left + width, bottom, bottom + height), aspect="auto", interpolation=between)


def _write_below(sheet: Axes, x: float, bottom: float, text: str) -> None:
    sheet.text(x, bottom - 0.08, text, fontsize=7, ha="center", va="top")


def _draw_surroundings(sheet: Axes, view: Picture, y: int, x: int, bottom: float) -> None:
    top, left = max(0, y - _CROP_RADIUS), max(0, x - _CROP_RADIUS)
    crop = view[top : y + _CROP_RADIUS + 1, left : x + _CROP_RADIUS + 1]
    height, width = crop.shape[:2]
    scale = _HEIGHT / max(height, width)
    ceiling = bottom + _HEIGHT
    _place(sheet, crop, _MARGIN, ceiling - height * scale, width * scale, height * scale)
    across, up = _MARGIN + (x - left + 0.5) * scale, ceiling - (y - top + 0.5) * scale
    for colour, size in (("black", 3.0), (_PIXEL, 1.5)):
        sheet.plot([across], [up], marker="o", markersize=11, fillstyle="none", color=colour, markeredgewidth=size)


def _draw_kept(sheet: Axes, found: Probe, x: float, bottom: float) -> None:
    """Bars along the rows of the SEPI whose views are kept."""
    ends = np.diff(found.kept.ravel().astype(np.int64), prepend=0, append=0)
    colour = _CURVES.get(found.kept_subset, _QUARTER)
    for begin, end in zip(np.flatnonzero(ends == 1), np.flatnonzero(ends == -1), strict=True):
        y = [bottom + _HEIGHT * (1 - place / found.kept.size) for place in (begin + 0.1, end - 0.1)]
        sheet.plot([x, x], y, color=colour, linewidth=2.5, solid_capstyle="butt")


def _draw_curves(axes: Axes, found: Probe, last: bool) -> None:
    for name, (colour, dashes, width, _) in _MARKS.items():
        value = getattr(found, name)
        if value is not None:
            axes.axvline(value, color=colour, linestyle=dashes, linewidth=width, zorder=1)
    curves = found.curves
    if found.interval is not None:
        axes.axvspan(*found.interval, color=_MARKS["best"][0], alpha=0.15, linewidth=0, zorder=0)
    for name, cost in zip(curves.names, curves.costs, strict=True):
        if name not in _CURVES and name != found.kept_subset:
            continue
        colour, important = _CURVES.get(name, _QUARTER), name in ("full", found.kept_subset)
        axes.plot(curves.disparities, cost, color=colour, linewidth=1.8 if important else 0.9, zorder=2)
        if important:
            axes.plot(*([value] for value in curves.minimum(name)), marker="o", markersize=5, color=colour, zorder=3)
    axes.set_xlim(curves.disparities[0], curves.disparities[-1])
    axes.set_ylim(0, None)
    axes.yaxis.set_major_locator(MaxNLocator(5))
    axes.tick_params(labelsize=7)
    axes.set_ylabel("mean cost", fontsize=7)
    axes.set_title(_values(found), fontsize=6, loc="left", pad=3)
    if last:
        axes.set_xlabel("disparity / pixels per view step", fontsize=7, labelpad=1)


def _values(found: Probe) -> str:
    values = {"chosen": found.chosen, "best": found.best, "ground truth": found.ground_truth}
    known = [f"{name} {value:+.3f}" for name, value in values.items() if value is not None]
    kept = "all views" if found.kept_subset == "full" else f"{found.kept_subset} views"
    return ", ".join([*known, f"kept: {kept}", f"confidence {found.confidence:.2f}"])


def _draw_legend(figure: Figure, probes: Sequence[Probe]) -> None:
    names = {"full": "all views", **{side: f"{side} half" for side in _CURVES if side != "full"}}
    handles = [Line2D([], [], color=_CURVES[name], label=label) for name, label in names.items()]
    if any(found.kept_subset not in _CURVES for found in probes):
        handles.append(Line2D([], [], color=_QUARTER, label="quarter kept"))
    handles.append(Line2D([], [], color="black", linestyle="", marker="o", markersize=5, label="lowest cost"))
    for name, (colour, dashes, width, label) in _MARKS.items():
        if any(getattr(found, name) is not None for found in probes):
            handles.append(Line2D([], [], color=colour, linestyle=dashes, linewidth=width, label=label))
    figure.legend(handles=handles, loc="upper center", ncols=len(handles), fontsize=7, frameon=False, columnspacing=1.4)
