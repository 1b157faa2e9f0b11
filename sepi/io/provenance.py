"""Provenance of a file: the attributes of stage files and results.

The entries (:func:`sepi.stage.entry`) of the stages that led to a map, in order, are its history.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from sepi.errors import SepiError
from sepi.io.hdf5 import Attribute, read_attributes
from sepi.io.origin import origin_attributes
from sepi.lightfield import LightField
from sepi.stage import Entry, StageMaps


def package_version() -> str:
    """Version of the installed package; ``"unknown"`` in a bare source tree."""
    try:
        return version("sepi")
    except PackageNotFoundError:
        return "unknown"


def stage_attributes(light_field: LightField, history: Sequence[Entry]) -> dict[str, Attribute]:
    """Attributes of a stage file.

    Parameters
    ----------
    light_field : LightField
        With a known disparity range.
    history : sequence of Entry
        How the maps were made; the last entry is the file's own, the others become ``made_from``.
    """
    *before, last = history
    return {
        **scene_attributes(light_field),
        "stage": last["stage"],
        "choice": last["choice"],
        "parameters": json.dumps(last["parameters"], sort_keys=True),
        "made_from": json.dumps(before, sort_keys=True),
    }


def result_attributes(light_field: LightField, maps: StageMaps, digest: str | None = None) -> dict[str, Attribute]:
    """Attributes of finished maps: of which light field, and what made them, as far as they say.

    Parameters
    ----------
    light_field : LightField
    maps : StageMaps
    digest : str, optional
        As in :func:`sepi.io.origin.origin_attributes`.
    """
    made_by, origin = maps.made_by, origin_attributes(light_field, digest)
    if made_by is None:
        return {**scene_attributes(light_field), **origin}
    made = {"variant": made_by.variant, "made_from": json.dumps(made_by.history, sort_keys=True)}
    return {**scene_attributes(light_field.with_range(made_by.disparity_range)), **made, **origin}


def history_of(path: Path | None) -> list[Entry]:
    """The history of a stage file, its own entry last; none without a file."""
    if path is None:
        return []
    attributes = read_attributes(path)
    try:
        last = {"stage": str(attributes["stage"]), "choice": str(attributes["choice"])}
        return [*json.loads(attributes["made_from"]), {**last, "parameters": json.loads(attributes["parameters"])}]
    except (KeyError, ValueError, RecursionError) as error:
        raise SepiError(f"{path}: not a stage file: its attributes do not say what made it ({error})") from error


def scene_attributes(light_field: LightField) -> dict[str, Attribute]:
    """Attributes that tell which light field a file is about, and its disparity range, where that is known."""
    known = light_field.disparity_range
    searched: dict[str, Attribute] = {}
    if known is not None:
        searched = {"disparity_range": (known.minimum, known.maximum), "disparity_range_source": known.source}
    return {
        "scene": light_field.name,
        "source": light_field.source,
        **searched,
        "row_spacing": light_field.row_spacing,
        "positions": "grid" if light_field.positions is None else "given",
        "version": package_version(),
    }
