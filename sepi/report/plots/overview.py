"""A sheet of pictures with their titles."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np
from matplotlib.image import AxesImage

from sepi.report.plots.pictures import Picture
from sepi.report.plots.saving import BOTH, new_figure, save

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
