"""The tables of a report, and the command that writes all numbers of one, its tables and its charts."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import click

from sepi.io.files import write_whole
from sepi.process.command import PATH, SepiCommand
from sepi.report import published
from sepi.report.comparison import ablation_table, region_table, scene_table
from sepi.report.numbers import collect, write_numbers
from sepi.report.plan import Plan
from sepi.report.properties import error_bar_table, property_table
from sepi.report.properties import scene_table as rendered_scene_table
from sepi.report.runs import Runs, read_numbers
from sepi.report.scores import computed_methods_table, edge_table, parts_table, runtime_table, stage_table
from sepi.report.table import Table, as_csv, as_latex, as_markdown

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


def write_tables(runs: Runs, folder: Path) -> None:
    """Write the tables of a report, each as CSV, Markdown and LaTeX."""
    for name in runs.plan.tables:
        found = table(name, runs)
        for ending, text in (("csv", as_csv(found)), ("md", as_markdown(found)), ("tex", as_latex(found, name))):
            write_whole(folder / f"{name}.{ending}", text)


@click.command(name="python -m sepi.report.tables", cls=SepiCommand)
@click.option("--results", type=PATH, required=True, help="Folder of the results.")
@click.option("--plan", "path", type=PATH, required=True, help="JSON: scenes of datasets, choices of variants.")
@click.option("--output", type=PATH, required=True, help="JSON file to write, a CSV beside it.")
@click.option("--tables", "folder", type=PATH, required=True, help="Folder for the tables.")
@click.option("--charts", "figures", type=PATH, required=True, help="Folder for the charts, if the report has any.")
def command(results: Path, path: Path, output: Path, folder: Path, figures: Path) -> None:
    """Write all numbers of a report, its tables, and its charts."""
    write_numbers(collect(Plan.from_json(results, path.read_text(encoding="utf-8"))), output)
    # as a page reads them
    runs = read_numbers(output)
    write_tables(runs, folder)
    for name in runs.plan.charts:
        from sepi.report.charts import CHARTS

        CHARTS[name](figures, name, runs)


if __name__ == "__main__":
    command()
