"""Pages made of the code: the index of the API from ``reference/api_names.txt``, and every key of the configuration."""

from __future__ import annotations

import importlib
import json
import re
from pathlib import Path
from typing import Any

from pydantic import BaseModel
from pydantic.fields import FieldInfo
from sphinx.application import Sphinx

from sepi.io.files import atomic_path
from sepi.variants import STAGES
from sepi.workflow.config import Config

NAMES = "reference/api_names.txt"


def api_sections(text: str) -> dict[str, list[str]]:
    """Title to dotted names: a line ``# Title``, then a name a line. Lines that begin with ``#?`` say nothing."""
    sections: dict[str, list[str]] = {}
    names = sections.setdefault("", [])
    for line in map(str.strip, text.splitlines()):
        if line.startswith("#?"):
            continue
        if line.startswith("#"):
            names = sections.setdefault(line.lstrip("# "), [])
        elif line:
            names.append(line)
    return {title: names for title, names in sections.items() if names}


def kind_of(name: str) -> str:
    """``module``, ``class``, ``function`` or ``data``."""
    found = resolved(name)
    if isinstance(found, type):
        return "class"
    if type(found).__name__ == "module":
        return "module"
    return "function" if callable(found) else "data"


def resolved(name: str) -> Any:
    """What a dotted name stands for.

    Raises
    ------
    AttributeError
        If there is nothing of that name.
    """
    parts = name.split(".")
    for number in range(len(parts), 0, -1):
        try:
            found: Any = importlib.import_module(".".join(parts[:number]))
        except ModuleNotFoundError:
            continue
        for part in parts[number:]:
            found = getattr(found, part)
        return found
    raise AttributeError(name)


def api_page(text: str) -> str:
    """The index of the API, with a page for every name."""
    lines = ["# Python", "", "What may be relied upon. Shapes, signs and units: [](../method/geometry.md).", ""]
    for title, names in api_sections(text).items():
        lines += [f"## {title}", ""] if title else []
        lines += ["```{eval-rst}", ".. autosummary::", "   :toctree: api", "", *(f"   {name}" for name in names)]
        lines += ["```", ""]
    return "\n".join(lines)


def parameter_tables() -> str:
    """A table for every part of the configuration, in the order of ``config.yaml``."""
    lines = []
    for key, field in Config.model_fields.items():
        default = field.get_default(call_default_factory=True)
        lines += [f"## `{key}`", "", _sentence(field), ""]
        if isinstance(default, BaseModel):
            lines += _table(type(default), list(type(default).model_fields))
        elif key == "variants":
            lines += ["| variant | choices |", "|---|---|"]
            lines += [f"| `{name}` | `{_plain(entry)}` |" for name, entry in default.items()]
        elif key == "stages":
            lines += _stages()
        else:
            lines += [f"Default: `{_plain(default)}`"]
        lines.append("")
    return "\n".join(lines)


def _stages() -> list[str]:
    lines = []
    for stage, choices in STAGES.items():
        for name, choice in choices.items():
            own = list(choice.parameters.model_fields)
            if own:
                lines += [f"### `{stage}.{name}`", "", *_table(choice.parameters, own), ""]
    return lines


def _table(model: type[BaseModel], names: list[str]) -> list[str]:
    lines = ["| key | default | bounds | meaning, unit |", "|---|---|---|---|"]
    for name in names:
        field = model.model_fields[name]
        default = field.get_default(call_default_factory=True)
        lines.append(f"| `{name}` | `{_plain(default)}` | {_bounds(field)} | {_sentence(field)} |")
    return lines


def _bounds(field: FieldInfo) -> str:
    signs = {"ge": "≥", "gt": ">", "le": "≤", "lt": "<"}
    found = [f"{sign} {getattr(m, key)}" for m in field.metadata for key, sign in signs.items() if hasattr(m, key)]
    return ", ".join(found)


def _sentence(field: FieldInfo) -> str:
    # words such as {lego: {path: ...}} and <= are text, not markup
    text = re.sub(r"([|{<_*])", r"\\\1", field.description or "")
    return re.sub(r"docs/([\w/\\]+)\.md", _page_link, text)


def _page_link(found: re.Match[str]) -> str:
    page = found[1].replace("\\", "")
    return f"[{page.rpartition('/')[2]}](../{page}.md)"


def _plain(value: Any) -> str:
    if isinstance(value, BaseModel):
        value = value.model_dump()
    return json.dumps(value, default=str).replace('"', "").replace("|", "\\|")


def write_pages(source: Path) -> None:
    """Write both into the folder of the pages; what has not changed keeps its time."""
    for name, text in (
        ("reference/api.md", api_page((source / NAMES).read_text(encoding="utf-8"))),
        ("_made/parameters.md", parameter_tables()),
    ):
        path = source / name
        if path.exists() and path.read_text(encoding="utf-8") == text:
            continue
        path.parent.mkdir(parents=True, exist_ok=True)
        with atomic_path(path) as temporary:
            temporary.write_text(text, encoding="utf-8")


def _write(app: Sphinx, _config: object) -> None:
    write_pages(Path(app.srcdir))


def setup(app: Sphinx) -> dict[str, bool]:
    """Before the pages are looked for."""
    app.connect("config-inited", _write)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
