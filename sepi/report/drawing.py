"""Figures by matplotlib and their files: a sheet of pictures, sparsification curves; equal figures give equal bytes."""

from __future__ import annotations

from collections.abc import Sequence
from io import BytesIO
from pathlib import Path
from typing import Any, Literal

import cv2
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.image import AxesImage

from sepi.io.files import write_whole
from sepi.lightfield import FloatMap
from sepi.report.pictures import Picture
from sepi.scoring.error_bars import STEPS, oracle, sparsification

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
        write_whole(folder / f"{name}.{ending}", content.getvalue())


# inches: width of a panel, gap round its picture, room for its title and for that of the sheet, for a third line of it
_PANEL, _GAP, _TITLE, _LINE = 3.0, 0.1, 0.4, 0.14
_DOTS = 100


def write_overview(
    folder: Path, name: str, title: str, rows: Sequence[Sequence[tuple[str, Picture]]], endings: Sequence[str] = BOTH
) -> None:
    """Write pictures of one size onto one sheet, with their titles; equal pictures give equal bytes."""
    height, width = rows[0][0][1].shape[:2]
    size = (_PANEL - _GAP, (_PANEL - _GAP) * height / width)
    lines = max(words.count("\n") + 1 for row in rows for words, _ in row)
    row_height = size[1] + _TITLE + _LINE * max(0, lines - 2) + _GAP / 2
    head = _TITLE if title else 0.0
    sheet_size = (_PANEL * max(map(len, rows)), row_height * len(rows) + head)
    figure = new_figure(*sheet_size, layout=None)
    # one frame for all pictures, in inches, since many frames are slow
    sheet = figure.add_axes((0, 0, 1, 1))
    sheet.set_axis_off()
    sheet.text(sheet_size[0] / 2, sheet_size[1] - 0.1, title, fontsize=12, ha="center", va="top", parse_math=False)
    dots = (round(size[0] * _DOTS), round(size[1] * _DOTS))
    enlarged: list[tuple[AxesImage, Picture]] = []
    for number, row in enumerate(rows):
        bottom = sheet_size[1] - head - (number + 1) * row_height + _GAP / 2
        for column, (words, picture) in enumerate(row):
            left = column * _PANEL + _GAP / 2
            extent = (left, left + size[0], bottom, bottom + size[1])
            # resized here, since matplotlib is slower and would do it for each file
            way = cv2.INTER_AREA if dots[0] < width else cv2.INTER_LINEAR
            drawn = np.asarray(cv2.resize(picture, dots, interpolation=way), np.uint8)
            image = sheet.imshow(drawn, extent=extent, aspect="auto", interpolation="none")
            if dots[0] > width:
                enlarged.append((image, picture))
            place = (left + size[0] / 2, bottom + size[1] + 0.04)
            sheet.text(*place, words, fontsize=8, ha="center", va="bottom", parse_math=False)
    # drawing pictures has changed the limits
    sheet.set_xlim(0, sheet_size[0])
    sheet.set_ylim(0, sheet_size[1])
    save(figure, folder, name, [ending for ending in endings if ending != "pdf"])
    # readers enlarge single pictures anyway, and a smaller sheet is written faster
    for image, picture in enlarged:
        image.set_data(picture)
    save(figure, folder, name, [ending for ending in endings if ending == "pdf"])


def write_curves(folder: Path, confidence: FloatMap, error: FloatMap) -> None:
    """Write the sparsification curve of a map beside the oracle's, as ``sparsification.png`` and ``.pdf``."""
    # fixed margins, since a layout engine takes longer than the rest
    figure = new_figure(5, 3.5, layout=None)
    axis = figure.add_axes((0.14, 0.14, 0.83, 0.83))
    taken = np.arange(STEPS)
    curves = {"by confidence": (sparsification(confidence, error), "-"), "oracle": (oracle(error), "--")}
    for name, (curve, style) in curves.items():
        axis.plot(taken, curve, style, label=f"{name}, area {curve.mean():.3f}")
    axis.set_xlabel("pixels taken away / %")
    axis.set_ylabel("mean absolute error x100 / px")
    axis.set_ylim(bottom=0)
    axis.legend()
    save(figure, folder, "sparsification")
