"""A benchmark's result: what was measured where, as JSON."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from pydantic import TypeAdapter, ValidationError

from bench.measure import Measurement
from sepi.errors import SepiError
from sepi.io.files import atomic_path


@dataclass(frozen=True)
class Result:
    """What one run measured.

    Attributes
    ----------
    machine : mapping
        Processor, cores and versions; no names of hosts or users.
    settings : mapping
        Scene, size, views, num_disparities, threads, repeats.
    measurements : tuple of Measurement
    format : int
        Of the file.
    """

    machine: dict[str, Any]
    settings: dict[str, Any]
    measurements: tuple[Measurement, ...]
    format: Literal[1] = 1

    def group(self, name: str) -> dict[str, Measurement]:
        """Measurements of one group by name."""
        return {m.name: m for m in self.measurements if m.group == name}


_RESULT = TypeAdapter(Result)


def write(result: Result, path: Path) -> None:
    """Write a result as JSON."""
    with atomic_path(path) as temporary:
        temporary.write_bytes(_RESULT.dump_json(result, indent=1) + b"\n")


def read(path: Path) -> Result:
    """Read a result.

    Raises
    ------
    SepiError
        If the file is missing or no result of a benchmark.
    """
    try:
        return _RESULT.validate_json(path.read_bytes())
    except OSError as error:
        raise SepiError(f"{path}: {error.strerror}") from error
    except ValidationError as error:
        reason = error.errors()[0]["msg"]
        raise SepiError(f"{path}: not a benchmark's result (expected the JSON that `run` wrote): {reason}") from error
