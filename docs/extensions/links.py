"""Where references lead that Sphinx does not know.

In a checkout ``../../CONTRIBUTING.md`` is a file; on the site it is a page. What a docstring names in Python need not
have a page of its own, but has to exist.
"""

from __future__ import annotations

import posixpath
import re
from functools import cache
from pathlib import Path

from docutils import nodes
from sphinx.addnodes import pending_xref
from sphinx.application import Sphinx
from sphinx.environment import BuildEnvironment

from extensions.generated import NAMES, api_sections, resolved

PAGES = {
    "README.md": "index.md",
    "CONTRIBUTING.md": "develop/contributing.md",
    "CHANGELOG.md": "develop/changelog.md",
    "config.yaml": "reference/configuration.md",
}
"""File in the repository's root to page below docs/."""

_LINK = re.compile(r"\]\(([^)#\s]+)((?:#[^)]*)?)\)")


def to_pages(text: str, folder: str) -> str:
    """The Markdown of a page in ``folder`` (relative to docs/) with links to its pages in place of the files."""

    def link(found: re.Match[str]) -> str:
        outside = posixpath.normpath(posixpath.join("docs", folder, found[1]))
        if outside not in PAGES:
            return found[0]
        return f"]({posixpath.relpath(PAGES[outside], folder or '.')}{found[2]})"

    return _LINK.sub(link, text)


def _rewrite(app: Sphinx, page: str, source: list[str]) -> None:
    source[0] = to_pages(source[0], posixpath.dirname(page))


def _existing(app: Sphinx, _env: BuildEnvironment, found: pending_xref, words: nodes.TextElement) -> nodes.Node | None:
    """The words alone for a name in Python that can be imported; None, which Sphinx warns of, for any other."""
    if found.get("refdomain") != "py":
        return None
    target = found["reftarget"]
    around = ".".join(filter(None, (found.get("py:module"), found.get("py:class"))))
    # documented where it can be imported from, written where it is defined
    home = getattr(_named(around), "__module__", around)
    # the first sentence of a docstring also stands in the index, which belongs to no module
    places = (around, home, *_documented_modules(Path(app.srcdir)))
    names = (target, *(f"{place}.{target}" for place in places))
    return words if any(_named(name) is not None for name in names) else None


@cache
def _documented_modules(source: Path) -> tuple[str, ...]:
    sections = api_sections((source / NAMES).read_text(encoding="utf-8"))
    return tuple(sorted({name.rpartition(".")[0] for names in sections.values() for name in names}))


def _named(name: str) -> object | None:
    try:
        found: object = resolved(name)
    except (AttributeError, ValueError, TypeError):
        return None
    return found


def setup(app: Sphinx) -> dict[str, bool]:
    """Rewrite each page as it is read; look for the names when all are."""
    app.connect("source-read", _rewrite)
    app.connect("missing-reference", _existing)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
