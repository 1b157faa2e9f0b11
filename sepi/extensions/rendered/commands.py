"""The command ``sepi scenes`` with ``--rendered``, and the workflow's command that renders a scene into a file."""

from collections.abc import Iterable, Sequence
from inspect import cleandoc
from pathlib import Path
from typing import Any

import click
import numpy as np
from click.core import ParameterSource

from sepi.camera import camera_from
from sepi.cli.scenes import list_scenes, require_new
from sepi.errors import SepiError
from sepi.extensions.rendered.exposure import Exposure, exposed
from sepi.extensions.rendered.render_file import Render, read_render
from sepi.extensions.rendered.rendering import RenderOptions, made_by, render_world
from sepi.extensions.rendered.tracing import require_mitsuba
from sepi.extensions.rendered.worlds import RENDERED, world_of
from sepi.process.command import SepiCommand, progress_bar
from sepi.process.threads import use_threads
from sepi.scenes.folder import write_hci
from sepi.validation import require_known, settings_of
from sepi.validation.models import validated
from sepi.workflow.rendered_scenes import NOISE_LEVELS, WITHOUT_NOISE, RenderedScene

_FLAGS = (
    click.Option(["--rendered"], is_flag=True, help="Path-traced scenes (Mitsuba 3, extra [render]); minutes each."),
    click.Option(["--samples"], type=click.IntRange(min=1), help="With --rendered: paths for each pixel; default: 64."),
    click.Option(
        ["--noise", "levels"],
        type=click.Choice(NOISE_LEVELS),
        multiple=True,
        help="With --rendered: noise of the sensor; repeatable, a folder for each; default: off.",
    ),
    click.Option(
        ["--set", "settings"],
        multiple=True,
        metavar="KEY=VALUE",
        help="With --rendered: lens=0.5, vignetting=0.4, ...; repeatable. docs/reproduce/rendered.md lists them.",
    ),
    click.Option(["--all-views"], is_flag=True, help="With --rendered: also write a disparity map for each view."),
)


def extended(command: SepiCommand) -> SepiCommand:
    """The command with flags for path-traced scenes."""
    built_in = command.callback
    assert built_in is not None

    @click.pass_context
    def scenes(context: click.Context, /, rendered: bool, **given: Any) -> None:
        """Scenes of --rendered are path-traced, with plain walls, gloss, mirrors and glass.

        They have 512 pixels unless --size says otherwise; a file NAME.h5 beside the folder has their light, and
        disparity, normals and masks of every view. Repeat --noise for a folder of each level of the sensor's noise
        (default: off), and --set for each key that docs/reproduce/rendered.md lists.

        \b
        Example:
          sepi scenes --rendered sticks --size 256 --samples 16 --noise off --noise low
        """
        own = {flag.name: given.pop(flag.name) for flag in _FLAGS if flag.name in given}
        if not rendered:
            for flag in (flag for flag in _FLAGS if own.get(flag.name)):
                raise click.UsageError(f"{flag.opts[0]} needs --rendered")
            built_in(**given)
        elif given["only_list"]:
            list_scenes({name: f"{entry.description}: {entry.tests}" for name, entry in RENDERED.items()})
        else:
            usual = context.get_parameter_source("size") is ParameterSource.DEFAULT
            values = {"grid": [given["views"]] * 2, "size": 512 if usual else given["size"]}
            values |= {} if own["samples"] is None else {"samples": own["samples"]}
            values |= settings_of(own["settings"], "lens=0.5")
            levels = dict.fromkeys(own["levels"] or (WITHOUT_NOISE,))
            _write_rendered(given["names"], given["output"], values, levels, own["all_views"])

    help_text = f"{cleandoc(command.help or '')}\n\n{cleandoc(scenes.__doc__ or '')}"
    return SepiCommand(command.name, params=[*command.params, *_FLAGS], callback=scenes, help=help_text)


def _write_rendered(
    names: Sequence[str], output: Path, settings: dict[str, Any], levels: Iterable[str], all_views: bool
) -> None:
    require_known("path-traced scenes", names, RENDERED)
    require_known("--set", settings, (*RenderOptions.model_fields, *Exposure.model_fields))
    of_sensor = {key: settings.pop(key) for key in Exposure.model_fields if key in settings}
    options = validated(RenderOptions, settings, "--set")
    exposures = [validated(Exposure, {"noise": level, **of_sensor}, "--set") for level in levels]
    paths = {name: output / f"{name}.h5" for name in names or RENDERED}
    require_new(output, (RenderedScene(name, one.noise, one.noise_seed).name for name in paths for one in exposures))
    # before anything is rendered, which takes minutes
    for name, path in paths.items():
        if path.is_file():
            _known(name, options, path)
    for name, path in paths.items():
        if not path.is_file():
            _render(name, options, path)
        render = _known(name, options, path)
        for exposure in exposures:
            _write_folder(render, exposure, output, all_views)


def _render(name: str, options: RenderOptions, path: Path) -> None:
    require_mitsuba()
    with progress_bar(name) as progress:
        render_world(name, world_of(name), options, path, progress)


def _known(name: str, options: RenderOptions, path: Path) -> Render:
    """The render of a scene in a file that was made with these options."""
    render = read_render(path)
    if render.made_by != made_by(name, options):
        raise SepiError(f"{path}: was rendered with other options; remove it, or choose another folder with -o")
    return render


def _write_folder(render: Render, exposure: Exposure, output: Path, all_views: bool) -> None:
    light_field = exposed(render, exposure)
    camera = camera_from(**render.settings, shape=light_field.shape, crop_of=None)
    maps = {"gt_depth_lowres": camera.depth(render.disparity[render.centre])}
    if all_views:
        views = render.disparity.reshape(-1, *light_field.shape)
        maps |= {f"gt_disp_lowres_Cam{number:03d}": np.ascontiguousarray(view) for number, view in enumerate(views)}
    write_hci(light_field, output / light_field.name, render.settings, maps)
    click.echo(f"written: {output / light_field.name}/")


@click.command(name="python -m sepi.extensions.rendered.commands", cls=SepiCommand)
@click.argument("name")
@click.option("--set", "settings", multiple=True, metavar="KEY=VALUE", help="Options of rendering.")
@click.option("--threads", type=click.IntRange(min=1), default=1, show_default=True, help="Threads to use.")
@click.option("--output", type=click.Path(path_type=Path), required=True, help="HDF5 file to write.")
def main(name: str, settings: tuple[str, ...], threads: int, output: Path) -> None:
    """Render the scene NAME; an interrupted run keeps finished views."""
    options = validated(RenderOptions, settings_of(settings, "lens=0.5"), "rendered")
    use_threads(threads)
    _render(name, options, output)


if __name__ == "__main__":
    main()
