"""The command ``sepi``."""

from __future__ import annotations

import os
from importlib import import_module
from typing import Any

import click

from sepi.process.command import SepiGroup, shown_errors
from sepi.registry import Known

# Libraries read these when imported. Products are small here, so threads of OpenBLAS would only wait. Pages of 2 MB
# take time and memory, since arrays live shortly. Plugins of pydantic would be searched in all packages
_SETTINGS = {"OPENBLAS_NUM_THREADS": "1", "NUMPY_MADVISE_HUGEPAGE": "0", "PYDANTIC_DISABLE_PLUGINS": "1"}
for _name, _value in _SETTINGS.items():
    os.environ.setdefault(_name, _value)

_MODULES = {
    "check": ("info", "Check the order of the views of the light field INPUT."),
    "depth": ("depth", "Compute the disparity map of the light field INPUT."),
    "evaluate": ("evaluate", "Score a disparity map against ground truth."),
    "info": ("info", "Show what is known about the light field INPUT."),
    "scenes": ("scenes", "Write scenes with exact ground truth."),
}
"""Command to its module in this folder, and its line in the list of commands."""


class _Imported(Known[Any]):
    """Commands, each imported when looked up."""

    def __getitem__(self, name: str) -> click.Command:
        """The command of this name."""
        module, text = super().__getitem__(name)
        command: click.Command = getattr(import_module(module), name.replace("-", "_"))
        command.short_help = text
        return command

    def lines(self) -> list[tuple[str, str]]:
        """Names and lines of the list of commands, by name."""
        return [(name, super(_Imported, self).__getitem__(name)[1]) for name in sorted(self)]


_PLACES = {name: (f"{__package__}.{module}", text) for name, (module, text) in _MODULES.items()}
_COMMANDS = _Imported("commands", _PLACES)


class _Commands(SepiGroup):
    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """List the commands."""
        with shown_errors(), formatter.section("Commands"):
            formatter.write_dl(_COMMANDS.lines())

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """The command of this name."""
        with shown_errors():
            return super().get_command(ctx, cmd_name)


@click.group(cls=_Commands, commands=_COMMANDS, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(package_name="sepi", message="%(prog)s %(version)s")
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
