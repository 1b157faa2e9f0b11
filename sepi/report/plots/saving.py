"""Files of figures; equal figures give equal bytes."""

from __future__ import annotations

from collections.abc import Sequence
from io import BytesIO
from pathlib import Path
from typing import Any, Literal

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from sepi.io.files import atomic_path

# without matplotlib's version and the time
_OPTIONS: dict[str, dict[str, Any]] = {
    # more effort hardly makes noisy maps smaller
    "png": {"metadata": {"Software": None}, "pil_kwargs": {"compress_level": 1}},
    "pdf": {"metadata": {"Creator": None, "Producer": None, "CreationDate": None}},
}

BOTH = ("png", "pdf")
"""Endings of a figure, for the screen and for a paper."""


def new_figure(width: float, height: float, layout: Literal["constrained"] | None = "constrained") -> Figure:
    """An empty figure of this size in inches, with 100 dots per inch, without pyplot's global state."""
    figure = Figure(figsize=(width, height), dpi=100, layout=layout)
    FigureCanvasAgg(figure)
    return figure


def save_sentence(folder: Path, name: str, text: str) -> None:
    """Write a figure of words alone, in place of a chart that has nothing to show."""
    figure = new_figure(4.2, 1)
    figure.text(0.5, 0.5, text, ha="center", va="center", fontsize=8)
    save(figure, folder, name)


def save(figure: Figure, folder: Path, name: str, endings: Sequence[str] = BOTH) -> None:
    """Write a figure as ``NAME.ENDING`` for each ending, each file whole or not at all."""
    if figure.get_layout_engine() is not None:
        # one layout for all endings, since it takes longer than drawing
        figure.draw_without_rendering()
        figure.set_layout_engine("none")
    for ending in endings:
        # in memory first: on a full disk, matplotlib would fail again when it closes the file
        content = BytesIO()
        figure.savefig(content, format=ending, **_OPTIONS[ending])
        with atomic_path(folder / f"{name}.{ending}") as temporary:
            temporary.write_bytes(content.getvalue())
