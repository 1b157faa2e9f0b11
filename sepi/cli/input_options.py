"""Flags of every command that reads a light field, and the light fields of maps: GROUND_TRUTH|SCENE, INPUT."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Iterable
from dataclasses import Field, dataclass, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from sepi.errors import SepiError
from sepi.io.readers.options import ReadOptions

if TYPE_CHECKING:
    from sepi.camera import Camera
    from sepi.io.disparity_maps import TruthFile
    from sepi.io.provenance import Origin
    from sepi.io.result_folder import Result
    from sepi.lightfield import FloatMap, LightField

# other imports stand in the functions, since `sepi --help` does not need them


class Pair(click.ParamType[tuple[int, int]]):
    """Two whole numbers with a separator, such as 9x9 or 4,4."""

    def __init__(self, name: str) -> None:
        self.name = name

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> tuple[int, int]:
        from sepi.validation import pair_of

        found = pair_of(value, "," if "," in self.name else "xX×")
        return found or self.fail(f"expected {self.name}, got {value!r}", param, ctx)


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

    def read(self, path: Path, geometry: Geometry | None = None, **more: Any) -> LightField:
        """The light field at ``path``, as :func:`sepi.read_light_field` reads it, with the camera that is given."""
        from sepi.reading import read_light_field

        light_field = read_light_field(path, file_format=self.file_format, options=self.options, **more)
        if geometry is None:
            return light_field
        # with another camera, lengths of the calibrated rig mean nothing
        return replace(light_field, camera=geometry(shape=light_field.shape), rig=None)


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
    click.option("--module", help="Module that reads or renders PATH; for a built-in scene sepi.scenes.light_field."),
    click.option("--set", "settings", multiple=True, metavar="KEY=VALUE", help="Setting of the module; repeatable."),
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
    """Add the flags of scenes that a module reads or renders to a command."""
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

    flags = (click.option(_flag(n), n, type=float, metavar=unit, help=text) for n, (unit, text) in _GEOMETRY.items())
    return _flagged(with_geometry, flags)


_GEOMETRY = {
    "focal_length_mm": ("MM", "Focal length, millimetres; with the next three: metric depth."),
    "baseline_mm": ("MM", "Distance between columns of cameras (rows, if one column), millimetres."),
    "focus_distance_m": ("M", "Depth at which disparity is 0, metres; inf for parallel cameras."),
    "sensor_size_mm": ("MM", "Longer side of the sensor that took the whole picture (see --crop-of), millimetres."),
}


def _flag(name: str) -> str:
    return "--" + name.rpartition("_")[0].replace("_", "-")


_BARE = "a single map, such as its disparity.pfm, may be of any light field"


def require_one_view(estimate: Path, other: Path, reading: Reading) -> None:
    """Raise if two maps belong to different views."""
    from sepi.io.all_views import read_origin_at

    one, two = (read_origin_at(path, reading.options.view) for path in (estimate, other))
    if one is not None and two is not None and one.differs(two):
        raise SepiError(f"{other}: depth of another view than {estimate}; compare maps of one view ({_BARE})")


def read_ground_truth(
    path: Path | None, estimate: Path, reading: Reading, own: TruthFile | None, shape: tuple[int, int] | None
) -> tuple[FloatMap | None, LightField | None]:
    """The ground truth for an estimate (``own`` if given), and the light field if ``path`` is one.

    That of the whole picture is cut to an estimate of this ``shape``, where the flags or the estimate say how its views
    were cut.

    Raises
    ------
    SepiError
        If it cannot be read, or belongs to another view or light field.
    """
    from sepi.io.all_views import read_disparity_at, read_origin_at
    from sepi.io.disparity_maps import is_disparity
    from sepi.io.readers.view_grid import cut_like_views

    view, origin = reading.options.view, read_origin_at(estimate, reading.options.view)
    part = reading.options.part
    if origin is not None:
        part = None if origin.rectified else part or origin.options.part
    if path is None:
        if own is None:
            return None, None
        if origin is not None and view not in (None, origin.view):
            (t, s), (t0, s0) = view, origin.view
            raise SepiError(f"{estimate}: depth of view {t0},{s0}, not of view {t},{s}; 'sepi depth' takes --view, too")
        values = own.read()
    elif is_disparity(path):
        if own is not None:
            raise click.UsageError(f"{path} and --truth FILE are both ground truth; give one of them")
        values = read_disparity_at(path, view)
        require_one_view(estimate, path, reading)
    else:
        light_field = read_light_field_of(path, estimate, reading, check_order=False)
        if own is not None:
            truth = own.read(light_field.shape, part if light_field.rig is None else None)
            light_field = replace(light_field, ground_truth=truth)
        return light_field.ground_truth, light_field
    return values if shape is None else cut_like_views(values, shape, part), None


def read_light_field_of(
    path: Path, result: Path | None, reading: Reading, *, check_order: bool = True, bare: bool = True
) -> LightField:
    """The light field of a map, with the map's view as reference view.

    It is read with the result's flags, overridden by the given ones. If it was exported meanwhile and needs no flags,
    the given ones alone count.

    Parameters
    ----------
    path : Path
    result : Path or None
        The map.
    reading : Reading
        Flags of the command.
    check_order : bool
        As for :func:`sepi.read_light_field`, if the map does not record its light field.
    bare : bool
        Whether the caller accepts such maps.

    Raises
    ------
    SepiError
        If it cannot be read, or is not the light field that the map records.
    """
    from sepi.io.all_views import read_origin_at

    origin = None if result is None else read_origin_at(result, reading.options.view)
    if origin is None:
        return reading.read(path, check_order=check_order)
    failures: list[SepiError] = []
    for one in dict.fromkeys((_as_it_was(origin, reading), _as_it_is(origin, reading))):
        try:
            light_field = one.read(path, check_order=False)
            if (difference := origin.difference(light_field)) is None:
                return light_field
            advice = "give the light field that it was made from, with the same flags as for 'sepi depth'"
            others = f" ({_BARE})" if bare else ""
            raise SepiError(f"{result}: {difference}, as {path} is read here; {advice}{others}")
        except SepiError as error:
            failures.append(error)
    raise failures[0]


def camera_of(path: Path, view: tuple[int, int] | None, result: Result, geometry: Geometry | None) -> Camera | None:
    """The camera of a result: that of the flags, for the result's crop if it has one; else the result's own."""
    from sepi.camera import warn_of_infinity
    from sepi.io.all_views import read_origin_at

    if geometry is None:
        return result.camera
    origin = read_origin_at(path, view)
    part = None if origin is None else origin.options.part
    camera = geometry(shape=result.disparity.shape, **({} if part is None else {"crop_of": part}))
    warn_of_infinity(path, camera, result.disparity, result.sigma, result.unknown)
    return camera


def _as_it_was(origin: Origin, reading: Reading) -> Reading:
    """The flags, completed by those of a result."""
    given, names = reading.options, [field.name for field in fields(ReadOptions)]
    unsaid = [name for name in names if getattr(given, name) == getattr(ReadOptions(), name)]
    changed = {name: getattr(origin.options, name) for name in unsaid}
    return _as_it_is(origin, Reading(reading.file_format or origin.file_format, replace(given, **changed)))


def _as_it_is(origin: Origin, reading: Reading) -> Reading:
    """The flags, completed by view and row spacing of a result."""
    given = reading.options
    # the row spacing may be an estimate from the views
    spacing = given.row_spacing or origin.row_spacing
    return replace(reading, options=replace(given, view=given.view or origin.view, row_spacing=spacing))
