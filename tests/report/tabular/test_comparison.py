"""Tables 1 to 3: our figures, the published ones, and those of other methods' maps, side by side."""

import copy
from dataclasses import replace
from typing import Any

import pytest
from report_results import cells_of, csv_rows, markdown, numbers_of, only, report_of

from sepi.external import NO_FILE
from sepi.report.plan import Plan
from sepi.report.tabular.layout import BEST, SECOND, as_json


def test_our_figure_stands_beside_the_published_ones(found: dict[str, Any]) -> None:
    """Folder cotton is the paper's Cotton; its MSE x100 here is 100 * 0.1^2, its Q25 x100 is 10."""
    mse = only(csv_rows(found, "table1_mse"), dataset="hci", scene="Cotton")
    assert (mse["ours"], mse["zhou"], mse["mishiba"], mse["jin"]) == ("1.0000", "1.20", "0.91", "1.99")
    q25 = only(csv_rows(found, "table2_q25"), dataset="hci", scene="Cotton")
    assert (q25["ours"], q25["zhou"]) == ("10.0000", "0.34")
    assert (mse["ratio"], q25["ratio"]) == ("0.8333", "29.4118")
    page = markdown(found, "table1_mse")
    assert "| Cotton | *1.00* | 0.83 | 1.20 | 1.24 | 4.17 | 5.90 | 1.94 | **0.91** | 13.59 | 0.21 |" in page


def test_scenes_that_are_not_available_are_published_only(found: dict[str, Any]) -> None:
    rows = csv_rows(found, "table1_mse")
    antinous = only(rows, dataset="hci", scene="Antinous")
    assert (antinous["ours"], antinous["ratio"], antinous["zhou"], antinous["jin"]) == ("", "", "12.84", "")
    assert len([row for row in rows if row["row"] == "scene" and row["zhou"]]) == 31


@pytest.mark.parametrize(
    ("dataset", "scene", "ours"),
    [("builtin", "dots", "1.0000"), ("builtin", "flat", "4.0000"), ("hci", "mine", "4.0000")],
)
def test_scenes_the_paper_does_not_have_get_our_figures_only(
    dataset: str, scene: str, ours: str, found: dict[str, Any]
) -> None:
    """A built-in scene called dots must not be compared with the benchmark's Dots."""
    rows = csv_rows(found, "table1_mse")
    row = only(rows, dataset=dataset, scene=scene)
    assert (row["ours"], row["ratio"], row["zhou"]) == (ours, "", "")
    assert only(rows, dataset="hci", scene="Dots")["ours"] == ""


@pytest.mark.parametrize("table", ["table1_mse", "table2_q25", "table4_ablation", "stages"])
def test_pictures_without_ground_truth_have_no_row(table: str, found: dict[str, Any]) -> None:
    assert not [row for row in csv_rows(found, table) if row["scene"] == "picture"]


def test_averages_say_over_what(found: dict[str, Any], plan: Plan) -> None:
    """Averages compare only over the same scenes: a method without a figure for one of them gets none."""
    rows = csv_rows(found, "table1_mse")
    ours = only(rows, dataset="builtin", row="average")
    assert (ours["scene"], ours["ours"]) == ("Average of 2 scenes available", "2.5000")
    assert only(rows, dataset="hci", row="average")["zhou"] == ""
    printed = only(rows, dataset="hci", row="average printed")
    assert (printed["ours"], printed["zhou"]) == ("", "4.34")
    assert not [row for row in rows if row["dataset"] == "hci_2013" and row["row"] == "average"]
    alone = csv_rows(numbers_of(replace(plan, scenes={"hci": ["cotton"]})), "table1_mse")
    row = only(alone, dataset="hci", row="average")
    assert (row["scene"], row["ours"], row["zhou"]) == ("Average of 1 scene available", "1.0000", "1.20")
    assert row["ratio"] == "0.8333"
    # learned methods have figures of the scenes that they were not trained on
    cells = cells_of(found, "table1_mse", "hci", "Average as printed (24 scenes)")
    assert [cells[head]["text"] for head in ("Zhou et al. (SEPI)", "Tsai et al. (LFattNet)*")] == [
        "4.34",
        "0.91 (8 scenes)",
    ]


def test_best_stands_beside_the_papers_variant(complete: Plan) -> None:
    """The default variant must be seen beside the paper's."""
    found = numbers_of(complete)
    mse = only(csv_rows(found, "table1_mse"), dataset="hci", scene="Cotton")
    assert (mse["ours_best"], mse["ours"], mse["zhou"]) == ("0.2500", "1.0000", "1.20")
    assert (mse["ratio_best"], mse["ratio"]) == ("0.2083", "0.8333")
    heads = "| this code, best | this code, paper | best / published | paper / published | Zhou et al."
    assert heads in markdown(found, "table1_mse")
    assert "| this code, best | this code, paper |" in markdown(found, "table2_q25")


