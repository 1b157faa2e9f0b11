"""The command with the flags of extensions; ``--help`` is plain text, in which Sphinx would see emphasis."""

from __future__ import annotations

import click
from sphinx.application import Sphinx

from sepi.cli import main as cli
from sepi.process.command import SepiCommand

_FOUND = {name: cli.main.commands[name] for name in sorted(cli.main.commands)}

main = click.Group(
    "sepi",
    {name: command.extended() if isinstance(command, SepiCommand) else command for name, command in _FOUND.items()},
    params=cli.main.params,
    help=cli.main.help,
)


def _as_text(_app: Sphinx, _context: object, lines: list[str]) -> None:
    lines[:] = [line if line.lstrip().startswith("..") else line.replace("*", "\\*") for line in lines]


def setup(app: Sphinx) -> dict[str, bool]:
    """Rewrite the help of commands and options."""
    app.setup_extension("sphinx_click")
    for part in ("description", "options", "arguments"):
        app.connect(f"sphinx-click-process-{part}", _as_text)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
