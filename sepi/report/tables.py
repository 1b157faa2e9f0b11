"""The command that writes the tables of the report, each as CSV and Markdown."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import click

from sepi.command import SepiCommand
from sepi.report import published
from sepi.report.comparison import ablation_table, region_table, scene_table
from sepi.report.confidence import confidence_table
from sepi.report.layout import Report, write
from sepi.report.parts import parts_table
from sepi.report.plan import TABLES, Plan, Runs
from sepi.report.stages import runtime_table, stage_table

BUILDERS: dict[str, Callable[[Runs], Report]] = {
    "table1_mse": lambda runs: scene_table(runs, "mse100", published.table1(), "Table 1: MSE x100"),
    "table2_q25": lambda runs: scene_table(runs, "q25", published.table2(), "Table 2: Q25 x100"),
    "table3_regions": region_table,
    "table4_ablation": ablation_table,
    "ablation_best": parts_table,
    "confidence": confidence_table,
    "stages": stage_table,
    "runtime": runtime_table,
}
"""Name of each table to the function that makes it."""


@click.command(name="python -m sepi.report.tables", cls=SepiCommand)
@click.option("--results", type=click.Path(path_type=Path), required=True, help="Folder of the results.")
@click.option("--plan", "plan_text", required=True, help="JSON: scenes per data set, choices per variant and stage.")
@click.option("--table", "names", type=click.Choice(list(TABLES)), multiple=True, help="Table to write; default: all.")
@click.option("--output", type=click.Path(path_type=Path), required=True, help="Folder to write to.")
def command(results: Path, plan_text: str, names: tuple[str, ...], output: Path) -> None:
    """Write tables of the report as CSV and Markdown."""
    runs = Runs(Plan.from_json(results, plan_text))
    for name in names or TABLES:
        write(BUILDERS[name](runs), output, name)


if __name__ == "__main__":
    command()
