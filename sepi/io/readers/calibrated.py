"""Views of calibrated cameras, from a COLMAP model, a ``transforms.json``, or a table; rectified to a light field."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from sepi.cameras.files import cameras_in, read_model
from sepi.errors import SepiError
from sepi.io.files import name_of
from sepi.io.readers.options import AS_GIVEN, ReadOptions
from sepi.lightfield import LightField


def matches(path: Path) -> bool:
    """Whether a path holds calibrated cameras."""
    return cameras_in(path) is not None


def read(path: Path, options: ReadOptions, inverse_depths: tuple[float, float] | None = None) -> LightField:
    """Rectified light field of calibrated cameras.

    Parameters
    ----------
    path : Path
    options : ReadOptions
        ``images``, ``reference``, ``exclude`` and ``view`` are used.
    inverse_depths : (float, float), optional
        Inverse depths of the farthest and the nearest surface; default: from the model's points.
    """
    from sepi.cameras.rectification import light_field_of, rectification_of

    if options.order != AS_GIVEN or options.central is not None or options.row_spacing is not None:
        raise SepiError(f"{path}: --order, --central and --row-spacing do not apply: the cameras say where views stand")
    model = read_model(path, options.images, options.part).without(options.exclude)
    light_field = light_field_of(rectification_of(model, options.reference, inverse_depths))
    return replace(light_field, name=name_of(path).name, source=str(path))
