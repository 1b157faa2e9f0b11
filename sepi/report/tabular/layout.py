"""Tables as CSV, Markdown and JSON, always in the same order and format."""

from __future__ import annotations

import csv
import io
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from sepi.io.files import atomic_path

Cell = str | float | int | None
"""Text (published figures too, as printed), a figure of ours, a count, or nothing (not available)."""

Row = Sequence[Cell]

TEXT, FIGURE, OURS, PUBLISHED, IMPORTED, RATIO = "text", "figure", "ours", "published", "imported", "ratio"
"""Kinds of cells: words; a figure that nothing is compared with; of this code; as printed by the paper; of an imported
map, scored here; ours divided by a published one, or the reverse."""

BEST, SECOND = "best", "second"
"""Marks of cells."""

# characters that Markdown reads as markup in the midst of a line; an underscore within a word is none
_MARKUP = re.compile(r"[\\`*\[\]<>&|~]|(?<![^\W_])_|_(?![^\W_])")


@dataclass(frozen=True)
class Table:
    """Rows under a header."""

    columns: Sequence[str]
    rows: Sequence[Row]


@dataclass(frozen=True)
class Column:
    """Head and kind of a page's column."""

    head: str
    kind: str = FIGURE


@dataclass(frozen=True)
class Entry:
    """A cell of a page.

    Attributes
    ----------
    cell : Cell
        What it shows.
    kind : str
        Of the kinds above.
    mark : str or None
        :data:`BEST` or :data:`SECOND`.
    note : str
        What must be known of the figure, after it.
    """

    cell: Cell
    kind: str = FIGURE
    mark: str | None = None
    note: str = ""

    @property
    def text(self) -> str:
        """As a page shows it, without the mark's sign."""
        return f"{short(self.cell)} ({self.note})" if self.note else short(self.cell)

    @property
    def value(self) -> float | None:
        """The figure; of several figures in a cell the first. None for words, nothing, and a score over no pixels."""
        cell = self.cell
        if isinstance(cell, str) and self.kind in (OURS, PUBLISHED):
            first = cell.split("/")[0]
            return float(first) if re.fullmatch(r"-?\d+(\.\d+)?", first) else None
        return float(cell) if isinstance(cell, int | float) and math.isfinite(cell) else None


@dataclass(frozen=True)
class Line:
    """A row of a page.

    Attributes
    ----------
    entries : sequence of Entry
        One per column.
    kind : str
        ``"scene"``, ``"average"``, ``"average printed"``, or empty.
    at_hand : bool
        False where all figures are published ones.
    """

    entries: Sequence[Entry]
    kind: str = ""
    at_hand: bool = True


@dataclass(frozen=True)
class Grid:
    """Lines under a header, each cell with its kind."""

    columns: Sequence[Column]
    lines: Sequence[Line]

    def without_empty(self) -> Grid:
        """The same without columns of published or imported figures or ratios in which nothing stands."""
        kept = [
            index
            for index, column in enumerate(self.columns)
            if column.kind in (TEXT, FIGURE, OURS) or any(line.entries[index].text for line in self.lines)
        ]
        lines = [Line([line.entries[i] for i in kept], line.kind, line.at_hand) for line in self.lines]
        return Grid([self.columns[i] for i in kept], lines)


@dataclass(frozen=True)
class Section:
    """A table of a page, under a heading of its own where it has one."""

    heading: str
    table: Table | Grid

    @property
    def grid(self) -> Grid:
        """The table, its cells with their kinds."""
        return self.table if isinstance(self.table, Grid) else _grid_of(self.table)


@dataclass(frozen=True)
class Report:
    """One table of the report: machine-readable, and as a page to read.

    Attributes
    ----------
    title, caption : str
        For the page; the caption names the protocol. Words between backticks are names from the program.
    data : Table
        For the CSV file: one figure per cell.
    page : sequence of Section
        For the Markdown and LaTeX files and the web page.
    marked : str
        Sentence that says what is marked as best and second best; empty where nothing is.
    """

    title: str
    caption: str
    data: Table
    page: Sequence[Section]
    marked: str = ""


