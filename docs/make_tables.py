"""Figures in tables of the pages, from the CSV files of a run: ``python docs/make_tables.py . README.md docs/*/*.md``.

The first word is the folder of the run; tables whose files are not there stay. A comment above a table says how its
cells are made::

    <!-- from reports/stages.csv, variant by scene: {mse100:.2f} / {badpix007:.1f} or empty -->
    <!-- from reports/edges.csv, scene variant: {area:.1f} | {mse100_there:.2f}, {mse100_away:.2f} -->

First come files, then columns of theirs: what the first cells of a row name and, after ``by``, what the heads name; in
a cell code is the name if there is any, else the words before a comma or bracket. Then come the forms of the cells,
again from the first when there is none left; after ``or empty`` cells stay empty that equal the first row's. Rows of a
file count that have ``NAME=VALUE``, as given or of :data:`USUAL`; of several for one cell it is the mean.
"""

from __future__ import annotations

import re
from functools import partial
from pathlib import Path

import click
import pandas as pd

USUAL = {"protocol": "paper", "region": "all", "stage": "optimize"}
"""Final maps as a whole."""

TABLE = re.compile(
    r"<!-- from (?P<what>[^:]+): (?P<forms>.+?)(?P<empty>\s+or\s+empty)?\s+-->\n\n?(?P<rows>(?:\|[^\n]*\n)+)", re.S
)

FIGURE = re.compile(r"\{([^:}]+):([^}]+)\}")


def name_in(cell: str) -> str:
    """What a cell of a page names."""
    return (re.search("`(.+?)`", cell) or re.match("([^,(]*)", cell) or "")[1].strip()


def _written(figures: pd.Series, form: re.Match[str]) -> str:
    return "-" if pd.isna(figures[form[1]]) else format(figures[form[1]], form[2])


def filled(table: re.Match[str], run: Path) -> str:
    """A table with the figures that a run has for it."""
    *given, named = " ".join(table["what"].split()).split(", ")
    rows, _, across = named.partition(" by ")
    keys = [*rows.split(), *filter(None, [across])]
    wanted = {k: v for k, v in USUAL.items() if k not in keys} | dict(w.split("=") for w in given if "=" in w)
    files = [run / word for word in given if "=" not in word and (run / word).exists()]
    if not files:
        return table[0]
    records = pd.concat([pd.read_csv(file, dtype=str) for file in files])
    for key in wanted.keys() & records.columns:
        # of several files some may lack the column
        records = records[records[key].fillna(wanted[key]) == wanted[key]]
    of_row = records[keys].agg("\n".join, axis=1)
    figures = records.apply(pd.to_numeric, errors="coerce").groupby(of_row).mean()
    forms = " ".join(table["forms"].split()).split(" | ")
    head, _, *cells = ([cell.strip() for cell in line.split("|")[1:-1]] for line in table["rows"].splitlines())
    names = len(rows.split())
    for row in cells:
        for place in range(names, len(row)):
            name = "\n".join([*map(name_in, row[:names]), *([name_in(head[place])] if across else [])])
            if name in figures.index:
                form = forms[(place - names) % len(forms)]
                text = FIGURE.sub(partial(_written, figures.loc[name]), form)
                row[place] = "" if table["empty"] and row != cells[0] and text == cells[0][place] else text
    start = table[0].splitlines()[: -len(cells)]
    return "\n".join([*start, *("|" + "".join(f" {c} |" if c else " |" for c in row) for row in cells), ""])


@click.command()
@click.argument("run", type=click.Path(path_type=Path, exists=True))
@click.argument("pages", nargs=-1, type=click.Path(path_type=Path, exists=True))
def main(run: Path, pages: tuple[Path, ...]) -> None:
    """Write the figures of a RUN into the tables of PAGES."""
    for page in pages:
        page.write_text(TABLE.sub(partial(filled, run=run), page.read_text(encoding="utf-8")), encoding="utf-8")


if __name__ == "__main__":
    main()
