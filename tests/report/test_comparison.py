"""Tables 1 to 3: our figures, the published ones, and those of other methods' maps, side by side."""

import copy

import pytest
from report_results import cells_of, csv_rows, only, renamed, report_of

from sepi.external import NO_FILE
from sepi.report.runs import Runs
from sepi.report.table import BEST, SECOND


@pytest.mark.parametrize("table", ["table1_mse", "table2_q25", "table4_ablation", "stages", "edges", "error_bars"])
def test_pictures_without_ground_truth_have_no_row(table: str, found: Runs) -> None:
    assert not [row for row in csv_rows(found, table) if row["scene"] == "picture"]


@pytest.mark.parametrize(("folder", "row"), [("Cotton", "Cotton (folder)"), ("Average", "Average")])
def test_a_folder_that_is_named_like_a_row_of_the_paper_has_one_of_its_own(folder: str, row: str, found: Runs) -> None:
    rows = csv_rows(renamed(found, {"mine": folder}), "table1_mse")
    mine, cotton = (only(rows, dataset="hci", scene=scene) for scene in (row, "Cotton"))
    assert (mine["ours"], mine["zhou"]) == ("4.0000", "")
    assert (cotton["ours"], cotton["zhou"]) == ("1.0000", "1.20")


def test_methods_have_no_column_for_datasets_they_have_nothing_of(external: Runs) -> None:
    """But one without any file at all has columns: a mistyped folder must be seen."""
    cells = cells_of(external, "table1_mse", "builtin", "dots")
    assert list(cells) == ["scene", "this code, best", "this code, paper"]
    facts = copy.deepcopy(external.facts)
    for scene in facts["scenes"]:
        scene["external"]["SPO"]["problem"] = NO_FILE
    found = Runs(facts, external.numbers[external.numbers["variant"] != "SPO"])
    assert cells_of(found, "table1_mse", "builtin", "dots")["SPO (external)"][0] == NO_FILE


@pytest.mark.parametrize(
    ("dataset", "row", "marked"),
    [
        ("hci", "Boxes", {"Zhou et al. (SEPI)": BEST, "Han et al. (OAVC)": SECOND}),
        ("hci", "Cotton", {"this code, best": BEST, "Mishiba et al.": SECOND}),
        ("builtin", "dots", {"this code, best": BEST, "this code, paper": SECOND}),
    ],
)
def test_best_and_second_best_are_marked(dataset: str, row: str, marked: dict[str, str], external: Runs) -> None:
    """Boxes and Dino are in colour in the paper's table 1. Learned and external methods are not ranked."""
    cells = cells_of(external, "table1_mse", dataset, row)
    assert {head: mark for head, (_, _, mark, _) in cells.items() if mark} == marked


def test_equal_figures_are_marked_alike(external: Runs) -> None:
    """Buddha: 0.45, then twice 0.48."""
    cells = cells_of(external, "table1_mse", "hci_2013", "Buddha").values()
    assert [mark for _, _, mark, _ in cells if mark] == [SECOND, SECOND, BEST]


def test_ranks_are_over_the_same_scenes_only(external: Runs) -> None:
    """Our average over two easy scenes must not beat the paper's over all of its 24."""

    def column(name: str) -> dict[str, tuple[str, float | None, str]]:
        (section,) = report_of(external, "table3_regions").sections
        place = [head.text for head in section.heads].index(name)
        return {cells[0][0]: cells[place] for _, _, cells in section.lines}

    cells = column("hci, textureless")
    assert (cells["this code, best"][1] or 9) < 3.9
    assert {name: mark for name, (_, _, mark) in cells.items() if mark} == {
        "Zhou et al. (SEPI)": BEST,
        "Zhang et al. (SPO)": SECOND,
    }
    cells = column("builtin, occluded")
    assert (cells["this code, best"][2], cells["this code, paper"][2]) == (BEST, SECOND)
