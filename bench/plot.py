"""A benchmark's result as one picture."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from bench.measure import Result
from bench.tables import AXES, per_candidate
from sepi.io.files import atomic_path


def write(result: Result, path: Path) -> None:
    """Write a PNG of times, their growth, and the plain implementations beside ours."""
    figure = Figure(figsize=(13, 7), layout="constrained")
    FigureCanvasAgg(figure)
    first, *others, last = figure.subplots(2, 3).ravel()
    steps = {name: m.median for name, m in result.group("stages").items()}
    for panel, bars, log in ((first, steps, False), (last, per_candidate(result), True)):
        panel.barh(list(bars), list(bars.values()), color="tab:green" if log else "tab:blue", log=log)
        panel.invert_yaxis()
    first.set(title="from files to maps", xlabel="seconds")
    last.set(title="initial stage beside plain ones", xlabel="seconds per candidate")
    for panel, axis in zip(others, AXES, strict=True):
        _growth(panel, result, axis)
    with atomic_path(path) as temporary:
        # without the library's version, so that equal results give equal files
        figure.savefig(temporary, dpi=100, format="png", metadata={"Software": None})


def _growth(panel: Any, result: Result, axis: str) -> None:
    for group, colour in (("growth, initial", "tab:blue"), ("growth, all stages", "tab:orange")):
        points = [m for name, m in result.group(group).items() if name.startswith(f"{axis} ")]
        if not points:
            continue
        x, y = [m.figures[axis] for m in points], [m.median for m in points]
        panel.loglog(x, y, "o-", color=colour, label=group.removeprefix("growth, "))
        last = (len(x) - 1) if axis != "threads" else 0
        panel.loglog(x, [y[last] * (value / x[last]) ** AXES[axis] for value in x], ":", color=colour)
        panel.set_xticks(x, [f"{value:g}" for value in x])
        panel.minorticks_off()
        panel.legend()
    panel.set(title=f"growth with {axis} (dotted: linear)", xlabel=axis, ylabel="seconds")
