"""Tables as CSV, Markdown, and LaTeX with the package booktabs."""

from __future__ import annotations

import re
from collections.abc import Callable

import pandas as pd

from sepi.report.tabular.table import BEST, SECOND, Kind, Section, Table, shown

# characters that are markup in the middle of a line; an underscore within a word is not
_MARKUP = re.compile(r"[\\`*\[\]<>&|~]|(?<![^\W_])_|_(?![^\W_])")

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


def as_csv(table: Table) -> str:
    """CSV with four decimals; an empty cell means not available, or a score over no pixels."""
    return str(shown(table.rows, 4).to_csv(index=False, lineterminator="\n"))


def as_markdown(table: Table) -> str:
    """Markdown with two decimals; an empty cell means not available, ``n/a`` a score over no pixels."""
    marked = f" {table.marked} (**bold**, *italic*)." if table.marked else ""
    parts = [f"# {_plain(table.title)}", _with_code(table.caption, _plain, "`{}`".format) + marked]
    for section in table.sections:
        parts += [f"## {_plain(section.heading)}"] if section.heading else []
        parts.append(
            _marked(section, _plain, "**{}**", "*{}*").to_markdown(
                index=False,
                headers=[_plain(head.text) for head in section.heads],
                tablefmt="pipe",
                colalign=["left" if head.kind == Kind.TEXT else "right" for head in section.heads],
                disable_numparse=True,
            )
        )
    return "\n\n".join(parts) + "\n"


def as_latex(table: Table, name: str) -> str:
    """A table's sections as LaTeX table environments, for ``\\input``.

    Parameters
    ----------
    table : Table
    name : str
        Name of the file; labels are ``tab:NAME``, followed by the section's heading if there are several.

    Returns
    -------
    str
        LaTeX in UTF-8. Its first lines name the packages it needs.
    """
    packages = "booktabs,graphicx" if any(map(_is_wide, table.sections)) else "booktabs"
    parts = [f"% {_escaped(table.title)}\n% needs \\usepackage{{{packages}}}"]
    labels: list[str] = []
    for section in table.sections:
        several = section.heading if len(table.sections) > 1 else ""
        label = "-".join([f"tab:{name}", *re.findall(r"[a-z0-9_]+", several.lower())])
        while label in labels:
            label += "-again"
        labels.append(label)
        parts.append(_environment(table, section, label))
    return "\n\n".join(parts) + "\n"


def _environment(table: Table, section: Section, label: str) -> str:
    # LaTeX numbers tables itself
    title = "; ".join(filter(None, [re.sub(r"^Table \d+: ", "", table.title), section.heading]))
    marked = rf" {_escaped(table.marked)} (\textbf{{bold}}, \underline{{underlined}})." if table.marked else ""
    caption = f"{_escaped(title)}. " + _with_code(table.caption, _escaped, _typewriter) + marked
    cells = _marked(section, _escaped, r"\textbf{{{}}}", r"\underline{{{}}}")
    averages = [row for row, kind in enumerate(section.rows) if kind.startswith("average")]
    if averages and averages[0]:
        cells.iloc[averages[0], 0] = f"\\midrule\n{cells.iloc[averages[0], 0]}"
    wide = _is_wide(section)
    heads = [
        rf"\rotatebox{{90}}{{{_escaped(text)}}}" if wide and kind != Kind.TEXT else _escaped(text)
        for text, kind in section.heads
    ]
    text = (
        cells.set_axis(heads, axis=1)
        .style.hide(axis="index")
        .to_latex(
            hrules=True,
            position_float="centering",
            environment="table*" if wide else "table",
            column_format=f"@{{}}{''.join('l' if head.kind == Kind.TEXT else 'r' for head in section.heads)}@{{}}",
            caption=caption,
            label=label,
        )
    )
    size = "\\scriptsize\n\\setlength{\\tabcolsep}{3pt}" if wide else r"\small"
    return str(text).replace("\\centering", f"\\centering\n{size}", 1).rstrip("\n")


def _marked(section: Section, escaped: Callable[[str], str], best: str, second: str) -> pd.DataFrame:
    """The cells, escaped, and those of the best and the second best within these forms."""
    texts = section.cells.map(escaped)
    for mark, form in ((BEST, best), (SECOND, second)):
        texts = texts.where(section.marks != mark, texts.map(form.format))
    return texts


def _is_wide(section: Section) -> bool:
    return len(section.heads) > _MOST_UPRIGHT


def _escaped(text: str) -> str:
    """Text escaped for LaTeX, in one line."""
    safe = " ".join(text.splitlines()).translate(_ESCAPES)
    # two hyphens would become a dash
    return re.sub(r"-(?=-)", "-{}", safe)


def _plain(text: str) -> str:
    """Text escaped for Markdown, in one line."""
    return _MARKUP.sub(r"\\\g<0>", " ".join(text.splitlines()))


def _typewriter(name: str) -> str:
    return rf"\texttt{{{_escaped(name)}}}"


def _with_code(text: str, escaped: Callable[[str], str], code: Callable[[str], str]) -> str:
    """Escaped text, with names between backticks as code."""
    parts = re.split(r"`([^`]*)`", text)
    return "".join(code(part) if index % 2 else escaped(part) for index, part in enumerate(parts))
