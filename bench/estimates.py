"""Compares the memory and time that the workflow's rules request with what their jobs used."""

from __future__ import annotations

import ast
import csv
from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

from sepi.errors import SepiError


class Job(NamedTuple):
    """Used and requested resources of a job, seconds and MB."""

    rule: str
    seconds: float
    megabytes: float
    asked_seconds: float
    asked_megabytes: float


def jobs_below(folder: Path) -> list[Job]:
    """All jobs with a benchmark file below a folder, written by ``snakemake --benchmark-extended``.

    Raises
    ------
    SepiError
        If there is none, or the files lack the requested resources.
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
            # Snakemake samples memory every few seconds: for shorter jobs it knows only the start
            if seconds > 1 and {"runtime", "mem_mb"} <= asked.keys():
                yield Job(row["rule_name"], seconds, megabytes, 60.0 * asked["runtime"], float(asked["mem_mb"]))


def rows(jobs: list[Job]) -> list[dict[str, str]]:
    """A row per rule: its jobs, the largest use, and the largest share of the request."""
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