def test_cells_say_their_kind(external: dict[str, Any]) -> None:
    """The page colours and sorts by it."""
    cells = cells_of(external, "table1_mse", "hci", "Cotton")
    for head, text, value, kind, mark in (
        ("this code, best", "0.25", 0.25, "ours", BEST),
        ("best / published", "0.21", 0.25 / 1.2, "ratio", None),
        ("Mishiba et al.", "0.91", 0.91, "published", SECOND),
        ("SPO (external)", "4.00", 4, "external", None),
    ):
        assert cells[head] == {"text": text, "value": pytest.approx(value), "kind": kind, "mark": mark}
    wrong = cells["odd|_name_ (external)"]
    assert (wrong["text"], wrong["value"]) == ("80x40 instead of 40x40", None)
    rows = [row for section in external["tables"]["table1_mse"]["sections"] for row in section["rows"]]
    available = {row["cells"][0]["text"] for row in rows if row["available"]}
    assert available == {"Cotton", "mine", "dots", "Average of 1 scene available", "Average of 2 scenes available"}
    assert {row["kind"] for row in rows} == {"scene", "average", "average printed"}


def test_other_methods_maps_stand_beside_ours(external: dict[str, Any]) -> None:
    """A method whose name is that of a published column does not take its place."""
    rows = csv_rows(external, "table1_mse")
    cotton = only(rows, dataset="hci", scene="Cotton")
    assert (cotton["SPO"], cotton["zhou (external)"], cotton["zhou"]) == ("4.0000", "0.0400", "1.20")
    mine = only(rows, dataset="hci", scene="mine")
    assert (mine["SPO"], mine["zhou (external)"], mine["odd|_name_"]) == (NO_FILE, "0.1600", "not readable")
    average = only(rows, dataset="hci", row="average")
    assert (average["SPO"], average["zhou (external)"], average["odd|_name_"]) == ("", "0.1000", "")
    assert only(rows, dataset="hci", scene="Antinous")["SPO"] == ""


def test_methods_have_no_column_for_datasets_they_have_nothing_of(external: dict[str, Any]) -> None:
    """But one without any file at all has columns: a mistyped folder must be seen."""
    cells = cells_of(external, "table1_mse", "builtin", "dots")
    assert list(cells) == ["scene", "this code, best", "this code, paper"]
    found = copy.deepcopy(external)
    for scene in found["scenes"]:
        scene["external"]["SPO"] |= {"problem": NO_FILE, "scores": {}}
    found["tables"] = {"table1_mse": as_json(report_of(found, "table1_mse"))}
    assert cells_of(found, "table1_mse", "builtin", "dots")["SPO (external)"]["text"] == NO_FILE


@pytest.mark.parametrize(
    ("dataset", "row", "marked"),
    [
        ("hci", "Boxes", {"Zhou et al. (SEPI)": BEST, "Han et al. (OAVC)": SECOND}),
        ("hci", "Dino", {"Han et al. (OAVC)": BEST, "Zhang et al. (SPO)": SECOND}),
        ("hci", "Cotton", {"this code, best": BEST, "Mishiba et al.": SECOND}),
        ("hci", "Average as printed (24 scenes)", {"Zhou et al. (SEPI)": BEST, "Zhang et al. (SPO)": SECOND}),
        ("builtin", "dots", {"this code, best": BEST, "this code, paper": SECOND}),
    ],
)
def test_best_and_second_best_are_marked_as_in_the_paper(
    dataset: str, row: str, marked: dict[str, str], external: dict[str, Any]
) -> None:
    """Boxes and Dino are in colour in the paper's table 1. Learned and external methods are not ranked."""
    cells = cells_of(external, "table1_mse", dataset, row)
    assert {head: cell["mark"] for head, cell in cells.items() if cell["mark"]} == marked


def test_equal_figures_are_marked_alike(external: dict[str, Any]) -> None:
    """Buddha: 0.45, then twice 0.48."""
    cells = cells_of(external, "table1_mse", "hci_2013", "Buddha").values()
    assert [cell["mark"] for cell in cells if cell["mark"]] == [SECOND, SECOND, BEST]


def test_averages_over_the_scenes_that_have_a_region(found: dict[str, Any]) -> None:
    """The occluded average leaves out the scene that has no occluded pixel."""
    rows = csv_rows(found, "table3_regions")
    ours = only(rows, method="ours")
    assert (ours["builtin_occluded"], ours["builtin_textureless"]) == ("1.0000", "2.5000")
    assert (ours["hci_occluded"], ours["hci_2013_occluded"]) == ("2.5000", "")
    assert only(rows, method="zhou")["hci_occluded"] == "20.62"
    assert only(rows, method="wang_occ")["hci_2013_textureless"] == "3.95"
    assert not [row for row in rows if row["method"] == "mishiba"]
    assert (ours["builtin_occluded_scenes"], ours["builtin_textureless_scenes"]) == ("1", "2")
    page = markdown(found, "table3_regions")
    assert "| this code, paper | 1.00 (1 scene) | 2.50 |" in page
    assert "hci: cotton, mine" in page
    learned = only(rows, method="tsai")
    assert (learned["hci_occluded_scenes"], learned["hci_2013_occluded_scenes"]) == ("8", "7")


def test_best_has_a_row_in_table_3(complete: Plan) -> None:
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
