"""Scores in tables of the pages, from what ``snakemake --config hci_root=... -- all ablation`` made.

``python docs/make_tables.py . README.md docs/reproduce/ablations.md`` after a run here; the first word is the folder
that it was run in. Above such a table a comment says how scores are written, ``<!-- scores {mse100:.2f} -->``, by the
heads of ``reports/stages.csv``. Cells are filled where a row names a variant as code and a column a scene; after the
words ``or empty`` those are left empty that equal the first row's.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Mapping
from pathlib import Path

import click

Scores = Mapping[tuple[str, str], Mapping[str, float]]
"""Variant and scene to scores of the whole final map."""

_TABLE = re.compile(r"<!-- scores (.+?)( or empty)? -->\n\n?((?:\|.*\n)+)")


def read_scores(file: Path) -> Scores:
    """What a run's table of stages says."""
    with file.open(encoding="utf-8", newline="") as opened:
        rows = [row for row in csv.DictReader(opened) if (row["protocol"], row["region"]) == ("paper", "all")]
    # the last stage of each comes last; maps of other programs have none
    ours = [row for row in rows if row["stage"] != "external"]
    return {(row["variant"], row["scene"]): {k: float(v) for k, v in [*row.items()][7:]} for row in ours}


def filled(page: str, scores: Scores) -> str:
    """A page with the scores that are known in its tables."""

    def table(found: re.Match[str]) -> str:
        head, _, *rows = ([cell.strip() for cell in row.split("|")[1:-1]] for row in found[3].splitlines())
        for row in rows:
            variant = re.search("`(.+?)`", row[0])
            for place, scene in enumerate(head):
                one = scores.get((variant[1] if variant else "", scene))
                if one is not None:
                    text = found[1].format(**one)
                    row[place] = "" if found[2] and row is not rows[0] and text == rows[0][place] else text
        lines = found[0].splitlines()[: -len(rows)]
        lines += ["|" + "".join(f" {cell} |" if cell else " |" for cell in row) for row in rows]
        return "\n".join(lines) + "\n"

    return _TABLE.sub(table, page)


@click.command()
@click.argument("run", type=click.Path(path_type=Path, exists=True))
@click.argument("pages", nargs=-1, type=click.Path(path_type=Path, exists=True))
def main(run: Path, pages: tuple[Path, ...]) -> None:
    """Write the scores of a RUN into the tables of PAGES."""
    scores = read_scores(run / "reports" / "stages.csv")
    for page in pages:
        page.write_text(filled(page.read_text(encoding="utf-8"), scores), encoding="utf-8")


if __name__ == "__main__":
    main()
