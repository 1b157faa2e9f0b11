"""Tables as LaTeX with the package booktabs, one table environment per section, for ``\\input``."""

from __future__ import annotations

import re
from collections.abc import Sequence

from sepi.report.tabular.layout import BEST, SECOND, Column, Entry, Kind, Line, Report, Section

# largest number of columns on an upright page
_MOST_UPRIGHT = 8

_ESCAPES = str.maketrans(
    {
        **{character: f"\\{character}" for character in "{}$&#%_"},
        # after the end of a row, LaTeX would read these as its options
        **{character: f"{{{character}}}" for character in "[]*"},
        "\\": r"\textbackslash{}",
        "~": r"\textasciitilde{}",
        "^": r"\textasciicircum{}",
        "<": r"\textless{}",
        ">": r"\textgreater{}",
        "|": r"\textbar{}",
        '"': "{''}",
        "`": r"\textasciigrave{}",
        "×": r"$\times$",
        "±": r"$\pm$",
    }
)


def as_latex(report: Report, name: str) -> str:
    """A report's sections as table environments.

    Parameters
    ----------
    report : Report
        The table.
    name : str
        Name of the file; labels are ``tab:NAME``, followed by the section's heading if there are several.

    Returns
    -------
    str
        LaTeX in UTF-8. Its first lines name the packages it needs.
    """
    packages = "booktabs,graphicx" if any(map(_is_wide, report.sections)) else "booktabs"
    parts = [f"% {escaped(report.title)}\n% needs \\usepackage{{{packages}}}"]
    labels = _labels(name, report.sections)
    parts += [_environment(report, section, label) for section, label in zip(report.sections, labels, strict=True)]
    return "\n\n".join(parts) + "\n"


def escaped(text: str) -> str:
    """Text escaped for LaTeX, in one line."""
    safe = " ".join(text.splitlines()).translate(_ESCAPES)
    # two hyphens would become a dash
    return re.sub(r"-(?=-)", "-{}", safe)


def _environment(report: Report, section: Section, label: str) -> str:
    wide = _is_wide(section)
    environment = "table*" if wide else "table"
    size = "\\scriptsize\n\\setlength{\\tabcolsep}{3pt}" if wide else r"\small"
    # LaTeX numbers tables itself
    title = re.sub(r"^Table \d+: ", "", report.title)
    title = f"{title}; {section.heading}" if section.heading else title
    marked = rf" {escaped(report.marked)} (\textbf{{bold}}, \underline{{underlined}})." if report.marked else ""
    alignment = "".join("l" if column.kind == Kind.TEXT else "r" for column in section.columns)
    return rf"""\begin{{{environment}}}
\centering
{size}
\caption{{{escaped(title)}. {_with_code(report.caption)}{marked}}}
\label{{{label}}}
\begin{{tabular}}{{@{{}}{alignment}@{{}}}}
\toprule
{_row([_head(column, wide) for column in section.columns])}
\midrule
{_body(section.rows)}\bottomrule
\end{{tabular}}
\end{{{environment}}}"""


def _body(lines: Sequence[Line]) -> str:
    """The rows, with a rule before the first average."""
    text, before = "", "average"
    for line in lines:
        kind = line.kind.split()[0] if line.kind else ""
        if kind == "average" != before:
            text += "\\midrule\n"
        text += _row([_cell(entry) for entry in line.cells]) + "\n"
        before = kind
    return text


def _row(cells: Sequence[str]) -> str:
    return " & ".join(cells) + r" \\"


def _head(column: Column, wide: bool) -> str:
    head = escaped(column.head)
    return rf"\rotatebox{{90}}{{{head}}}" if wide and column.kind != Kind.TEXT else head


def _cell(entry: Entry) -> str:
    text = escaped(entry.text)
    command = {BEST: r"\textbf", SECOND: r"\underline"}.get(entry.mark or "")
    return f"{command}{{{text}}}" if command else text


def _with_code(text: str) -> str:
    """Text escaped for LaTeX, with names between backticks in typewriter type."""
    parts = re.split(r"`([^`]*)`", text)
    return "".join(rf"\texttt{{{escaped(part)}}}" if index % 2 else escaped(part) for index, part in enumerate(parts))


def _labels(name: str, sections: Sequence[Section]) -> list[str]:
    """A unique label for each section: the table's name, then letters, digits and hyphens."""
    if len(sections) == 1:
        return [f"tab:{name}"]
    labels: list[str] = []
    for section in sections:
        label = "-".join([f"tab:{name}", *re.findall(r"[a-z0-9_]+", section.heading.lower())])
        while label in labels:
            label += "-again"
        labels.append(label)
    return labels


def _is_wide(section: Section) -> bool:
    return len(section.columns) > _MOST_UPRIGHT
