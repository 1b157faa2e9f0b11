"""Table 3: averages over regions."""

from typing import Any

from report_results import csv_rows, markdown, numbers_of, only

from sepi.external import NO_FILE
from sepi.report.plan import Plan
from sepi.report.tabular.layout import BEST, SECOND


def test_averages_over_the_scenes_that_have_a_region(found: dict[str, Any]) -> None:
    """The occluded average leaves out the scene that has no occluded pixel."""
    rows = csv_rows(found, "table3_regions")
    ours = only(rows, method="ours")
    assert (ours["builtin_occluded"], ours["builtin_textureless"]) == ("1.0000", "2.5000")
    assert (ours["hci_occluded"], ours["hci_2013_occluded"]) == ("2.5000", "")
    assert only(rows, method="zhou")["hci_occluded"] == "20.62"
    assert only(rows, method="wang_occ")["hci_2013_textureless"] == "3.95"
    assert not [row for row in rows if row["method"] == "mishiba"]
    assert "hci: cotton, mine" in markdown(found, "table3_regions")


def test_best_has_a_row(complete: Plan) -> None:
    rows = csv_rows(numbers_of(complete), "table3_regions")
    assert only(rows, method="ours_best")["hci_textureless"] == "0.2500"


def test_averages_of_other_methods_say_how_many_scenes_they_have(external: dict[str, Any]) -> None:
    """An average over fewer scenes than ours would not compare: the cell says how many there are."""
    rows = csv_rows(external, "table3_regions")
    assert only(rows, method="SPO")["hci_textureless"] == "1 of 2 scenes"
    assert only(rows, method="SPO")["builtin_textureless"] == NO_FILE
    assert only(rows, method="odd|_name_")["hci_occluded"] == "0 of 2 scenes"
    assert only(rows, method="zhou (external)")["hci_textureless"] == "0.1000"


def test_ranks_are_over_the_same_scenes_only(external: dict[str, Any]) -> None:
    """Our average over two easy scenes must not beat the paper's over all of its 24."""
    (section,) = external["tables"]["table3_regions"]["sections"]
    rows = {row["cells"][0]["text"]: row["cells"] for row in section["rows"]}
    heads = [column["head"] for column in section["columns"]]
    column = heads.index("hci, textureless")
    assert rows["this code, best"][column]["value"] < 3.9
    marks = {name: cells[column]["mark"] for name, cells in rows.items() if cells[column]["mark"]}
    assert marks == {"Zhou et al. (SEPI)": BEST, "Zhang et al. (SPO)": SECOND}
    marks = {name: cells[heads.index("builtin, occluded")]["mark"] for name, cells in rows.items()}
    assert (marks["this code, best"], marks["this code, paper"]) == (BEST, SECOND)
