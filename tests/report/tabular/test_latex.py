"""LaTeX tables: no TeX system is needed here, so what one would stumble over is looked for in the text."""

import re

import pytest

from sepi.report.plan import PARTS_TABLES, TABLES
from sepi.report.runs import Runs
from sepi.report.tables import BUILDERS
from sepi.report.tabular.latex import as_latex, escaped
from sepi.report.tabular.layout import BEST, SECOND, Column, Kind, Line, Report, Section, entry

SPECIALS = "\\ { } $ & # % _ ~ ^ < > | \" ' ` [ ] * -- ---"

# one of each: a command with its star or braces, an escaped character, the end of a row
_COMMAND = re.compile(r"\\(begin|end)\{[a-z]+\*?\}|\\[a-zA-Z]+|\\[{}$&#%_]|\\\\$|\$\\(times|pm)\$")


def report(sections: list[Section], caption: str = "All of it.", marked: str = "") -> Report:
    return Report("Errors", caption, [], [], sections, marked)


def section(*lines: Line, heading: str = "", columns: int = 3) -> Section:
    heads = [Column("scene", Kind.TEXT), *(Column(f"figure {i}") for i in range(1, columns))]
    return Section(heading, heads, lines)


def line(*cells: str | float | None, kind: str = "") -> Line:
    return Line([entry(cell, Kind.OURS if index else Kind.TEXT) for index, cell in enumerate(cells)], kind)


def require_sound(text: str) -> None:
    """Fail where environments or braces are not balanced, a row has too few cells, or a character is not escaped."""
    opened: list[str] = []
    for kind, name in re.findall(r"\\(begin|end)\{([a-z]+\*?)\}", text):
        if kind == "begin":
            opened.append(name)
        else:
            assert opened.pop() == name
    assert not opened
    columns = 0
    for source in text.splitlines():
        if source.startswith("%"):
            continue
        bare = re.sub(r"\\[{}]", "", source)
        assert bare.count("{") == bare.count("}"), source
        found = re.fullmatch(r"\\begin\{tabular\}\{@\{\}([lr]+)@\{\}\}", source)
        if found:
            columns = len(found[1])
        if source.startswith(r"\label"):
            assert re.fullmatch(r"\\label\{tab:[a-z0-9_:-]+\}", source)
            continue
        cells = source.split(" & ") if source.endswith(r"\\") else [source]
        if source.endswith(r"\\"):
            assert len(cells) == columns, source
        for cell in cells if not found else []:
            left = _COMMAND.sub("", cell)
            assert not re.search(r"[$&#%_~^<>|\\\"]|--", left), source
            # such a cell would be taken for what belongs to the end of the row before
            assert not left.startswith(("[", "*")), source


def body_of(text: str) -> list[str]:
    return text.split(r"\toprule")[1].split(r"\bottomrule")[0].split("\n")[1:-1]


def test_a_table_with_its_rules_and_marks() -> None:
    lines = [
        Line([entry("cotton", Kind.TEXT), entry(0.5, Kind.OURS, BEST), entry("0.70", Kind.PUBLISHED, SECOND)], "scene"),
        line("wall", float("nan"), None, kind="scene"),
        line("Average of 2 scenes", 0.5, None, kind="average"),
        line("Average as printed", None, 4.34, kind="average printed"),
    ]
    text = as_latex(report([section(*lines)], marked="Marked: the least"), "table1_mse")
    require_sound(text)
    assert body_of(text) == [
        r"scene & figure 1 & figure 2 \\",
        r"\midrule",
        r"cotton & \textbf{0.50} & \underline{0.70} \\",
        r"wall & n/a &  \\",
        r"\midrule",
        r"Average of 2 scenes & 0.50 &  \\",
        r"Average as printed &  & 4.34 \\",
    ]
    assert r"\usepackage{booktabs}" in text.splitlines()[1]
    assert r"\begin{tabular}{@{}lrr@{}}" in text
    assert r"\caption{Errors. All of it. Marked: the least (\textbf{bold}, \underline{underlined}).}" in text
    assert r"\label{tab:table1_mse}" in text


def test_each_section_is_a_table_with_a_label_of_its_own() -> None:
    sections = [section(line("a", 1.0, 2.0), heading=heading) for heading in ("hci: HCI", "own", "own", "Own!")]
    text = as_latex(report(sections), "stages")
    require_sound(text)
    labels = re.findall(r"\\label\{(.*)\}", text)
    assert labels[:2] == ["tab:stages-hci-hci", "tab:stages-own"]
    assert len(set(labels)) == 4
    assert r"\caption{Errors; hci: HCI. All of it.}" in text


def test_wide_tables_take_both_columns_of_the_page() -> None:
    """Heads of 18 methods side by side fit only upright."""
    text = as_latex(report([section(line("a", *map(float, range(17))), columns=18)]), "wide")
    require_sound(text)
    assert r"\begin{table*}" in text
    assert r"scene & \rotatebox{90}{figure 1} & " in text
    assert r"\usepackage{booktabs,graphicx}" in text


@pytest.mark.parametrize("name", ["[1]", "*a", "a_b & c", "50 % #1", r"\end{table}", "a\nb", "a--b---c", SPECIALS])
def test_names_are_set_as_they_are(name: str) -> None:
    text = as_latex(report([section(line(name, 1.0, None), heading=name)], caption=f"Of {name} and `{name}`."), "t")
    require_sound(text)
    assert len(body_of(text)) == 3


def test_escapes() -> None:
    assert escaped("a_b & 5 % of #2") == r"a\_b \& 5 \% of \#2"
    assert escaped("\\{}^~") == r"\textbackslash{}\{\}\textasciicircum{}\textasciitilde{}"
    assert escaped("x × 2 ± 1") == r"x $\times$ 2 $\pm$ 1"
    assert escaped("[a]*") == "{[}a{]}{*}"
    assert escaped("a---b") == "a-{}-{}-b"
    assert escaped("two\nlines") == "two lines"


def test_names_of_the_program_are_in_typewriter_type() -> None:
    text = as_latex(report([section()], caption="Variant `no_sepi`, 5 %."), "t")
    assert r"\caption{Errors. Variant \texttt{no\_sepi}, 5 \%.}" in text


@pytest.mark.parametrize("table", [name for name in TABLES if name not in PARTS_TABLES])
def test_tables_of_a_report_without_any_scene_are_sound(table: str) -> None:
    """The published figures alone, and tables that have no section at all."""
    choices = {"initial": "sepi", "occlusion": "half_sepi", "textureless": "lti", "optimize": "wls"}
    numbers = {"plan": {"scenes": {}, "variants": {"paper": choices}}, "scenes": []}
    text = as_latex(BUILDERS[table](Runs(numbers)), table)
    require_sound(text)
    assert text.endswith("\n")
    if table == "table1_mse":
        assert r"Boxes &  & \textbf{5.20} & \underline{6.70} & 10.93 &" in text