def printed(value: float | None) -> str | None:
    """A published figure with the two decimals that the paper prints."""
    return None if value is None else f"{value:.2f}"


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


def write(path: Path, text: str) -> Path:
    """Write a text file whole or not at all; returns its path."""
    with atomic_path(path) as temporary:
        temporary.write_text(text, encoding="utf-8", newline="\n")
    return path


def as_csv(table: Table) -> str:
    """CSV with four decimals; an empty cell is not available, ``nan`` is a score over no pixels."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(table.columns)
    writer.writerows([_text(cell, decimals=4, nothing="", no_pixels="nan") for cell in row] for row in table.rows)
    return text.getvalue()


def as_markdown(report: Report) -> str:
    """A page with two decimals; an empty cell is not available, ``n/a`` is a score over no pixels."""
    marked = f" {report.marked} (**bold**, *italic*)." if report.marked else ""
    lines = [f"# {_plain(report.title)}", "", _with_code(report.caption) + marked, ""]
    for section in report.page:
        grid = section.grid
        if section.heading:
            lines += [f"## {_plain(section.heading)}", ""]
        lines.append(_markdown_row([_plain(column.head) for column in grid.columns]))
        lines.append(_markdown_row(["---" if column.kind == TEXT else "---:" for column in grid.columns]))
        lines += [_markdown_row([_markdown(entry) for entry in line.entries]) for line in grid.lines]
        lines.append("")
    return "\n".join(lines)


def as_json(report: Report) -> dict[str, Any]:
    """A page for a program that shows it; texts as in Markdown, but for marks and backslashes."""
    return {
        "title": report.title,
        "caption": report.caption + (f" {report.marked}." if report.marked else ""),
        "sections": [
            {
                "heading": section.heading,
                "columns": [{"head": column.head, "kind": column.kind} for column in section.grid.columns],
                "rows": [
                    {
                        "kind": line.kind,
                        "at_hand": line.at_hand,
                        "cells": [
                            {"text": entry.text, "value": entry.value, "kind": entry.kind, "mark": entry.mark}
                            for entry in line.entries
                        ],
                    }
                    for line in section.grid.lines
                ],
            }
            for section in report.page
        ],
    }


def short(cell: Cell) -> str:
    """A cell as a page shows it."""
    return _text(cell, decimals=2, nothing="", no_pixels="n/a")


def _text(cell: Cell, *, decimals: int, nothing: str, no_pixels: str) -> str:
    if cell is None:
        return nothing
    if isinstance(cell, float):
        return no_pixels if math.isnan(cell) else f"{cell:.{decimals}f}"
    return str(cell)


def _grid_of(table: Table) -> Grid:
    """Kinds guessed; a column of words is one whose first filled cell is words."""
    columns = []
    for index, head in enumerate(table.columns):
        filled = [short(row[index]) for row in table.rows if row[index] is not None]
        columns.append(Column(head, FIGURE if filled and filled[0][:1].isdigit() else TEXT))
    lines = [Line([Entry(cell, column.kind) for cell, column in zip(row, columns, strict=True)]) for row in table.rows]
    return Grid(columns, lines)


def _markdown(entry: Entry) -> str:
    sign = {BEST: "**", SECOND: "*"}.get(entry.mark or "", "")
    return f"{sign}{_plain(entry.text)}{sign}"


def _plain(text: str) -> str:
    """Text that Markdown shows as it is, in one line."""
    return _escaped(" ".join(text.splitlines()))


def _with_code(text: str) -> str:
    """Text that Markdown shows as it is, but for names between backticks."""
    parts = re.split(r"(`[^`]*`)", text)
    return "".join(part if index % 2 else _escaped(part) for index, part in enumerate(parts))


def _escaped(text: str) -> str:
    return _MARKUP.sub(r"\\\g<0>", text)


def _markdown_row(cells: Sequence[str]) -> str:
    return f"| {' | '.join(cells)} |"
