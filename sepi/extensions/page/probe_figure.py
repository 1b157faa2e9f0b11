"""Figure of probes: position, SEPIs, angular patch and cost curves (figures 3 and 4 of the paper)."""

from collections.abc import Sequence
from pathlib import Path
from typing import Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from sepi.extensions.page.probe import HALF_WIDTH, Probe
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

# inches: width, height of a row's pictures and of what stands round them
_WIDTH, _HEIGHT, _BETWEEN, _HEAD, _FOOT = 11.0, 1.62, 0.52, 0.5, 0.46
# widths of surroundings, SEPIs, angular patch and curves
_WIDTHS = (1.62, 0.98, 0.98, 0.98, 0.81, 3.9)
# rows of a SEPI beyond which there are more of them than dots
_MOST_ROWS = 162


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
    height = _HEAD + _HEIGHT * len(probes) + _BETWEEN * (len(probes) - 1) + _FOOT
    figure = new_figure(_WIDTH, height, layout=None)
    around = {"left": 0.01, "right": 0.95, "bottom": _FOOT / height, "top": 1 - _HEAD / height, "wspace": 0.15}
    around["hspace"] = _BETWEEN / _HEIGHT
    size = len(probes), len(_WIDTHS)
    rows = figure.subplots(*size, squeeze=False, width_ratios=_WIDTHS, gridspec_kw=around)
    for axes, found in zip(rows, probes, strict=True):
        _draw_pictures(axes[:-1], found, view)
        _draw_curves(axes[-1], found)
    rows[-1, -1].set_xlabel("disparity / pixels per view step", fontsize=7, labelpad=1)
    _draw_legend(figure, probes)
    save(figure, path.parent, path.name)


def _draw_pictures(axes: Sequence[Axes], found: Probe, view: Picture) -> None:
    """Surroundings, SEPIs and angular patch of a probe."""
    y, x, label = found.pixel
    surroundings, *sepis, patch = axes
    for axis in axes:
        axis.set_axis_off()
    surroundings.set_title(f"(y, x) = ({y}, {x}): {label}", fontsize=8, weight="bold", loc="left", pad=7)
    surroundings.imshow(view)
    for colour, size in (("black", 3.0), (_PIXEL, 1.5)):
        surroundings.plot([x], [y], marker="o", markersize=11, fillstyle="none", color=colour, markeredgewidth=size)
    reach = _CROP_RADIUS + 0.5
    surroundings.set(xlim=(x - reach, x + reach), ylim=(y + reach, y - reach))
    # pixels stay visible
    between = "nearest" if found.kept.size <= _MOST_ROWS else "antialiased"
    for axis, (name, title) in zip(sepis, _SEPIS.items(), strict=True):
        axis.imshow(found.stretched[name], aspect="auto", interpolation=between)
        axis.autoscale(False)
        for marker, place in (("^", -0.02), ("v", 1.02)):
            upright = axis.get_xaxis_transform()
            axis.plot([HALF_WIDTH], [place], marker, transform=upright, markersize=4, color="black", clip_on=False)
        _write_below(axis, f"{title}: {found.pictures[name].disparity:+.2f}")
        if not found.kept.all():
            _draw_kept(axis, found)
    patch.imshow(found.patch, interpolation="nearest")
    patch.set_anchor("S")
    _write_below(patch, "views, chosen")


def _write_below(axis: Axes, text: str) -> None:
    axis.text(0.5, -0.05, text, transform=axis.transAxes, fontsize=7, ha="center", va="top")


def _draw_kept(axis: Axes, found: Probe) -> None:
    """Bars along the rows of the SEPI whose views are kept."""
    ends = np.diff(found.kept.ravel().astype(np.int64), prepend=0, append=0)
    colour = _CURVES.get(found.kept_subset, _QUARTER)
    for begin, end in zip(np.flatnonzero(ends == 1), np.flatnonzero(ends == -1), strict=True):
        y = [begin - 0.4, end - 0.6]
        axis.plot([-3, -3], y, color=colour, linewidth=2.5, solid_capstyle="butt", clip_on=False)


def _draw_curves(axes: Axes, found: Probe) -> None:
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
    axes.yaxis.tick_right()
    axes.yaxis.set_label_position("right")
    axes.set_title(_values(found), fontsize=6, loc="left", pad=3)


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
