"""The command ``python -m bench``."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import click
import numba

from bench import plot, tables
from bench.plan import GROUPS, measure
from bench.result import Result, read, write
from bench.scene import Scene
from sepi.command import SepiGroup
from sepi.errors import SepiError
from sepi.io.files import atomic_path
from sepi.scenes import SCENES
from sepi.workflow.machine import this_machine

_PATH = click.Path(path_type=Path)


@click.group(cls=SepiGroup, name="python -m bench", context_settings={"help_option_names": ["-h", "--help"]})
def main() -> None:
    """Measure time, memory and growth of the pipeline."""


@main.command()
@click.option(
    "--scene", default="curved_occluders", show_default=True, help="Built-in scene, or path of a light field."
)
@click.option("--repeats", type=click.IntRange(min=1), default=5, show_default=True, help="Timed calls of each case.")
@click.option("--threads", type=click.IntRange(min=1), help="Threads to use; one per core unless given.")
@click.option("--group", "groups", type=click.Choice(GROUPS), multiple=True, help="Measure only this; repeatable.")
@click.option("--small", is_flag=True, help="A tiny scene, once: shows that everything runs, not how fast.")
@click.option("--output", type=_PATH, default=Path("reports"), show_default=True, help="Folder to write to.")
def run(scene: str, repeats: int, threads: int | None, groups: tuple[str, ...], small: bool, output: Path) -> None:
    """Measure, and write bench.json, bench.md and bench.png."""
    if scene not in SCENES and not Path(scene).exists():
        raise SepiError(f"{scene}: neither a built-in scene ({', '.join(SCENES)}) nor a file or folder")
    if small and "large" in groups:
        raise click.UsageError("--small has no large light field; leave out --small or --group large")
    most = numba.config.NUMBA_NUM_THREADS  # type: ignore[attr-defined]
    if threads is not None and threads > most:
        raise SepiError(f"--threads {threads}: this machine runs at most {most} at once")
    settings: dict[str, Any] = {
        "scene": scene if scene in SCENES else Path(scene).name,
        "num_disparities": 21 if small else 181,
        "threads": threads or most,
        "repeats": 1 if small else repeats,
    }
    chosen = set(groups or (name for name in GROUPS if not (small and name == "large")))
    with tempfile.TemporaryDirectory(prefix="sepi-bench-") as folder:
        name = scene if scene in SCENES else str(Path(scene).absolute())
        size, views = (64, 5) if small else (512, 9)
        found, failed = measure(Scene(name, size, views, Path(folder)), settings, chosen, small)
    result = Result(this_machine(), settings, tuple(found))
    output.mkdir(parents=True, exist_ok=True)
    write(result, output / "bench.json")
    plot.write(result, output / "bench.png")
    with atomic_path(output / "bench.md") as temporary:
        temporary.write_text(_page(result), encoding="utf-8")
    click.echo(f"written to {output}/: bench.json bench.md bench.png")
    if failed:
        raise SepiError(f"{failed} of the benchmark's cases failed; the others are written")


@main.command()
@click.argument("before", type=_PATH)
@click.argument("after", type=_PATH)
def compare(before: Path, after: Path) -> None:
    """Print the results BEFORE and AFTER, two files bench.json, side by side."""
    old, new = read(before), read(after)
    table = tables.comparison(old, new)
    if not table.rows:
        raise SepiError(f"{before} and {after}: nothing was measured in both")
    for difference in tables.differences(old, new):
        click.echo(f"sepi: warning: not the same {difference}", err=True)
    click.echo(f"# Before and after\n\nMedian seconds of each case.\n\n{table.markdown()}")


def _page(result: Result) -> str:
    """The result as Markdown."""
    facts = [", ".join(f"{key} {value}" for key, value in one.items()) for one in (result.settings, result.machine)]
    parts = ["# Benchmark", f"Medians. {facts[0]}.", f"Machine: {facts[1]}."]
    for heading, table in tables.sections(result).items():
        parts += [f"## {heading}", table.markdown()]
    return "\n\n".join(parts) + "\n"


if __name__ == "__main__":
    main()
