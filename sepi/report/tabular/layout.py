"""Data model of the report's tables, and their CSV and JSON; :mod:`.markdown` and :mod:`.latex` write the others."""

from __future__ import annotations

import csv
import io
import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from enum import StrEnum
from pathlib import Path
from typing import Any

from sepi.io.files import atomic_path

Cell = str | float | int | None
"""Text (also a published figure as printed), a figure of ours, a count, or None (not available)."""

Record = Mapping[str, Cell]
"""A row, key to cell. CSV files have the keys in their heads, pages those of their columns."""

BEST, SECOND = "best", "second"
"""Marks of cells."""

_NOTHING: Mapping[str, Any] = {}


class Kind(StrEnum):
    """Kind of a cell or column."""

    TEXT = "text"
    FIGURE = "figure"
    """A figure without comparison."""
    OURS = "ours"
    PUBLISHED = "published"
    """A figure as printed in the paper."""
    EXTERNAL = "external"
    """A figure of an external method's map, scored here."""
    RATIO = "ratio"
    """Our figure divided by a published one, or the reverse."""


@dataclass(frozen=True)
class Column:
    """Head, kind and number of decimals of a page's column."""

    head: str
    kind: Kind = Kind.FIGURE
    decimals: int = 2


@dataclass(frozen=True)
class Entry:
    """A cell of a page: text, figure to sort by if any, kind, and mark if any."""

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
        False if all figures are published ones.
    """

    cells: Sequence[Entry]
    kind: str = ""
    available: bool = True


@dataclass(frozen=True)
class Section:
    """A part of a page: lines under a header, and a heading that may be empty."""

    heading: str
    columns: Sequence[Column]
    rows: Sequence[Line]


@dataclass(frozen=True)
class Report:
    """One table of the report, as records and as a page.

    Attributes
    ----------
    title, caption : str
        For the page; the caption names the protocol. Words between backticks are code.
    heads : sequence of str
        Header of the CSV file.
    records : sequence of Record
        Its rows, one figure per cell.
    sections : sequence of Section
        For the Markdown and LaTeX files and the web page.
    marked : str
        Sentence that explains the marks of best and second best; empty without marks.
    """

    title: str
    caption: str
    heads: Sequence[str]
    records: Sequence[Record]
    sections: Sequence[Section]
    marked: str = ""


def entry(cell: Cell, kind: Kind = Kind.FIGURE, mark: str | None = None, note: str = "", decimals: int = 2) -> Entry:
    """A cell of a page, with a note after its figure."""
    text = f"{short(cell, decimals)} ({note})" if note else short(cell, decimals)
    return Entry(text, _value(cell, kind), kind, mark)


def section(heading: str, columns: Mapping[str, Column], lines: Iterable[Line]) -> Section:
    """A section of a page; ``columns`` by their keys, as for :func:`line`."""
    return Section(heading, [*columns.values()], [*lines])


def line(
    columns: Mapping[str, Column],
    record: Record,
    figures: Kind | None = None,
    kind: str = "",
    marks: Mapping[str, str | None] = _NOTHING,
    notes: Mapping[str, str] = _NOTHING,
) -> Line:
    """A row of a page from a record, with marks and notes by the columns' keys.

    Figures have the kind ``figures`` if given, else that of their columns.
    """
    cells = []
    for key, column in columns.items():
        cell_kind = figures if figures and column.kind != Kind.TEXT else column.kind
        cells.append(entry(record.get(key), cell_kind, marks.get(key), notes.get(key, ""), column.decimals))
    available = any(cell.text for cell in cells if cell.kind not in (Kind.TEXT, Kind.PUBLISHED))
    return Line(cells, kind, available)


def printed(value: float | None) -> str | None:
    """A published figure with the two decimals that the paper prints."""
    return None if value is None else f"{value:.2f}"


def short(cell: Cell, decimals: int = 2) -> str:
    """Text of a cell on a page: with decimals, empty if not available, ``n/a`` for a score over no pixels."""
    return _text(cell, decimals=decimals, no_pixels="n/a")


def ranks(figures: Record) -> dict[str, str | None]:
    """Marks of the least and the second least error; equal errors have equal marks.

    Parameters
    ----------
    figures : Record
        None and NaN do not count. Figures are compared as printed, with two decimals.

    Returns
    -------
    dict
        Key to :data:`BEST`, :data:`SECOND` or None; all None if there is nothing to compare.
    """
    shown = {key: float(short(figure)) for key, figure in figures.items() if short(figure) not in ("", "n/a")}
    marks = dict(zip(sorted(set(shown.values())), (BEST, SECOND), strict=False)) if len(shown) > 1 else {}
    return {key: marks.get(figure) for key, figure in shown.items()}


def write(path: Path, text: str) -> None:
    """Write a text file whole or not at all."""
    with atomic_path(path) as temporary:
        temporary.write_text(text, encoding="utf-8", newline="\n")


def as_csv(report: Report) -> str:
    """CSV with four decimals; an empty cell means not available, ``nan`` a score over no pixels."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(report.heads)
    for record in report.records:
        writer.writerow(_text(record.get(head), decimals=4, no_pixels="nan") for head in report.heads)
    return text.getvalue()


def as_json(report: Report) -> dict[str, Any]:
    """The page as JSON; texts are as in Markdown, without marks and backslashes."""
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
    """The first figure of a cell; None for words, an empty cell, and a score over no pixels."""
    if isinstance(cell, str):
        first = re.match(r"-?\d+(\.\d+)?(?=/|$)", cell) if kind in (Kind.OURS, Kind.PUBLISHED) else None
        return float(first[0]) if first else None
    return float(cell) if cell is not None and math.isfinite(cell) else None
