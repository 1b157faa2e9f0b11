"""Generates the commented ``config.yaml`` from the models: every key with its default, unit and meaning.

Lines below a key are commented out, so that a kept copy of the file follows the defaults of later versions.

``python -m sepi.workflow.config_file`` prints it.
"""

from __future__ import annotations

import json
import re
import textwrap
from collections.abc import Iterable, Sequence
from typing import Any

import click
import yaml
from pydantic import BaseModel
from pydantic.fields import FieldInfo

from sepi.variants import STAGES
from sepi.workflow.config import Config


def default_yaml() -> str:
    """The text of ``config.yaml``: every key with its default, and a comment with its meaning, unit and bounds.

    A line ``#NAME: VALUE`` shows a default; prose has a space after the ``#``.
    """
    lines = [
        "# Configuration of the workflow (docs/reproduce/configure.md). Every key may be left out; these are defaults.",
        "# To change a value, here or in your own file (--configfile FILE), remove the # from its line and from its",
        "# parents' lines. Or give --config KEY=VALUE.",
        "# This file is generated: python -m sepi.workflow.config_file > config.yaml",
        "",
    ]
    # long ones last
    for key, field in sorted(Config.model_fields.items(), key=lambda item: item[0] in ("variants", "stages")):
        lines += _comment(field, "")
        default = field.get_default(call_default_factory=True)
        if isinstance(default, BaseModel):
            lines += [f"{key}:", *_without_effect(_fields(default, "  "))]
        elif key == "variants":
            lines += ["variants:", *_without_effect(f"  {name}: {_flow(entry)}" for name, entry in default.items())]
        elif key == "stages":
            lines += ["stages:", *_without_effect(_stage_lines())]
        else:
            lines.append(f"{key}: {_flow(default)}")
        lines.append("")
    return "\n".join(lines)


def _without_effect(lines: Iterable[str]) -> list[str]:
    return [re.sub(r"^( *)(?=[^ #])", r"\1#", line) for line in lines]


def _stage_lines() -> list[str]:
    lines: list[str] = []
    for stage, choices in STAGES.items():
        lines.append(f"  {stage}:")
        for name, choice in choices.items():
            lines.append(f"    {name}:" if choice.parameters.model_fields else f"    {name}: {{}}")
            # parameters of several choices are explained at the first
            lines += _fields(choice.parameters(), "      ", lines)
    return lines


def _fields(values: BaseModel, indent: str, before: Sequence[str] = ()) -> list[str]:
    """Each field with its value, below what it means unless that is among the lines before."""
    lines = []
    for name, value in values.model_dump().items():
        comment = _comment(type(values).model_fields[name], indent)
        lines += [*([] if comment[0] in before else comment), f"{indent}{name}: {_flow(value)}"]
    return lines


def _comment(field: FieldInfo, indent: str) -> list[str]:
    bounds = _bounds(field)
    text = f"{field.description or ''}{f' ({bounds})' if bounds else ''}"
    return textwrap.wrap(text, 118, initial_indent=f"{indent}# ", subsequent_indent=f"{indent}# ")


def _bounds(field: FieldInfo) -> str:
    signs = {"ge": ">=", "gt": ">", "le": "<=", "lt": "<"}
    found = [f"{signs[name]} {getattr(one, name)}" for one in field.metadata for name in signs if hasattr(one, name)]
    return ", ".join(found)


def _flow(value: Any) -> str:
    """A value as YAML on one line."""
    text = yaml.safe_dump(json.loads(json.dumps(value)), default_flow_style=True, width=10**6, sort_keys=False)
    # after a bare scalar, PyYAML writes a line "..."
    return text.split("\n")[0]


@click.command(help="Print config.yaml with every default.")
def main() -> None:
    """Print ``config.yaml``."""
    click.echo(default_yaml(), nl=False)


if __name__ == "__main__":
    main()
