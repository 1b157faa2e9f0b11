"""Figures that belong together, ``0.55 / 0.26 / 2.7``, stay on one line of a cell; the table scrolls instead."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from sphinx.application import Sphinx

_BETWEEN = re.compile(r"(?<=[\d-]) / (?=[\d-])")


def kept_together(text: str) -> str:
    """Markdown with spaces that do not break between the figures of a table's cell."""
    lines = text.split("\n")
    return "\n".join(
        _BETWEEN.sub("\N{NO-BREAK SPACE}/\N{NO-BREAK SPACE}", line) if line.startswith("|") else line for line in lines
    )


def _rewrite(_app: Sphinx, _page: str, source: list[str]) -> None:
    source[0] = kept_together(source[0])


def setup(app: Sphinx) -> dict[str, bool]:
    """Rewrite each page as it is read."""
    app.connect("source-read", _rewrite)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
