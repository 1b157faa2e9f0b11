"""The command that writes the tables, and what holds for all of them."""

import csv
import re
from pathlib import Path

import pytest
from report_results import csv_rows, markdown, only, renamed, report_of

from sepi.errors import SepiError
from sepi.external import NO_FILE
from sepi.report import numbers, tables
from sepi.report.plan import TABLES
from sepi.report.runs import KEYS, Runs, read_numbers
from sepi.report.table import as_csv, as_latex

MAIN_TABLES = TABLES[""]


def test_every_table_is_written_thrice_and_the_same_each_time(found: Runs, tmp_path: Path) -> None:
    one, two = (tmp_path / name for name in ("one", "two"))
    for folder in (one, two):
        tables.write_tables(found, folder)
    endings = ("csv", "md", "tex")
    assert {file.name for file in one.iterdir()} == {f"{name}.{ending}" for name in MAIN_TABLES for ending in endings}
    for file in one.iterdir():
        assert file.read_bytes() == (two / file.name).read_bytes()


HEADS = ",".join([*KEYS, "score", "value"])


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("a.json", None, "cannot be read"),
        ("a.json", '{"plan": {}}', "not a file of a report's numbers"),
        ("a.csv", None, "cannot be read"),
        ("a.csv", "\xff", "not a file of a report's numbers"),
        ("a.csv", f"{HEADS}\n1,2,3,4,5,6,7,8,words\n", "not a file of a report's numbers"),
    ],
)
def test_wrong_numbers_are_one_line(name: str, content: str | None, message: str, found: Runs, tmp_path: Path) -> None:
    """Of another program, or edited."""
    numbers.write_numbers(found, tmp_path / "a.json")
    (tmp_path / name).unlink()
    if content is not None:
        (tmp_path / name).write_bytes(content.encode("latin-1"))
    with pytest.raises(SepiError) as told:
        read_numbers(tmp_path / "a.json")
    assert str(told.value).startswith(f"{tmp_path / name}: {message}")
    assert len(str(told.value).splitlines()) == 1


@pytest.mark.parametrize("name", MAIN_TABLES)
def test_the_page_and_the_tables_show_the_same(name: str, external: Runs) -> None:
    """The HTML page shows what sections say, a paper what LaTeX says: no figure may differ."""
    found = report_of(external, name)
    signs = {"best": "**", "second": "*", "": ""}
    expected = []
    for section in found.sections:
        expected.append([head.text for head in section.heads])
        expected += [[f"{signs[mark]}{text}{signs[mark]}" for text, _, mark in cells] for *_, cells in section.lines]
    lines = [line for line in markdown(external, name).splitlines() if line.startswith("| ")]
    rows = [[cell.strip().replace("\\", "") for cell in re.split(r"(?<!\\)\|", line)[1:-1]] for line in lines]
    assert rows == expected
    in_latex = [line for line in as_latex(found, name).splitlines() if line.endswith(r"\\")]
    assert [line.count(" & ") + 1 for line in in_latex] == [len(row) for row in expected]


def test_no_name_of_the_users_breaks_a_table(external: Runs) -> None:
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
                    assert bare.count("|") == len(next(sections).heads) + 1
        assert next(sections, None) is None
        rows = list(csv.reader(as_csv(report).splitlines(keepends=True)))
        assert {len(row) for row in rows} == {len(report.rows.columns)}
    assert only(csv_rows(found, "table1_mse"), scene=scene)[method] == NO_FILE
