"""Tables as CSV and Markdown, always in the same order and format."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from sepi.io.files import atomic_path

Cell = str | float | int | None
"""Text (published figures too, as printed), a figure of ours, a count, or nothing (not at hand)."""

Row = Sequence[Cell]


@dataclass(frozen=True)
class Table:
    """Rows under a header."""

    columns: Sequence[str]
    rows: Sequence[Row]


@dataclass(frozen=True)
class Section:
    """A table of a Markdown page, under a heading of its own where it has one."""

    heading: str
    table: Table


@dataclass(frozen=True)
class Report:
    """One table of the report: machine-readable, and as a page to read.

    Attributes
    ----------
    title, caption : str
        For the page; the caption names the protocol.
    data : Table
        For the CSV file: one figure per cell.
    page : sequence of Section
        For the Markdown file.
    """

    title: str
    caption: str
    data: Table
    page: Sequence[Section]


def printed(value: float | None) -> str | None:
    """A published figure with the two decimals that the paper prints."""
    return None if value is None else f"{value:.2f}"


def write(report: Report, folder: Path, name: str) -> list[Path]:
    """Write ``NAME.csv`` and ``NAME.md``; returns their paths."""
    paths = [folder / f"{name}.csv", folder / f"{name}.md"]
    for path, text in zip(paths, (as_csv(report.data), as_markdown(report)), strict=True):
        with atomic_path(path) as temporary:
            temporary.write_text(text, encoding="utf-8", newline="\n")
    return paths


def as_csv(table: Table) -> str:
    """CSV with four decimals; an empty cell is not at hand, ``nan`` is a score over no pixels."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(table.columns)
    writer.writerows([_text(cell, decimals=4, nothing="", no_pixels="nan") for cell in row] for row in table.rows)
    return text.getvalue()


def as_markdown(report: Report) -> str:
    """A page with two decimals; an empty cell is not at hand, ``n/a`` is a score over no pixels."""
    lines = [f"# {report.title}", "", report.caption, ""]
    for section in report.page:
        if section.heading:
            lines += [f"## {section.heading}", ""]
        lines += [_markdown_row(section.table.columns), _markdown_row(_rules(section.table))]
        lines += [_markdown_row([short(cell) for cell in row]) for row in section.table.rows]
        lines.append("")
    return "\n".join(lines)


def short(cell: Cell) -> str:
    """A cell as a page shows it."""
    return _text(cell, decimals=2, nothing="", no_pixels="n/a")


def _text(cell: Cell, *, decimals: int, nothing: str, no_pixels: str) -> str:
    if cell is None:
        return nothing
    if isinstance(cell, float):
        return no_pixels if math.isnan(cell) else f"{cell:.{decimals}f}"
    return str(cell)


def _rules(table: Table) -> list[str]:
    """Left-aligned text, right-aligned figures; a column of words is one whose first filled cell is words."""
    rules = []
    for column in range(len(table.columns)):
        filled = [short(row[column]) for row in table.rows if row[column] is not None]
        rules.append("---:" if filled and filled[0][:1].isdigit() else "---")
    return rules


def _markdown_row(cells: Sequence[str]) -> str:
    return f"| {' | '.join(cell.replace('|', '/') for cell in cells)} |"
