"""A benchmark's result: what was measured where, as JSON."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from bench.measure import Measurement
from sepi.errors import SepiError
from sepi.io.files import atomic_path

FORMAT = 1


@dataclass(frozen=True)
class Result:
    """What one run measured.

    Attributes
    ----------
    machine : mapping
        Processor, cores and versions; no names of hosts or users.
    settings : mapping
        Scene, size, views, candidates, threads, repeats.
    measurements : tuple of Measurement
    """

    machine: dict[str, Any]
    settings: dict[str, Any]
    measurements: tuple[Measurement, ...]

    def group(self, name: str) -> dict[str, Measurement]:
        """Measurements of one group by name."""
        return {m.name: m for m in self.measurements if m.group == name}


def write(result: Result, path: Path) -> None:
    """Write a result as JSON."""
    content = {"format": FORMAT, **asdict(result)}
    with atomic_path(path) as temporary:
        temporary.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")


def read(path: Path) -> Result:
    """Read a result.

    Raises
    ------
    SepiError
        If the file is missing or no result of a benchmark.
    """
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
        if content["format"] != FORMAT:
            raise SepiError(f"{path}: a benchmark's result of format {content['format']}, expected {FORMAT}")
        measurements = tuple(
            Measurement(**{**m, "seconds": tuple(map(float, m["seconds"]))}) for m in content["measurements"]
        )
        if not all(m.seconds for m in measurements):
            raise ValueError
        return Result(content["machine"], content["settings"], measurements)
    except OSError as error:
        raise SepiError(f"{path}: {error.strerror}") from error
    except (ValueError, KeyError, TypeError) as error:
        raise SepiError(f"{path}: not a benchmark's result (expected the JSON that `run` wrote)") from error
