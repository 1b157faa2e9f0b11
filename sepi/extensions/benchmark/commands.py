"""The commands ``sepi submission`` and ``sepi check-submission``."""

from __future__ import annotations

import math
from contextlib import suppress
from pathlib import Path

import click

from sepi.errors import SepiError
from sepi.process.command import SepiCommand

_PATH = click.Path(path_type=Path)
_PARTIAL = click.option("--partial", is_flag=True, help="Accept fewer than the benchmark's 12 scenes.")


@click.command(cls=SepiCommand)
@click.argument("results", metavar="RESULT...", nargs=-1, required=True, type=_PATH)
@click.option("-o", "--output", type=_PATH, default=Path("submission.zip"), show_default=True, help="Zip to write.")
@click.option(
    "--runtime", "runtimes", multiple=True, metavar="SCENE=SECONDS", help="Run time, unless in runtime.txt; repeatable."
)
@_PARTIAL
def submission(results: tuple[Path, ...], output: Path, runtimes: tuple[str, ...], partial: bool) -> None:
    """Pack RESULTs as a submission to the HCI 4D light field benchmark.

    Each RESULT is a folder that 'sepi depth --timing' wrote for one of the benchmark's 12 scenes. A submission with
    problems is not written.

    \b
    Example:
      for scene in stratified/* training/* test/*; do sepi depth "$scene" --timing; done
      sepi submission *-depth -o submission.zip
    """
    from sepi.extensions.benchmark.hci_submission import Entry, entry_of, write_submission

    seconds = dict(_runtime(text) for text in runtimes)
    entries: dict[str, Entry] = {}
    for folder in results:
        scene, entry = entry_of(folder, seconds)
        if scene in entries:
            raise SepiError(f"{folder}: scene {scene} is given twice, also as {entries[scene].disparity.parent}")
        entries[scene] = entry
    for scene in seconds.keys() - entries.keys():
        raise SepiError(f"--runtime {scene}: no result of this scene is given")
    write_submission(output, entries, partial=partial)
    click.echo(f"written: {output} ({len(entries)} scenes)")


@click.command("check-submission", cls=SepiCommand)
@click.argument("path", metavar="ZIP|FOLDER", type=_PATH)
@_PARTIAL
@click.pass_context
def check_submission(context: click.Context, path: Path, partial: bool) -> None:
    """Check a submission to the HCI 4D light field benchmark.

    The command prints a line for each problem; the exit code is 1 if there is any. It checks more than the benchmark's
    upload: values that are not finite, run times that are not positive, files that do not belong.
    """
    from sepi.extensions.benchmark.hci_submission import problems_of

    problems = problems_of(path, partial=partial)
    for problem in problems:
        click.echo(problem)
    if problems:
        context.exit(1)
    click.echo(f"{path}: no problems")


def _runtime(text: str) -> tuple[str, float]:
    """Scene and seconds from ``SCENE=SECONDS``."""
    scene, _, number = text.partition("=")
    with suppress(ValueError):
        if scene and 0 < float(number) < math.inf:
            return scene, float(number)
    raise SepiError(f"--runtime {text}: expected SCENE=SECONDS with a positive number, such as cotton=12.5")
