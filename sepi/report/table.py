"""A table of the report: rows of its CSV file, sections of cells, and both as CSV, Markdown and LaTeX (booktabs)."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
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
    missing: str = "",
) -> Section:
    """A section of those columns of ``cells`` that have heads; marks and notes after the texts where there are any.

    Figures have two decimals, and NaN is ``missing``.
    """

    def like(given: pd.DataFrame | None, missing: str = "") -> pd.DataFrame:
        found = pd.DataFrame() if given is None else given
        return shown(found.reindex(index=cells.index, columns=[*heads]), missing=missing).reset_index(drop=True)

    texts, noted = like(cells, missing), like(notes)
    texts = texts.where(noted == "", texts + " (" + noted + ")")
    return Section(heading, [*heads.values()], texts, like(marks), rows or [""] * len(texts))


def shown(figures: pd.DataFrame, decimals: int = 2, missing: str = "") -> pd.DataFrame:
    """Figures with decimals as texts, counts and texts as they are, and ``missing`` for what is NaN or None."""

    def text(cell: Any) -> str:
        if pd.isna(cell):
            return missing
        return f"{cell:.{decimals}f}" if isinstance(cell, float) else str(cell)

    return figures.astype(object).map(text)


def ranks(cells: pd.DataFrame) -> pd.DataFrame:
    """Marks of the least and the second least figure in each column; equal figures have equal marks.

    Figures are compared as printed; words and empty cells do not count, and a figure alone has no mark.
    """
    figures = shown(cells).apply(pd.to_numeric, errors="coerce")
    places = figures.rank(method="dense").loc[:, figures.count() > 1].reindex(columns=cells.columns)
    return places.map(lambda place: {1: BEST, 2: SECOND}.get(place, ""))


# characters that are markup in the middle of a line; an underscore within a word is not
_MARKUP = re.compile(r"[\\`*\[\]<>&|~]|(?<![^\W_])_|_(?![^\W_])")

# largest number of columns on an upright page
_MOST_UPRIGHT = 8

_ESCAPES = str.maketrans(
    {
        **{character: f"\\{character}" for character in "{}$&#%_"},
        # after the end of a row, LaTeX would read these as its options
        **{character: f"{{{character}}}" for character in "[]*"},
        "\\": r"\textbackslash{}",
        "~": r"\textasciitilde{}",
        "^": r"\textasciicircum{}",
        "<": r"\textless{}",
        ">": r"\textgreater{}",
        "|": r"\textbar{}",
        '"': "{''}",
        "`": r"\textasciigrave{}",
        "×": r"$\times$",
        "±": r"$\pm$",
    }
)


def as_csv(table: Table) -> str:
    """CSV with four decimals; an empty cell means not available, or a score over no pixels."""
    return str(shown(table.rows, 4).to_csv(index=False, lineterminator="\n"))


def as_markdown(table: Table) -> str:
    """Markdown with two decimals; an empty cell means not available, ``n/a`` a score over no pixels."""
    marked = f" {table.marked} (**bold**, *italic*)." if table.marked else ""
    parts = [f"# {_plain(table.title)}", _with_code(table.caption, _plain, "`{}`".format) + marked]
    for section in table.sections:
        parts += [f"## {_plain(section.heading)}"] if section.heading else []
        parts.append(
            _marked(section, _plain, "**{}**", "*{}*").to_markdown(
                index=False,
                headers=[_plain(head.text) for head in section.heads],
                tablefmt="pipe",
                colalign=["left" if head.kind == Kind.TEXT else "right" for head in section.heads],
                disable_numparse=True,
            )
        )
    return "\n\n".join(parts) + "\n"


def as_latex(table: Table, name: str) -> str:
    """A table's sections as LaTeX table environments, for ``\\input``.

    Parameters
    ----------
    table : Table
    name : str
        Name of the file; labels are ``tab:NAME``, followed by the section's heading if there are several.

    Returns
    -------
    str
        LaTeX in UTF-8. Its first lines name the packages it needs.
    """
    packages = "booktabs,graphicx" if any(map(_is_wide, table.sections)) else "booktabs"
    parts = [f"% {_escaped(table.title)}\n% needs \\usepackage{{{packages}}}"]
    labels: list[str] = []
    for section in table.sections:
        several = section.heading if len(table.sections) > 1 else ""
        label = "-".join([f"tab:{name}", *re.findall(r"[a-z0-9_]+", several.lower())])
        while label in labels:
            label += "-again"
        labels.append(label)
        parts.append(_environment(table, section, label))
    return "\n\n".join(parts) + "\n"


def _environment(table: Table, section: Section, label: str) -> str:
    # LaTeX numbers tables itself
    title = "; ".join(filter(None, [re.sub(r"^Table \d+: ", "", table.title), section.heading]))
    marked = rf" {_escaped(table.marked)} (\textbf{{bold}}, \underline{{underlined}})." if table.marked else ""
    caption = (
        f"{_escaped(title)}. "
        + _with_code(table.caption, _escaped, lambda name: rf"\texttt{{{_escaped(name)}}}")
        + marked
    )
    cells = _marked(section, _escaped, r"\textbf{{{}}}", r"\underline{{{}}}")
    averages = [row for row, kind in enumerate(section.rows) if kind.startswith("average")]
    if averages and averages[0]:
        cells.iloc[averages[0], 0] = f"\\midrule\n{cells.iloc[averages[0], 0]}"
    wide = _is_wide(section)
    turned = r"\rotatebox{{90}}{{{}}}".format if wide else str
    heads = [_escaped(text) if kind == Kind.TEXT else turned(_escaped(text)) for text, kind in section.heads]
    text = (
        cells.set_axis(heads, axis=1)
        .style.hide(axis="index")
        .to_latex(
            hrules=True,
            position_float="centering",
            environment="table*" if wide else "table",
            column_format=f"@{{}}{''.join('l' if head.kind == Kind.TEXT else 'r' for head in section.heads)}@{{}}",
            caption=caption,
            label=label,
        )
    )
    size = "\\scriptsize\n\\setlength{\\tabcolsep}{3pt}" if wide else r"\small"
    return str(text).replace("\\centering", f"\\centering\n{size}", 1).rstrip("\n")


def _marked(section: Section, escaped: Callable[[str], str], best: str, second: str) -> pd.DataFrame:
    """The cells, escaped, and those of the best and the second best within these forms."""
    texts = section.cells.map(escaped)
    for mark, form in ((BEST, best), (SECOND, second)):
        texts = texts.where(section.marks != mark, texts.map(form.format))
    return texts


def _is_wide(section: Section) -> bool:
    return len(section.heads) > _MOST_UPRIGHT


def _escaped(text: str) -> str:
    """Text escaped for LaTeX, in one line."""
    safe = " ".join(text.splitlines()).translate(_ESCAPES)
    # two hyphens would become a dash
    return re.sub(r"-(?=-)", "-{}", safe)


def _plain(text: str) -> str:
    """Text escaped for Markdown, in one line."""
    return _MARKUP.sub(r"\\\g<0>", " ".join(text.splitlines()))


def _with_code(text: str, escaped: Callable[[str], str], code: Callable[[str], str]) -> str:
    """Escaped text, with names between backticks as code."""
    parts = re.split(r"`([^`]*)`", text)
    return "".join(code(part) if index % 2 else escaped(part) for index, part in enumerate(parts))
