"""The command ``sepi depth`` with ``--all-views``."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from inspect import cleandoc
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from sepi.process.command import SepiCommand, progress_bar

if TYPE_CHECKING:
    from sepi.extensions.views.all_views import ViewMaps
    from sepi.lightfield import LightField
    from sepi.stage import Progress, StageMaps
    from sepi.variants import Variant

_TEXT = """
With --all-views the command also writes a map for every view (docs/depth/all_views.md).

\b
Example:
  sepi depth cotton --all-views
"""
_FLAG = click.Option(["--all-views"], is_flag=True, help="Also write all_views.h5: a map for each view; takes longer.")


def extended(command: SepiCommand) -> SepiCommand:
    """The command with the flag ``--all-views``."""
    plain = command.callback
    assert plain is not None

    def depth(all_views: bool, **given: Any) -> None:
        plain(**given, also=_write_all_views if all_views else None)

    text = f"{cleandoc(command.help or '')}\n{_TEXT}"
    return SepiCommand(command.name, params=[*command.params, _FLAG], callback=depth, help=text)


def _write_all_views(
    folder: Path,
    light_field: LightField,
    maps: StageMaps,
    variant: Variant,
    parameters: Mapping[str, Mapping[str, Any]],
    memory: int | None,
) -> None:
    """Write the maps of all views beside a result."""
    from sepi.extensions.views.all_views import maps_of_all_views
    from sepi.extensions.views.files import write_all_views
    from sepi.io.provenance import result_attributes
    from sepi.io.result_files import ALL_VIEWS
    from sepi.io.result_folder import write_as_taken

    def of_views(progress: Progress) -> Iterator[tuple[tuple[int, int], ViewMaps]]:
        for position, view in maps_of_all_views(light_field, maps, variant, parameters, progress, memory):
            # also for the picture that its calibrated camera took
            if position != light_field.reference_position:
                write_as_taken(folder, light_field, view["disparity"], position, view.get("sigma"))
            yield position, view

    made_by = result_attributes(light_field, maps)
    with progress_bar(f"{light_field.name}, all views") as progress:
        write_all_views(folder / ALL_VIEWS, light_field, of_views(progress), made_by)
