"""The command that writes the tables, and what holds for all of them."""

import csv
import json
import re
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner
from report_results import csv_rows, markdown, only, renamed, report_of

from sepi.external import NO_FILE
from sepi.report import numbers, tables
from sepi.report.plan import PARTS_TABLES, TABLES
from sepi.report.tabular.latex import as_latex
from sepi.report.tabular.layout import as_csv, as_json

MAIN_TABLES = [name for name in TABLES if name not in PARTS_TABLES]


def test_every_table_is_written_thrice_and_the_same_each_time(found: dict[str, Any], tmp_path: Path) -> None:
    path = tmp_path / "report.json"
    path.write_text(numbers.as_text(found), encoding="utf-8")
    for folder in (tmp_path / "one", tmp_path / "two"):
        result = CliRunner().invoke(tables.command, ["--numbers", str(path), "--output", str(folder)])
        assert result.exit_code == 0, result.output
        assert {file.name for file in folder.iterdir()} == {
            f"{name}.{ending}" for name in MAIN_TABLES for ending in ("csv", "md", "tex")
        }
    for file in (tmp_path / "one").iterdir():
        assert file.read_bytes() == (tmp_path / "two" / file.name).read_bytes()


def test_one_table_alone(found: dict[str, Any], tmp_path: Path) -> None:
    path = tmp_path / "report.json"
    path.write_text(numbers.as_text(found), encoding="utf-8")
    words = ["--numbers", str(path), "--output", str(tmp_path / "out"), "--table", "runtime"]
    assert CliRunner().invoke(tables.command, words).exit_code == 0
    assert {file.stem for file in (tmp_path / "out").iterdir()} == {"runtime"}


@pytest.mark.parametrize(
    ("content", "arguments", "message"),
    [
        (None, [], "cannot be read"),
        ("{", [], "not JSON"),
        ('{"plan": {}}', [], "not the numbers of a report"),
        (
            '{"plan": {}, "scenes": [], "tables": {"runtime": {}}}',
            ["--table", "ablation_best"],
            "tables: unknown 'ablation_best'; known: runtime",
        ),
    ],
)
def test_wrong_numbers_are_one_line(content: str | None, arguments: list[str], message: str, tmp_path: Path) -> None:
    path = tmp_path / "report.json"
    if content is not None:
        path.write_text(content)
    words = ["--numbers", str(path), "--output", str(tmp_path / "out"), *arguments]
    result = CliRunner().invoke(tables.command, words)
    assert result.exit_code == 1
    assert result.output.startswith(f"sepi: {path}: {message}")
    assert len(result.output.splitlines()) == 1
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("table", MAIN_TABLES)
def test_the_page_and_the_tables_show_the_same(table: str, external: dict[str, Any]) -> None:
    """The HTML page shows what JSON says, a paper what LaTeX says: no figure may differ."""
    report = report_of(external, table)
    shown = external["tables"][table]
    assert shown == json.loads(json.dumps(as_json(report)))
    assert {"title", "caption", "sections"} == set(shown)
    signs = {"best": "**", "second": "*", None: ""}
    expected = []
    for section in shown["sections"]:
        expected.append([column["head"] for column in section["columns"]])
        expected += [
            [f"{signs[c['mark']]}{c['text']}{signs[c['mark']]}" for c in row["cells"]] for row in section["rows"]
        ]
    lines = [line for line in markdown(external, table).splitlines() if line.startswith("| ")]
    rows = [[cell.strip().replace("\\", "") for cell in re.split(r"(?<!\\)\|", line)[1:-1]] for line in lines]
    assert rows == expected
    in_latex = [line for line in as_latex(report, table).splitlines() if line.endswith(r"\\")]
    assert [line.count(" & ") + 1 for line in in_latex] == [len(row) for row in expected]


def test_no_name_of_the_users_breaks_a_table(external: dict[str, Any]) -> None:
    """Folders may have any name."""
    scene, method = "_a_ | b\\|c\n<img> *d* `e` & [f](g) #1 ~~h~~", 'x,"y"; | 50 % $z^2$ {\\end}'
    found = renamed(external, {"mine": scene, "SPO": method})
    for name in MAIN_TABLES:
        report = report_of(found, name)
        sections = iter(report.sections)
        for line in markdown(found, name).splitlines():
            if line.startswith("|"):
                # what is escaped is no markup
                bare = re.sub(r"\\.", "", line).replace("**", "").replace("*", "")
                assert not re.search(r"[<>`\[\]&~\\]|(?<!\w)_|_(?!\w)", bare), line
                if not bare.strip("| -:"):
                    assert bare.count("|") == len(next(sections).columns) + 1
        assert next(sections, None) is None
        rows = list(csv.reader(as_csv(report).splitlines(keepends=True)))
        assert {len(row) for row in rows} == {len(report.heads)}
    assert only(csv_rows(found, "table1_mse"), scene=scene)[method] == NO_FILE
