"""The command ``sepi scenes``."""

from __future__ import annotations

from collections.abc import Generator, Iterable, Sequence
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
import numpy as np

from sepi.command import SepiCommand
from sepi.errors import SepiError
from sepi.models import validated
from sepi.rendered.catalogue import NOISE_LEVELS, RENDERED, WITHOUT_NOISE, exposed_name
from sepi.validation import require_known, settings_of

if TYPE_CHECKING:
    from sepi.rendered.options import Exposure, RenderOptions
    from sepi.rendered.render_file import Render

_PATH = click.Path(path_type=Path)


@click.command(cls=SepiCommand)
@click.argument("names", metavar="[NAME]...", nargs=-1)
@click.option("-o", "--output", type=_PATH, default=Path("scenes"), show_default=True, help="Folder to write to.")
@click.option("--rendered", is_flag=True, help="Path-traced scenes (Mitsuba 3, extra [render]); minutes for each.")
@click.option("--size", type=click.IntRange(min=1), help="Pixels a side of a view; default: 192, with --rendered 512.")
@click.option("--views", type=click.IntRange(min=2), default=9, show_default=True, help="Views a side of the grid.")
@click.option("--samples", type=click.IntRange(min=1), help="With --rendered: paths for each pixel; default: 64.")
@click.option(
    "--noise",
    "levels",
    type=click.Choice(NOISE_LEVELS),
    multiple=True,
    help="With --rendered: noise of the sensor; repeatable, a folder for each; default: off.",
)
@click.option(
    "--set",
    "settings",
    multiple=True,
    metavar="KEY=VALUE",
    help="With --rendered: lens=0.5, vignetting=0.4, ...; repeatable. docs/reproduce/rendered.md lists them.",
)
@click.option("--all-views", is_flag=True, help="With --rendered: also write a disparity map for each view.")
@click.option("--list", "only_list", is_flag=True, help="List the scenes and write nothing.")
def scenes(
    names: tuple[str, ...],
    output: Path,
    rendered: bool,
    size: int | None,
    views: int,
    samples: int | None,
    levels: tuple[str, ...],
    settings: tuple[str, ...],
    all_views: bool,
    only_list: bool,
) -> None:
    """Write scenes, with exact ground truth, as HCI 4D benchmark folders.

    Without NAMEs, all scenes are written. Built-in scenes consist of planar shapes and take seconds. Scenes of
    --rendered are path-traced, with plain walls, gloss, mirrors and glass; a file NAME.h5 beside the folder has their
    light, and disparity, normals and masks of every view.

    \b
    Examples:
      sepi scenes --list
      sepi scenes pyramids stripes -o scenes --size 256
      sepi scenes --rendered sticks --size 256 --samples 16 --noise off --noise low
    """
    if only_list:
        _list(rendered)
    elif rendered:
        given: dict[str, Any] = {"grid": [views, views]}
        given |= {key: value for key, value in (("size", size), ("samples", samples)) if value is not None}
        _write_rendered(
            names,
            output,
            given | settings_of(settings, "lens=0.5"),
            dict.fromkeys(levels or (WITHOUT_NOISE,)),
            all_views,
        )
    else:
        only = {"--samples": samples, "--noise": levels, "--set": settings, "--all-views": all_views}
        for flag in (flag for flag, value in only.items() if value):
            raise click.UsageError(f"{flag} needs --rendered")
        _write_builtin(names, output, 192 if size is None else size, views)


def _list(rendered: bool) -> None:
    from sepi.scenes import SCENES

    told = {name: f"{entry.description}: {entry.tests}" for name, entry in RENDERED.items()} if rendered else SCENES
    width = max(map(len, told))
    for name, description in told.items():
        click.echo(f"{name.ljust(width)}  {description}")


def _write_builtin(names: Sequence[str], output: Path, size: int, views: int) -> None:
    from sepi.scenes import SCENES, render, write_hci

    require_known("built-in scenes", names, SCENES)
    chosen = dict.fromkeys(names or SCENES)
    _require_new(output, chosen)
    for name in chosen:
        write_hci(render(name, size=size, views=views), output / name)
        click.echo(f"written: {output / name}/")


def _write_rendered(
    names: Sequence[str],
    output: Path,
    settings: dict[str, Any],
    levels: Sequence[str] | dict[str, None],
    all_views: bool,
) -> None:
    from sepi.rendered.options import Exposure, RenderOptions
    from sepi.rendered.tracing import require_mitsuba

    require_known("path-traced scenes", names, RENDERED)
    chosen = list(dict.fromkeys(names or RENDERED))
    require_known("--set", settings, (*RenderOptions.model_fields, *Exposure.model_fields))
    of_render, of_sensor = (
        {key: value for key, value in settings.items() if key in model.model_fields}
        for model in (RenderOptions, Exposure)
    )
    options = validated(RenderOptions, of_render, "--set")
    exposures = [validated(Exposure, {"noise": level, **of_sensor}, "--set") for level in levels]
    folders = [exposed_name(name, one.noise, one.noise_seed) for name in chosen for one in exposures]
    _require_new(output, folders)
    require_mitsuba()
    with closing(_renders(chosen, options, output)) as renders:
        for render in renders:
            for exposure in exposures:
                folder = output / exposed_name(render.name, exposure.noise, exposure.noise_seed)
                _write_folder(render, exposure, folder, all_views)
                click.echo(f"written: {folder}/")


def _renders(names: Sequence[str], options: RenderOptions, output: Path) -> Generator[Render]:
    """Renders from existing files if made with the same options; others are computed."""
    from sepi.cli.side_by_side import render_scenes
    from sepi.rendered.render_file import read_render
    from sepi.rendered.rendering import made_by

    files = {name: output / f"{name}.h5" for name in names}
    missing = [name for name, path in files.items() if not path.is_file()]
    for name, path in files.items():
        if name not in missing:
            known = read_render(path)
            if known.made_by != made_by(name, options):
                raise SepiError(f"{path}: was rendered with other options; remove it, or choose another folder with -o")
            yield known
    with closing(render_scenes(missing, options, output)) as rendered:
        yield from (read_render(files[name]) for name in rendered)


def _write_folder(render: Render, exposure: Exposure, folder: Path, all_views: bool) -> None:
    from sepi.camera import camera_from
    from sepi.rendered.exposure import exposed
    from sepi.scenes.folder import write_hci

    light_field = exposed(render, exposure)
    camera = camera_from(**render.settings, shape=light_field.shape, crop_of=None)
    maps = {"gt_depth_lowres": camera.depth(render.disparity[render.centre])}
    if all_views:
        views = render.disparity.reshape(-1, *light_field.shape)
        maps |= {f"gt_disp_lowres_Cam{number:03d}": np.ascontiguousarray(view) for number, view in enumerate(views)}
    write_hci(light_field, folder, render.settings, maps)


def _require_new(output: Path, folders: Iterable[str]) -> None:
    for name in folders:
        if (output / name).exists():
            raise SepiError(f"{output / name}: exists already; remove it, or choose another folder with -o")
