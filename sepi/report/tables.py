"""The command that writes the tables of the report, each as CSV, Markdown and LaTeX."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import click

from sepi.process.command import SepiCommand
from sepi.report import published
from sepi.report.runs import Runs, read_numbers
from sepi.report.tabular.ablation import ablation_table, parts_table
from sepi.report.tabular.comparison import region_table, scene_table
from sepi.report.tabular.computed_methods import computed_methods_table
from sepi.report.tabular.edges import edge_table
from sepi.report.tabular.error_bars import error_bar_table
from sepi.report.tabular.latex import as_latex
from sepi.report.tabular.layout import Report, as_csv, write
from sepi.report.tabular.markdown import as_markdown
from sepi.report.tabular.properties import property_table
from sepi.report.tabular.properties import scene_table as rendered_scene_table
from sepi.report.tabular.stages import runtime_table, stage_table
from sepi.validation import require_known

BUILDERS: dict[str, Callable[[Runs], Report]] = {
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


def table(name: str, runs: Runs) -> Report:
    """One of the tables; its caption names the scenes that are left out."""
    report = BUILDERS[name](runs)
    missing = ", ".join(f"`{scene}`" for scene in runs.plan.missing)
    return replace(report, caption=f"{report.caption} Without {missing}, not computed yet.") if missing else report


@click.command(name="python -m sepi.report.tables", cls=SepiCommand)
@click.option("--numbers", "path", type=click.Path(path_type=Path), required=True, help="From sepi.report.numbers.")
@click.option("--table", "names", type=click.Choice([*BUILDERS]), multiple=True, help="Table to write; default: all.")
@click.option("--output", type=click.Path(path_type=Path), required=True, help="Folder to write to.")
def command(path: Path, names: tuple[str, ...], output: Path) -> None:
    """Write the tables of a report's numbers as CSV, Markdown and LaTeX."""
    numbers = read_numbers(path)
    require_known(f"{path}: tables", names, numbers["tables"])
    runs = Runs(numbers)
    for name in names or numbers["tables"]:
        report = table(name, runs)
        for ending, text in (("csv", as_csv(report)), ("md", as_markdown(report)), ("tex", as_latex(report, name))):
            write(output / f"{name}.{ending}", text)


if __name__ == "__main__":
    command()
