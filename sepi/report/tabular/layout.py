"""What a table of the report is, as CSV and JSON; :mod:`.markdown` and :mod:`.latex` write the others."""

from __future__ import annotations

import csv
import io
import math
import re
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from enum import StrEnum
from pathlib import Path
from typing import Any

from sepi.io.files import atomic_path

Cell = str | float | int | None
"""Text (published figures too, as printed), a figure of ours, a count, or nothing (not available)."""

Row = Sequence[Cell]

BEST, SECOND = "best", "second"
"""Marks of cells."""


class Kind(StrEnum):
    """What a cell or column holds."""

    TEXT = "text"
    FIGURE = "figure"
    """A figure that nothing is compared with."""
    OURS = "ours"
    PUBLISHED = "published"
    """As printed by the paper."""
    EXTERNAL = "external"
    """Of another method's map, scored here."""
    RATIO = "ratio"
    """Ours divided by a published one, or the reverse."""


@dataclass(frozen=True)
class Column:
    """Head and kind of a page's column."""

    head: str
    kind: Kind = Kind.FIGURE


@dataclass(frozen=True)
class Entry:
    """A cell of a page: its text, the figure to sort it by if it has one, its kind, and its mark if it has one."""

    text: str
    value: float | None
    kind: Kind
    mark: str | None = None


@dataclass(frozen=True)
class Line:
    """A row of a page.

    Attributes
    ----------
    cells : sequence of Entry
        One per column.
    kind : str
        ``"scene"``, ``"average"``, ``"average printed"``, or empty.
    available : bool
        False where all figures are published ones.
    """

    cells: Sequence[Entry]
    kind: str = ""
    available: bool = True


@dataclass(frozen=True)
class Section:
    """A part of a page: lines under a header, and under a heading where it is not empty."""

    heading: str
    columns: Sequence[Column]
    rows: Sequence[Line]


@dataclass(frozen=True)
class Report:
    """One table of the report: machine-readable, and as a page to read.

    Attributes
    ----------
    title, caption : str
        For the page; the caption names the protocol. Words between backticks are names from the program.
    heads, data : sequence
        Header and rows of the CSV file: one figure per cell.
    sections : sequence of Section
        For the Markdown and LaTeX files and the web page.
    marked : str
        Sentence that says what is marked as best and second best; empty where nothing is.
    """

    title: str
    caption: str
    heads: Sequence[str]
    data: Sequence[Row]
    sections: Sequence[Section]
    marked: str = ""


def entry(cell: Cell, kind: Kind = Kind.FIGURE, mark: str | None = None, note: str = "") -> Entry:
    """A cell of a page; what must be known of its figure, the note, stands after it."""
    text = f"{short(cell)} ({note})" if note else short(cell)
    return Entry(text, _value(cell, kind), kind, mark)


def entries(columns: Sequence[Column], cells: Row, figures: Kind | None = None) -> list[Entry]:
    """Cells of the kinds of their columns; where ``figures`` is given, all that are no words are of that kind."""
    kinds = [figures if figures and column.kind != Kind.TEXT else column.kind for column in columns]
    return [entry(cell, kind) for cell, kind in zip(cells, kinds, strict=True)]


def printed(value: float | None) -> str | None:
    """A published figure with the two decimals that the paper prints."""
    return None if value is None else f"{value:.2f}"


def short(cell: Cell) -> str:
    """A cell as a page shows it: two decimals, empty where not available, ``n/a`` for a score over no pixels."""
    return _text(cell, decimals=2, no_pixels="n/a")


def ranks(values: Sequence[float | None]) -> list[str | None]:
    """Mark the least and the second least of some errors, equal ones alike.

    Parameters
    ----------
    values : sequence of float or None
        None and NaN take no part. Compared as printed, with two decimals: what looks equal is equal.

    Returns
    -------
    list of str or None
        :data:`BEST`, :data:`SECOND` or None for each; no mark where there is nothing to compare.
    """
    shown = [None if value is None or math.isnan(value) else round(value, 2) for value in values]
    known = [value for value in shown if value is not None]
    marks = dict(zip(sorted(set(known)), (BEST, SECOND), strict=False)) if len(known) > 1 else {}
    return [None if value is None else marks.get(value) for value in shown]


def write(path: Path, text: str) -> None:
    """Write a text file whole or not at all."""
    with atomic_path(path) as temporary:
        temporary.write_text(text, encoding="utf-8", newline="\n")


def as_csv(report: Report) -> str:
    """CSV with four decimals; an empty cell is not available, ``nan`` is a score over no pixels."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(report.heads)
    writer.writerows([_text(cell, decimals=4, no_pixels="nan") for cell in row] for row in report.data)
    return text.getvalue()


def as_json(report: Report) -> dict[str, Any]:
    """A page for a program that shows it; texts as in Markdown, but for marks and backslashes."""
    return {
        "title": report.title,
        "caption": report.caption + (f" {report.marked}." if report.marked else ""),
        "sections": [asdict(section) for section in report.sections],
    }


def _text(cell: Cell, *, decimals: int, no_pixels: str) -> str:
    if isinstance(cell, float):
        return no_pixels if math.isnan(cell) else f"{cell:.{decimals}f}"
    return "" if cell is None else str(cell)


def _value(cell: Cell, kind: Kind) -> float | None:
    """The figure; of several in a cell the first. None for words, nothing, and a score over no pixels."""
    if isinstance(cell, str):
        first = re.match(r"-?\d+(\.\d+)?(?=/|$)", cell) if kind in (Kind.OURS, Kind.PUBLISHED) else None
        return float(first[0]) if first else None
    return float(cell) if cell is not None and math.isfinite(cell) else None
