"""Figures to files; equal figures give equal bytes."""

from __future__ import annotations

from collections.abc import Sequence
from io import BytesIO
from pathlib import Path
from typing import Any, Literal

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from sepi.io.files import atomic_path

# matplotlib would write its version and the time into the files
_OPTIONS: dict[str, dict[str, Any]] = {
    # noisy maps hardly get smaller by more effort
    "png": {"metadata": {"Software": None}, "pil_kwargs": {"compress_level": 1}},
    "pdf": {"metadata": {"Creator": None, "Producer": None, "CreationDate": None}},
}

BOTH = ("png", "pdf")
"""Endings of a figure: to look at, and for a paper."""


def new_figure(width: float, height: float, layout: Literal["constrained"] | None = "constrained") -> Figure:
    """An empty figure of this size in inches, 100 dots each; no pyplot, whose figures are global state."""
    figure = Figure(figsize=(width, height), dpi=100, layout=layout)
    FigureCanvasAgg(figure)
    return figure


def save(figure: Figure, folder: Path, name: str, endings: Sequence[str] = BOTH) -> None:
    """Write a figure as ``NAME.ENDING`` for each of the endings ``png`` and ``pdf``, each whole or not at all."""
    if figure.get_layout_engine() is not None:
        # once for all endings: a layout takes longer than a drawing, and for each file there would be both, twice
        figure.draw_without_rendering()
        figure.set_layout_engine("none")
    for ending in endings:
        # in memory first: on a full disk matplotlib fails a second time while it closes its file
        content = BytesIO()
        figure.savefig(content, format=ending, **_OPTIONS[ending])
        with atomic_path(folder / f"{name}.{ending}") as temporary:
            temporary.write_bytes(content.getvalue())
