"""Flags of every command that reads a light field."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Iterable
from dataclasses import Field, dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from sepi.io.readers.options import ReadOptions

# other imports stand in the functions, since `sepi --help` does not need them
if TYPE_CHECKING:
    from sepi.camera import Camera
    from sepi.lightfield import LightField


class Pair(click.ParamType[tuple[int, int]]):
    """Two whole numbers with a separator, such as 9x9 or 4,4."""

    def __init__(self, name: str) -> None:
        self.name = name

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> tuple[int, int]:
        from sepi.validation import pair_of

        return pair_of(value, "," if "," in self.name else "xX×") or self.fail(
            f"expected {self.name}, got {value!r}", param, ctx
        )


_POSITIVE = click.FloatRange(0, math.inf, min_open=True, max_open=True)


def default_folder(path: Path, kind: str) -> Path:
    """Default output folder of a command for an input, ``./NAME-kind``."""
    from sepi.io.files import name_of

    name = name_of(path)
    return Path(f"{name if path.is_dir() else name.stem}-{kind}")


@dataclass(frozen=True)
class Reading:
    """Flags for reading a light field."""

    file_format: str | None
    options: ReadOptions

    def read(self, path: Path, **more: Any) -> LightField:
        """The light field at ``path``, as :func:`sepi.read_light_field` reads it."""
        from sepi.reading import read_light_field

        return read_light_field(path, file_format=self.file_format, options=self.options, **more)


_KINDS: dict[str, dict[str, Any]] = {
    "Count": {"type": click.IntRange(min=1)},
    "Positive": {"type": _POSITIVE},
    "bool": {"is_flag": True},
    "tuple[str, ...]": {"multiple": True},
}


def _flag_of(option: Field[Any]) -> Callable[..., Any]:
    """Flag of an option for reading."""
    kind, about = str(option.type).removesuffix(" | None"), option.metadata
    more = {"type": Pair(about["metavar"])} if kind in ("Grid", "Position") else _KINDS.get(kind, {})
    return click.option(f"--{option.name.replace('_', '-')}", default=option.default, **about, **more)


_FLAGS = (
    click.option(
        "--format",
        "file_format",
        metavar="FORMAT",
        help="exported, cameras, hci, hci-2013, images, eslf, mosaic, tiff-stack, matlab, numpy, openlf, hdf5 or sepi; "
        "default: recognised from the files.",
    ),
    *map(_flag_of, fields(ReadOptions)),
)


_TRUTH = (
    click.option(
        "--truth",
        type=click.Path(path_type=Path),
        metavar="FILE",
        help="Ground truth: PFM, NumPy, HDF5, or a grey picture, in which 0 is unknown.",
    ),
    click.option(
        "--truth-scale",
        type=_POSITIVE,
        metavar="K",
        help="Pixels per view step of the value 1 in --truth; pictures of 8 and 16 bit need it.",
    ),
)

_SCENES = (
    click.option("--builtin", help="Built-in scene, in place of PATH."),
    click.option("--size", type=click.IntRange(min=1), default=192, show_default=True, help="Built-in: pixels a side."),
    click.option("--views", type=click.IntRange(min=2), default=9, show_default=True, help="Built-in: views a side."),
    click.option("--module", help="Module of an extension that reads PATH."),
)

view_of_result = click.option(
    "--view",
    type=Pair("ROW,COLUMN"),
    metavar="ROW,COLUMN",
    help="View to use, after 'sepi depth --all-views'; default: that of the result.",
)

range_to_search = click.option(
    "--disparity-range",
    nargs=2,
    type=float,
    metavar="MIN MAX",
    help="Disparities to search, pixels per view step; default: the scene's own, or an estimate.",
)

Geometry = Callable[..., "Camera"]
"""Function from the ``shape`` of views to their camera."""


def _flagged(command: Callable[..., Any], flags: Iterable[Callable[..., Any]]) -> Callable[..., Any]:
    for flag in reversed(list(flags)):
        command = flag(command)
    return command


def scene_flags(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add the flags of built-in scenes, and of those that extensions read, to a command."""
    return _flagged(command, _SCENES)


def reading_flags(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add the flags for reading a light field to a command, as one argument ``reading``."""

    @functools.wraps(command)
    def with_reading(*args: Any, file_format: str | None, **values: Any) -> Any:
        options = ReadOptions(**{field.name: values.pop(field.name) for field in fields(ReadOptions)})
        return command(*args, reading=Reading(file_format, options), **values)

    return _flagged(with_reading, _FLAGS)


def truth_flags(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add the flags of the user's ground truth to a command, as one argument ``own``, None without them."""

    @functools.wraps(command)
    def with_truth(*args: Any, truth: Path | None, truth_scale: float | None, **values: Any) -> Any:
        if truth is None and truth_scale is not None:
            raise click.UsageError("--truth-scale scales the numbers of --truth FILE; give --truth, too")
        from sepi.io.disparity_maps import TruthFile

        own = None if truth is None else TruthFile(truth, truth_scale)
        return command(*args, own=own, **values)

    return _flagged(with_truth, _TRUTH)


def camera_flags(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add the flags of the camera's geometry to a command, as one argument ``geometry``, None without them.

    ``geometry`` is :func:`sepi.camera.camera_from` without the shape of the views.
    """

    @functools.wraps(command)
    def with_geometry(*args: Any, **values: Any) -> Any:
        flags = {name: values.pop(name) for name in _GEOMETRY}
        missing = [_flag(name) for name, value in flags.items() if value is None]
        if 0 < len(missing) < len(flags):
            raise click.UsageError(f"metric depth needs {', '.join(map(_flag, flags))}; missing: {', '.join(missing)}")
        from sepi.camera import camera_from

        part = ReadOptions(crop_of=values.get("crop_of")).part
        geometry = None if missing else functools.partial(camera_from, **flags, crop_of=part)
        return command(*args, geometry=geometry, **values)

    flags = (
        click.option(_flag(name), name, type=float, metavar=unit, help=text) for name, (unit, text) in _GEOMETRY.items()
    )
    return _flagged(with_geometry, flags)


_GEOMETRY = {
    "focal_length_mm": ("MM", "Focal length, millimetres; with the next three: metric depth."),
    "baseline_mm": ("MM", "Distance between columns of cameras (rows, if one column), millimetres."),
    "focus_distance_m": ("M", "Depth at which disparity is 0, metres; inf for parallel cameras."),
    "sensor_size_mm": ("MM", "Longer side of the sensor that took the whole picture (see --crop-of), millimetres."),
}


def _flag(name: str) -> str:
    return "--" + name.rpartition("_")[0].replace("_", "-")
