"""External methods' disparity maps of a scene, read, checked and scored.

A missing or wrong map is no error: a warning tells it, and the report's table shows the problem.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import click
import numpy as np
from pydantic import TypeAdapter, ValidationError

from sepi.errors import SepiError, warn
from sepi.evaluate import evaluations_of
from sepi.io.disparity_maps import map_file, read_disparity
from sepi.io.hdf5 import read_with_truth
from sepi.io.scores import Evaluation, ExternalSource, write_scores
from sepi.lightfield import LightField
from sepi.process.command import PATH, SepiCommand, bad_thresholds

NO_FILE = "no file"
NOT_READABLE = "not readable"
NO_VALUE = "no finite value"


_SOURCES = TypeAdapter(dict[str, ExternalSource])


def external_maps(
    light_field: LightField, sources: Mapping[str, ExternalSource], scene: str = "", thresholds: Sequence[float] = ()
) -> dict[str, Evaluation]:
    """External methods' maps of a light field with their scores, or with their problems.

    For each problem, a :class:`SepiWarning` names method, scene, file and reason. Values that are not finite stay; such
    a warning counts them, and they are scored as bad pixels.

    Parameters
    ----------
    light_field : LightField
        The scene; without ground truth there are no scores.
    sources : mapping of str to ExternalSource
        Method to its map, whose ``path`` is a file.
    scene : str
        Name of the scene in messages; default: the light field's.
    thresholds : sequence of float
        As :func:`sepi.scoring.scores.score` takes them.

    Returns
    -------
    dict of str to Evaluation
        In the order of ``sources``. A map that is missing, cannot be read, or has another size than the views or no
        finite value is None, with a problem: ``no file``, ``not readable``, ``800x600 instead of 512x512`` (width x
        height) or ``no finite value``.
    """
    scene = scene or light_field.name
    found = {method: _read(light_field, scene, method, source) for method, source in sources.items()}
    maps = {method: told["disparity"] for method, told in found.items() if "disparity" in told}
    scored = evaluations_of(light_field, maps, thresholds)
    return {method: replace(scored.get(method, Evaluation()), **told) for method, told in found.items()}


def _read(light_field: LightField, scene: str, method: str, source: ExternalSource) -> dict[str, Any]:
    """Attributes of an evaluation but scores: the map of a method, or its problem."""
    path = Path(source.path)
    digest = ""

    def without_map(problem: str, reason: str) -> dict[str, Any]:
        warn(f"external {method}, scene {scene}: {reason}", up=3)
        return {"source": str(path), "problem": problem, "sha256": digest}

    try:
        path = map_file(path)
        if not path.is_file():
            return without_map(NO_FILE, f"{path}: no such file")
        with path.open("rb") as opened:
            digest = hashlib.file_digest(opened, "sha256").hexdigest()
        disparity = read_disparity(path, scale=source.scale, offset=source.offset)
    except SepiError as error:
        return without_map(NOT_READABLE, str(error))
    except OSError as error:
        return without_map(NOT_READABLE, f"{path}: cannot be read ({error.strerror})")
    if disparity.shape != light_field.shape:
        got, expected = (f"{width}x{height}" for height, width in (disparity.shape, light_field.shape))
        return without_map(f"{got} instead of {expected}", f"{path}: {got} pixels, but the views have {expected}")
    unknown = np.count_nonzero(~np.isfinite(disparity))
    if unknown == disparity.size:
        return without_map(NO_VALUE, f"{path}: none of its values is finite")
    if unknown:
        values = f"{unknown} of {disparity.size} values"
        warn(f"external {method}, scene {scene}: {path}: {values} are not finite; they count as bad pixels", up=2)
    return {"source": str(path), "sha256": digest, "disparity": disparity}


def _sources(text: str) -> dict[str, ExternalSource]:
    try:
        return _SOURCES.validate_json(text)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        where = ".".join(["--maps", *map(str, first["loc"])])
        raise SepiError(f'{where}: {first["msg"]}; expected JSON such as {{"SPO": {{"path": "SPO/a.pfm"}}}}') from error


@click.command(name="python -m sepi.external", cls=SepiCommand)
@click.option("--light-field", "path", type=PATH, required=True, help="From ingest.")
@click.option("--truth", type=PATH, help="From sepi.truth; default: the light field's own.")
@click.option("--maps", required=True, help='JSON: {"METHOD": {"path": FILE, "scale": NUMBER, "offset": NUMBER}, ...}.')
@click.option("--scene", default="", help="Name of the scene in messages; default: the light field's own.")
@bad_thresholds
@click.option("--output", type=PATH, required=True, help="File to write (HDF5).")
def command(path: Path, truth: Path | None, maps: str, scene: str, thresholds: tuple[float, ...], output: Path) -> None:
    """Read and score the disparity maps that external methods made of a light field."""
    write_scores(output, external_maps(read_with_truth(path, truth), _sources(maps), scene, thresholds), {})


if __name__ == "__main__":
    command()
