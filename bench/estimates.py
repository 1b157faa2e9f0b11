"""How good the memory and the time are that the workflow's rules ask a cluster for, beside what their jobs took."""

from __future__ import annotations

import ast
import csv
from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

from sepi.errors import SepiError


class Job(NamedTuple):
    """What a job took and what it had asked for: seconds and MB."""

    rule: str
    seconds: float
    megabytes: float
    asked_seconds: float
    asked_megabytes: float


def jobs_below(folder: Path) -> list[Job]:
    """Every job whose benchmark lies below a folder, as ``snakemake --benchmark-extended`` writes them.

    Raises
    ------
    SepiError
        If there is none, or they do not say what was asked for.
    """
    found = [job for path in sorted(folder.rglob("*.tsv")) for job in _jobs(path)]
    if not found:
        raise SepiError(
            f"{folder}: no job there took long enough to be measured and states memory and time; expected the folder "
            "benchmarks of a run with --benchmark-extended"
        )
    return found


def _jobs(path: Path) -> Iterable[Job]:
    with path.open(encoding="utf-8") as lines:
        for row in csv.DictReader(lines, delimiter="\t"):
            try:
                asked = ast.literal_eval(row["resources"])
                seconds, megabytes = float(row["s"]), float(row["max_rss"])
            except (KeyError, ValueError, SyntaxError) as error:
                raise SepiError(f"{path}: not of a run with --benchmark-extended ({error})") from None
            # Snakemake looks at a job's memory every few seconds: of shorter ones it knows only the start
            if seconds > 1 and {"runtime", "mem_mb"} <= asked.keys():
                yield Job(row["rule_name"], seconds, megabytes, 60.0 * asked["runtime"], float(asked["mem_mb"]))


def rows(jobs: list[Job]) -> list[dict[str, str]]:
    """One line for each rule: its jobs, the most that one took, and the largest part of what it had asked for."""
    lines = []
    for rule in dict.fromkeys(job.rule for job in jobs):
        own = [job for job in jobs if job.rule == rule]
        lines.append(
            {
                "rule": rule,
                "jobs": str(len(own)),
                "s": f"{max(job.seconds for job in own):.1f}",
                "of the time asked for": f"{max(job.seconds / job.asked_seconds for job in own):.0%}",
                "MB": f"{max(job.megabytes for job in own):.0f}",
                "of the memory asked for": f"{max(job.megabytes / job.asked_megabytes for job in own):.0%}",
            }
        )
    return lines
