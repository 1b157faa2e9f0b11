"""Light fields of maps: GROUND_TRUTH|SCENE of commands that score maps, INPUT of refocus and poses."""

from __future__ import annotations

from dataclasses import fields, replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

from sepi.cli.input_options import Reading
from sepi.errors import SepiError

if TYPE_CHECKING:
    from sepi.camera import Camera, Part
    from sepi.cli.input_options import Geometry
    from sepi.io.disparity_maps import TruthFile
    from sepi.io.provenance import Origin
    from sepi.io.result_folder import Result
    from sepi.lightfield import FloatMap, LightField

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
    from sepi.io.all_views import read_disparity_at
    from sepi.io.disparity_maps import is_disparity
    from sepi.io.readers.view_grid import cut_like_views

    part = _part_of(estimate, reading)
    if path is None:
        if own is None:
            return None, None
        _require_view_of(estimate, reading)
        truth = own.read()
        return truth if shape is None else cut_like_views(truth, shape, part), None
    if is_disparity(path):
        if own is not None:
            raise click.UsageError(f"{path} and --truth FILE are both ground truth; give one of them")
        values = read_disparity_at(path, reading.options.view)
        require_one_view(estimate, path, reading)
        return values if shape is None else cut_like_views(values, shape, part), None
    light_field = read_light_field_of(path, estimate, reading, check_order=False)
    if own is not None:
        part = part if light_field.rig is None else None
        light_field = replace(light_field, ground_truth=own.read(light_field.shape, part))
    return light_field.ground_truth, light_field


def _part_of(estimate: Path, reading: Reading) -> Part | None:
    """Where the estimate's views were cut out, as the flags or the estimate say; None if they are no part."""
    from sepi.io.all_views import read_origin_at

    origin = read_origin_at(estimate, reading.options.view)
    if origin is None:
        return reading.options.part
    return None if origin.rectified else reading.options.part or origin.options.part


def _require_view_of(estimate: Path, reading: Reading) -> None:
    """Raise for a map of another view than --view."""
    from sepi.io.all_views import read_origin_at

    origin, view = read_origin_at(estimate, reading.options.view), reading.options.view
    if origin is not None and view not in (None, origin.view):
        (t, s), (t0, s0) = view, origin.view
        raise SepiError(f"{estimate}: depth of view {t0},{s0}, not of view {t},{s}; 'sepi depth' takes --view, too")


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
        except SepiError as error:
            failures.append(error)
            continue
        difference = origin.difference(light_field)
        if difference is None:
            return light_field
        advice = "give the light field that it was made from, with the same flags as for 'sepi depth'"
        failures.append(
            SepiError(f"{result}: {difference}, as {path} is read here; {advice}{f' ({_BARE})' if bare else ''}")
        )
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
    from sepi.io.readers.options import ReadOptions

    given, names = reading.options, [field.name for field in fields(ReadOptions)]
    unsaid = [name for name in names if getattr(given, name) == getattr(ReadOptions(), name)]
    changed = {name: getattr(origin.options, name) for name in unsaid}
    known = Reading(reading.file_format or origin.file_format, replace(given, **changed))
    return _as_it_is(origin, known)


def _as_it_is(origin: Origin, reading: Reading) -> Reading:
    """The flags, completed by view and row spacing of a result."""
    given = reading.options
    # the row spacing may be an estimate from the views
    spacing = given.row_spacing or origin.row_spacing
    return replace(reading, options=replace(given, view=given.view or origin.view, row_spacing=spacing))
