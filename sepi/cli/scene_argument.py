"""Light fields that finished maps belong to: GROUND_TRUTH|SCENE of the commands that score maps, INPUT of refocus."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from sepi.cli.input_options import Reading
from sepi.errors import SepiError

if TYPE_CHECKING:
    from sepi.lightfield import FloatMap, LightField


def view_of(path: Path) -> tuple[tuple[int, int], tuple[int, int]] | None:
    """Position of the view that a map belongs to, and size of the view grid; None for a map that does not say."""
    from sepi.io.files import reading
    from sepi.io.hdf5 import read_attributes

    path = path / "result.h5" if path.is_dir() else path
    if path.suffix not in (".h5", ".hdf5") or not path.is_file():
        return None
    attributes = read_attributes(path)
    if not {"view_position", "grid"} <= set(attributes):
        return None
    with reading(path, "result of 'sepi depth'"):
        (t, s), (rows, columns) = (map(int, attributes[name]) for name in ("view_position", "grid"))
    return (t, s), (rows, columns)


def require_one_view(estimate: Path, other: Path) -> None:
    """Raise if two maps say that they belong to different views."""
    views = view_of(estimate), view_of(other)
    if None not in views and views[0] != views[1]:
        raise SepiError(f"{other}: depth of another view than {estimate}; compare maps of one view")


def read_ground_truth(path: Path, estimate: Path, reading: Reading) -> tuple[FloatMap | None, LightField | None]:
    """The ground truth for an estimate, and the light field if ``path`` is one.

    Raises
    ------
    SepiError
        If it cannot be read, or belongs to another view.
    """
    from sepi.io.disparity_maps import is_disparity, read_disparity

    if is_disparity(path):
        values = read_disparity(path)
        require_one_view(estimate, path)
        return values, None
    light_field = read_light_field_of(path, estimate, reading, check_order=False)
    return light_field.ground_truth, light_field


def read_light_field_of(path: Path, result: Path | None, reading: Reading, check_order: bool = True) -> LightField:
    """The light field that a map belongs to, seen from the map's view where the map says which that is.

    ``check_order`` as :func:`sepi.read_light_field` has it.

    Raises
    ------
    SepiError
        If it cannot be read, or is read as another view than the map's.
    """
    belongs = None if result is None else view_of(result)
    if belongs is not None and reading.options.view is None:
        reading = replace(reading, options=replace(reading.options, view=belongs[0]))
    light_field = reading.read(path, check_order=check_order)
    if belongs is not None and belongs != (light_field.reference_position, light_field.grid):
        (t, s), (rows, columns) = belongs
        raise SepiError(
            f"{result}: depth of view {t},{s} of {rows}x{columns} views, but {path} is read as view "
            f"{','.join(map(str, light_field.reference_position))} of {light_field.grid[0]}x{light_field.grid[1]}; "
            "give the flags here that 'sepi depth' had"
        )
    return light_field
