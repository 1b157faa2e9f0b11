"""LaTeX tables: no TeX system is needed here, so what one would stumble over is looked for in the text."""

import re

import pandas as pd
import pytest

from sepi.report.table import BEST, SECOND, Head, Kind, Section, Table, as_latex, section


def in_latex(*sections: Section, caption: str = "All of it.", marked: str = "", name: str = "t") -> str:
    return as_latex(Table("Errors", caption, pd.DataFrame(), sections, marked), name)


def rows(
    *lines: list[str], heading: str = "", marks: dict[str, list[str]] | None = None, kinds: tuple[str, ...] = ()
) -> Section:
    """A section of scenes and figures."""
    cells = pd.DataFrame(
        lines or None, columns=["scene", *(f"figure {i}" for i in range(1, len(lines[0]) if lines else 3))]
    )
    heads = {name: Head(name, Kind.TEXT if name == "scene" else Kind.FIGURE) for name in cells}
    return section(heading, heads, cells, marks=pd.DataFrame(marks), rows=kinds)


def body_of(text: str) -> list[str]:
    return text.split(r"\toprule")[1].split(r"\bottomrule")[0].split("\n")[1:-1]


def test_a_table_with_its_rules_and_marks() -> None:
    lines = (
        ["cotton", "0.50", "0.70"],
        ["wall", "n/a", ""],
        ["Average of 2 scenes", "0.50", ""],
        ["As printed", "", "4.34"],
    )
    marks = {"figure 1": [BEST, "", "", ""], "figure 2": [SECOND, "", "", ""]}
    kinds = ("scene", "scene", "average", "average printed")
    text = in_latex(rows(*lines, marks=marks, kinds=kinds), marked="Marked: the least", name="table1_mse")
    assert body_of(text) == [
        r"scene & figure 1 & figure 2 \\",
        r"\midrule",
        r"cotton & \textbf{0.50} & \underline{0.70} \\",
        r"wall & n/a &  \\",
        r"\midrule",
        r"Average of 2 scenes & 0.50 &  \\",
        r"As printed &  & 4.34 \\",
    ]
    assert r"\usepackage{booktabs}" in text.splitlines()[1]
    assert r"\begin{tabular}{@{}lrr@{}}" in text
    assert r"\caption{Errors. All of it. Marked: the least (\textbf{bold}, \underline{underlined}).}" in text
    assert r"\label{tab:table1_mse}" in text


def test_each_section_is_a_table_with_a_label_of_its_own() -> None:
    sections = [rows(["a", "1.00", "2.00"], heading=heading) for heading in ("hci: HCI", "own", "own", "Own!")]
    text = in_latex(*sections, name="stages")
    labels = re.findall(r"\\label\{(.*)\}", text)
    assert labels[:2] == ["tab:stages-hci-hci", "tab:stages-own"]
    assert len(set(labels)) == 4
    assert r"\caption{Errors; hci: HCI. All of it.}" in text


def test_wide_tables_take_both_columns_of_the_page() -> None:
    """Heads of 18 methods side by side fit only upright."""
    text = in_latex(rows(["a", *map(str, range(17))]))
    assert r"\begin{table*}" in text
    assert r"scene & \rotatebox{90}{figure 1} & " in text
    assert r"\usepackage{booktabs,graphicx}" in text


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("a_b & 5 % of #2", r"a\_b \& 5 \% of \#2"),
        ("\\{}^~", r"\textbackslash{}\{\}\textasciicircum{}\textasciitilde{}"),
        ("x × 2 ± 1", r"x $\times$ 2 $\pm$ 1"),
        ("[a]*", "{[}a{]}{*}"),
        ("a---b", "a-{}-{}-b"),
        ("two\nlines", "two lines"),
        ("variant `no_sepi`, 5 %", r"variant \texttt{no\_sepi}, 5 \%"),
    ],
)
def test_escapes(text: str, expected: str) -> None:
    assert rf"\caption{{Errors. {expected}}}" in in_latex(caption=text) + in_latex(rows(), caption=text)
