"""Tables as LaTeX with the package booktabs, one table environment per section, to be read with ``\\input``."""

from __future__ import annotations

import re
from collections.abc import Sequence

from sepi.report.tabular.layout import BEST, SECOND, TEXT, Entry, Grid, Line, Report, Section

# more columns than fit upright on a page
_MOST_UPRIGHT = 8

_ESCAPES = {
    "\\": r"\textbackslash{}",
    "{": r"\{",
    "}": r"\}",
    "$": r"\$",
    "&": r"\&",
    "#": r"\#",
    "%": r"\%",
    "_": r"\_",
    "~": r"\textasciitilde{}",
    "^": r"\textasciicircum{}",
    "<": r"\textless{}",
    ">": r"\textgreater{}",
    "|": r"\textbar{}",
    '"': "{''}",
    "`": r"\textasciigrave{}",
    "×": r"$\times$",
    "±": r"$\pm$",
    # after the end of a row, these would belong to the command that ends it
    "[": "{[}",
    "]": "{]}",
    "*": "{*}",
}
_SPECIAL = re.compile("[" + re.escape("".join(_ESCAPES)) + "]")


def as_latex(report: Report, name: str) -> str:
    """A report's sections as table environments.

    Parameters
    ----------
    report : Report
        The table.
    name : str
        Of its file; the labels are ``tab:NAME``, followed by the heading of the section where there are several.

    Returns
    -------
    str
        LaTeX in UTF-8. Its first lines name the packages it needs.
    """
    sections = report.page
    packages = "booktabs"
    if any(_is_wide(section.grid) for section in sections):
        packages += ",graphicx"
    lines = [f"% {escaped(report.title)}", rf"% needs \usepackage{{{packages}}}"]
    labels = _labels(name, sections)
    for section, label in zip(sections, labels, strict=True):
        lines += ["", *_environment(report, section, label)]
    return "\n".join([*lines, ""])


def escaped(text: str) -> str:
    """Text that LaTeX sets as it is, in one line."""
    safe = _SPECIAL.sub(lambda found: _ESCAPES[found[0]], " ".join(text.splitlines()))
    # two hyphens would become a dash
    return re.sub(r"-(?=-)", "-{}", safe)


def _environment(report: Report, section: Section, label: str) -> list[str]:
    grid = section.grid
    wide = _is_wide(grid)
    environment = "table*" if wide else "table"
    # LaTeX numbers tables itself
    title = re.sub(r"^Table \d+: ", "", report.title)
    title = f"{title}; {section.heading}" if section.heading else title
    marked = rf" {escaped(report.marked)} (\textbf{{bold}}, \underline{{underlined}})." if report.marked else ""
    alignment = "".join("l" if column.kind == TEXT else "r" for column in grid.columns)
    heads = [escaped(column.head) for column in grid.columns]
    if wide:
        heads = [
            head if column.kind == TEXT else rf"\rotatebox{{90}}{{{head}}}"
            for head, column in zip(heads, grid.columns, strict=True)
        ]
    return [
        rf"\begin{{{environment}}}",
        r"\centering",
        *([r"\scriptsize", r"\setlength{\tabcolsep}{3pt}"] if wide else [r"\small"]),
        rf"\caption{{{escaped(title)}. {_with_code(report.caption)}{marked}}}",
        rf"\label{{{label}}}",
        rf"\begin{{tabular}}{{@{{}}{alignment}@{{}}}}",
        r"\toprule",
        _row(heads),
        r"\midrule",
        *_body(grid.lines),
        r"\bottomrule",
        r"\end{tabular}",
        rf"\end{{{environment}}}",
    ]


def _body(lines: Sequence[Line]) -> list[str]:
    """The rows; a rule stands before the first average."""
    rows = []
    for index, line in enumerate(lines):
        if index and line.kind.startswith("average") and not lines[index - 1].kind.startswith("average"):
            rows.append(r"\midrule")
        rows.append(_row([_cell(entry) for entry in line.entries]))
    return rows


def _row(cells: Sequence[str]) -> str:
    return " & ".join(cells) + r" \\"


def _cell(entry: Entry) -> str:
    text = escaped(entry.text)
    command = {BEST: r"\textbf", SECOND: r"\underline"}.get(entry.mark or "")
    return f"{command}{{{text}}}" if command else text


def _with_code(text: str) -> str:
    """Names between backticks in typewriter type."""
    parts = re.split(r"`([^`]*)`", text)
    return "".join(rf"\texttt{{{escaped(part)}}}" if index % 2 else escaped(part) for index, part in enumerate(parts))


def _labels(name: str, sections: Sequence[Section]) -> list[str]:
    """A label for each section, made of letters, digits and hyphens after the table's name; no two are the same."""
    if len(sections) == 1:
        return [f"tab:{name}"]
    labels: list[str] = []
    for section in sections:
        words = re.findall(r"[a-z0-9_]+", section.heading.lower())
        label = "-".join([f"tab:{name}", *words])
        while label in labels:
            label += "-again"
        labels.append(label)
    return labels


def _is_wide(grid: Grid) -> bool:
    return len(grid.columns) > _MOST_UPRIGHT
