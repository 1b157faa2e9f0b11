"""The command ``sepi``."""

from __future__ import annotations

import os
from collections import UserDict
from importlib import import_module
from typing import Any

import click

from sepi.command import SepiGroup

# NumPy reads these when imported. Products are small here, so threads of OpenBLAS would only wait. Pages of 2 MB take
# time and memory, since arrays live shortly
for _name, _value in {"OPENBLAS_NUM_THREADS": "1", "NUMPY_MADVISE_HUGEPAGE": "0"}.items():
    os.environ.setdefault(_name, _value)

_COMMANDS = {
    "calibrate": ("calibrate", "Find the cameras of pictures without poses, with COLMAP."),
    "check": ("info", "Check the order of the views of the light field INPUT."),
    "check-submission": ("results", "Check a submission to the HCI 4D benchmark."),
    "compare": ("compare", "Show two disparity maps side by side on a page."),
    "convert": ("convert", "Write a map of a result as OpenEXR, TIFF or PFM."),
    "depth": ("depth", "Compute the disparity map of the light field INPUT."),
    "evaluate": ("evaluate", "Score a disparity map against ground truth."),
    "export": ("export", "Save the light field INPUT as read, so that it needs no flags."),
    "info": ("info", "Show what is known about the light field INPUT."),
    "points": ("results", "Write the point cloud of a result."),
    "poses": ("poses", "Write camera poses and depth for COLMAP or nerfstudio."),
    "refocus": ("refocus", "Refocus the light field INPUT."),
    "scenes": ("scenes", "Write scenes with exact ground truth."),
    "submission": ("results", "Pack results as a submission to the HCI 4D benchmark."),
}
"""Command to its module in this folder, and its line in the list of commands."""


class _Imported(UserDict[str, Any]):
    """Commands, each imported when looked up."""

    def __getitem__(self, name: str) -> click.Command:
        """The command of this name."""
        module, text = self.data[name]
        command: click.Command = getattr(import_module(f"{__package__}.{module}"), name.replace("-", "_"))
        command.short_help = text
        return command


class _Commands(SepiGroup):
    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """List the commands."""
        with formatter.section("Commands"):
            formatter.write_dl([(name, _COMMANDS[name][1]) for name in self.list_commands(ctx)])


def _tell_version(context: click.Context, _: click.Parameter, asked: bool) -> None:
    if asked and not context.resilient_parsing:
        from sepi import __version__

        click.echo(f"{context.find_root().info_name} {__version__}")
        context.exit()


@click.group(
    cls=_Commands,
    commands=_Imported(_COMMANDS),
    context_settings={"help_option_names": ["-h", "--help"]},
)
@click.option(
    "--version",
    is_flag=True,
    is_eager=True,
    expose_value=False,
    callback=_tell_version,
    help="Show the version and exit.",
)
def main() -> None:
    """Depth from light fields by stitched epipolar plane images.

    A light field is a grid of views of one scene, taken from neighbouring camera positions. For each pixel of the
    centre view, its disparity map tells by how many pixels the pixel moves from view to view. Nearer points move more.

    \b
    Try it on a built-in scene:
      sepi scenes pyramids -o scenes
      sepi depth scenes/pyramids
      sepi evaluate pyramids-depth scenes/pyramids
    """


def run() -> None:
    """Run the command."""
    main(prog_name="sepi")
