"""The pages of the documentation, with their links and headings as a forge resolves them, and the code in them."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator
from functools import cache
from itertools import pairwise
from pathlib import Path

from markdown_it import MarkdownIt
from markdown_it.token import Token

REPOSITORY = Path(__file__).parents[2]
DOCS = REPOSITORY / "docs"
MADE = frozenset({DOCS / "reference" / "api.md"})

_GENERATED = ("examples", "reference/api", "_made", "gallery")
_parsed = cache(MarkdownIt("commonmark").enable("table").parse)


def site_pages() -> list[Path]:
    """Those of the site that somebody writes."""
    found = [page for page in sorted(DOCS.rglob("*.md")) if page not in MADE]
    return [page for page in found if not page.relative_to(DOCS).as_posix().startswith(_GENERATED)]


_OTHERS = ("README.md", "CONTRIBUTING.md", "CHANGELOG.md", "config/README.md", "reports/README.md")
FILES = {str(path.relative_to(REPOSITORY)): path for path in [*map(REPOSITORY.joinpath, _OTHERS), *site_pages()]}


def blocks(text: str) -> list[tuple[str, str]]:
    """Language and content of each block of code, those of directives included."""
    return [(token.info, token.content) for token in _tokens(text) if token.type in ("fence", "code_block")]


def spans(text: str) -> list[str]:
    """The code between words."""
    return [token.content for token in _tokens(text) if token.type == "code_inline"]


def _tokens(text: str) -> Iterator[Token]:
    for token in _parsed(text):
        yield token
        yield from token.children or ()


def links(text: str) -> list[str]:
    """Where the links and pictures of a file lead, but for addresses on the web."""
    found = [
        str(t.attrs.get("href") or t.attrs.get("src") or "") for t in _tokens(text) if t.type in ("link_open", "image")
    ]
    return [link for link in found if link and "://" not in link and not link.startswith("mailto:")]


def anchors(text: str) -> set[str]:
    """What may stand behind ``#`` in a link to this file: its headings in lower case, without signs."""
    tokens = _parsed(text)
    seen: Counter[str] = Counter()
    found = set()
    for heading, content in pairwise(tokens):
        if heading.type == "heading_open":
            words = "".join(t.content for t in content.children or () if t.type in ("text", "code_inline"))
            name = re.sub(r"[^\w\- ]", "", words.lower()).replace(" ", "-")
            found.add(f"{name}-{seen[name]}" if seen[name] else name)
            seen[name] += 1
    return found


def broken_links(file: Path, made: frozenset[Path]) -> list[str]:
    """The links of ``file`` to files or headings that are not there, but for files ``made`` with the site."""
    broken = []
    for link in links(file.read_text(encoding="utf-8")):
        path, _, anchor = link.partition("#")
        target = (file.parent / path).resolve() if path else file
        if target in made:
            continue
        if not target.exists() or (anchor and anchor not in anchors(target.read_text(encoding="utf-8"))):
            broken.append(link)
    return broken
