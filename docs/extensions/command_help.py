"""What ``--help`` prints is plain text; to Sphinx an asterisk in it would begin emphasis."""

from __future__ import annotations

from sphinx.application import Sphinx

from sepi.cli.main import main
from sepi.command import SepiCommand


def _as_text(_app: Sphinx, _context: object, lines: list[str]) -> None:
    lines[:] = [line if line.lstrip().startswith("..") else line.replace("*", "\\*") for line in lines]


def setup(app: Sphinx) -> dict[str, bool]:
    """Rewrite the help of commands and options."""
    app.setup_extension("sphinx_click")
    for name in list(main.commands):
        command = main.commands[name]
        main.add_command(command.extended() if isinstance(command, SepiCommand) else command)
    for part in ("description", "options", "arguments"):
        app.connect(f"sphinx-click-process-{part}", _as_text)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
