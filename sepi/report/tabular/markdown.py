"""Tables as Markdown with aligned columns."""

from __future__ import annotations

import re

from sepi.report.tabular.layout import BEST, SECOND, Entry, Kind, Report, Section

# characters that are markup in the middle of a line; an underscore within a word is not
_MARKUP = re.compile(r"[\\`*\[\]<>&|~]|(?<![^\W_])_|_(?![^\W_])")
_SIGNS = {BEST: "**", SECOND: "*", None: ""}


def as_markdown(report: Report) -> str:
    """Markdown with two decimals; an empty cell means not available, ``n/a`` a score over no pixels."""
    marked = f" {report.marked} (**bold**, *italic*)." if report.marked else ""
    parts = [f"# {_plain(report.title)}", _with_code(report.caption) + marked]
    for section in report.sections:
        parts += [f"## {_plain(section.heading)}"] if section.heading else []
        parts.append(_table(section))
    return "\n\n".join(parts) + "\n"


def _table(section: Section) -> str:
    # slow to import
    from tabulate import tabulate

    text: str = tabulate(
        [[_cell(entry) for entry in row.cells] for row in section.rows],
        [_plain(column.head) for column in section.columns],
        tablefmt="pipe",
        colalign=["left" if column.kind == Kind.TEXT else "right" for column in section.columns],
        disable_numparse=True,
    )
    return text


def _cell(entry: Entry) -> str:
    sign = _SIGNS[entry.mark]
    return f"{sign}{_plain(entry.text)}{sign}"


def _plain(text: str) -> str:
    """Text escaped for Markdown, in one line."""
    return _escaped(" ".join(text.splitlines()))


def _with_code(text: str) -> str:
    """Text escaped for Markdown, with names between backticks as code."""
    parts = re.split(r"(`[^`]*`)", text)
    return "".join(part if index % 2 else _escaped(part) for index, part in enumerate(parts))


def _escaped(text: str) -> str:
    return _MARKUP.sub(r"\\\g<0>", text)
