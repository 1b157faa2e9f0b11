"""A table of the report: rows of its CSV file, and sections of cells that the other formats show."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, NamedTuple

import pandas as pd

BEST, SECOND = "best", "second"
"""Marks of cells."""


class Kind(StrEnum):
    """Kind of a column."""

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


class Head(NamedTuple):
    """Head of a column, and the kind of its cells."""

    text: str
    kind: Kind = Kind.FIGURE


@dataclass(frozen=True)
class Section:
    """A part of a table.

    Attributes
    ----------
    heading : str
        May be empty.
    heads : sequence of Head
    cells : DataFrame
        Texts; a column for each head.
    marks : DataFrame
        :data:`BEST`, :data:`SECOND` or empty, of the same shape.
    rows : sequence of str
        Kind of each row: ``"scene"``, ``"average"``, ``"average printed"``, ``"published"``, ``"external"``, or empty.
    """

    heading: str
    heads: Sequence[Head]
    cells: pd.DataFrame
    marks: pd.DataFrame
    rows: Sequence[str]

    @property
    def lines(self) -> Iterator[tuple[str, bool, list[tuple[str, float | None, str]]]]:
        """Each row: kind, whether it has a figure that is not published, and cells: text, figure to sort by, mark."""
        elsewhere = [head.kind in (Kind.TEXT, Kind.PUBLISHED) for head in self.heads]
        texts, marks = self.cells.to_numpy().tolist(), self.marks.to_numpy().tolist()
        for kind, cells, marked in zip(self.rows, texts, marks, strict=True):
            found = [re.match(r"-?\d+(\.\d+)?(?=/| \(|$)", cell) for cell in cells]
            of_texts = zip(cells, found, marked, self.heads, strict=True)
            shown = [(t, float(f[0]) if f and h.kind != Kind.TEXT else None, m) for t, f, m, h in of_texts]
            published = kind in (Kind.PUBLISHED, "average printed")
            yield kind, not published and any(c for c, e in zip(cells, elsewhere, strict=True) if not e), shown


@dataclass(frozen=True)
class Table:
    """A table of the report.

    Attributes
    ----------
    title, caption : str
        The caption names the protocol. Words between backticks are code.
    rows : DataFrame
        Of the CSV file; texts, or figures to be written with four decimals.
    sections : sequence of Section
    marked : str
        Sentence that explains the marks of best and second best; empty without marks.
    """

    title: str
    caption: str
    rows: pd.DataFrame
    sections: Sequence[Section]
    marked: str = ""


def section(
    heading: str,
    heads: Mapping[str, Head],
    cells: pd.DataFrame,
    marks: pd.DataFrame | None = None,
    notes: pd.DataFrame | None = None,
    rows: Sequence[str] = (),
) -> Section:
    """A section of those columns of ``cells`` that have heads; marks and notes after the texts where there are any."""

    def like(given: pd.DataFrame | None) -> pd.DataFrame:
        found = pd.DataFrame() if given is None else given
        return shown(found.reindex(index=cells.index, columns=[*heads])).reset_index(drop=True)

    texts, noted = like(cells), like(notes)
    texts = texts.where(noted == "", texts + " (" + noted + ")")
    return Section(heading, [*heads.values()], texts, like(marks), rows or [""] * len(texts))


def shown(figures: pd.DataFrame, decimals: int = 2, missing: str = "") -> pd.DataFrame:
    """Figures with decimals as texts, counts and texts as they are, and ``missing`` for what is NaN or None."""

    def text(cell: Any) -> str:
        if pd.isna(cell):
            return missing
        return f"{cell:.{decimals}f}" if isinstance(cell, float) else str(cell)

    return figures.astype(object).map(text)


def ranks(texts: pd.DataFrame) -> pd.DataFrame:
    """Marks of the least and the second least figure in each column; equal figures have equal marks.

    Figures are compared as printed; words and empty cells do not count, and a figure alone has no mark.
    """
    figures = texts.apply(pd.to_numeric, errors="coerce")
    places = figures.rank(method="dense").loc[:, figures.count() > 1].reindex(columns=texts.columns)
    return places.map(lambda place: {1: BEST, 2: SECOND}.get(place, ""))
