"""The command that writes the tables of the report, each as CSV, Markdown and LaTeX."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import click

from sepi.io.files import atomic_path
from sepi.process.command import SepiCommand
from sepi.report import published
from sepi.report.comparison import ablation_table, region_table, scene_table
from sepi.report.properties import error_bar_table, property_table
from sepi.report.properties import scene_table as rendered_scene_table
from sepi.report.runs import Runs, read_numbers
from sepi.report.scores import computed_methods_table, edge_table, parts_table, runtime_table, stage_table
from sepi.report.table import Table, as_csv, as_latex, as_markdown
from sepi.validation import require_known

BUILDERS: dict[str, Callable[[Runs], Table]] = {
    "methods": computed_methods_table,
    "table1_mse": lambda runs: scene_table(runs, "mse100", published.table1(), "Table 1: MSE x100"),
    "table2_q25": lambda runs: scene_table(runs, "q25", published.table2(), "Table 2: Q25 x100"),
    "table3_regions": region_table,
    "table4_ablation": ablation_table,
    "ablation_best": parts_table,
    "edges": edge_table,
    "error_bars": error_bar_table,
    "stages": stage_table,
    "runtime": runtime_table,
    "properties_mse": lambda runs: property_table(runs, "mse100"),
    "properties_q25": lambda runs: property_table(runs, "q25"),
    "properties_badpix": lambda runs: property_table(runs, "badpix007"),
    "scenes_mse": lambda runs: rendered_scene_table(runs, "mse100"),
    "scenes_badpix": lambda runs: rendered_scene_table(runs, "badpix007"),
}
"""Name of each table to the function that makes it."""


def table(name: str, runs: Runs) -> Table:
    """One of the tables; its caption names the scenes that are left out."""
    found = BUILDERS[name](runs)
    missing = ", ".join(f"`{scene}`" for scene in runs.plan.missing)
    return replace(found, caption=f"{found.caption} Without {missing}, not computed yet.") if missing else found


@click.command(name="python -m sepi.report.tables", cls=SepiCommand)
@click.option("--numbers", "path", type=click.Path(path_type=Path), required=True, help="From sepi.report.numbers.")
@click.option("--table", "names", type=click.Choice([*BUILDERS]), multiple=True, help="Table to write; default: all.")
@click.option("--output", type=click.Path(path_type=Path), required=True, help="Folder to write to.")
def command(path: Path, names: tuple[str, ...], output: Path) -> None:
    """Write the tables of a report's numbers as CSV, Markdown and LaTeX."""
    runs = read_numbers(path)
    require_known(f"{path}: tables", names, runs.plan.tables)
    for name in names or runs.plan.tables:
        found = table(name, runs)
        for ending, text in (("csv", as_csv(found)), ("md", as_markdown(found)), ("tex", as_latex(found, name))):
            with atomic_path(output / f"{name}.{ending}") as temporary:
                temporary.write_text(text, encoding="utf-8", newline="\n")


if __name__ == "__main__":
    command()
