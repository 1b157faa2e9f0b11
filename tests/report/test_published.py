"""The published figures: complete, well typed, and consistent with the averages that the paper prints itself."""

from sepi.report import published


def test_a_few_cells_by_eye() -> None:
    """Cells read from the printed page, one per corner of the tables."""
    table1, table2 = published.table1(), published.table2()
    assert table1.at[("hci", "Cotton"), "zhou"] == 1.20
    assert table2.at[("hci", "Cotton"), "zhou"] == 0.34
    assert table1.at[("hci", "Antinous"), "mishiba"] == 5.25
    assert table1.at[("hci", "Stripes"), "jeon"] == 1043.84
    assert table2.at[("hci_2013", "Stilllife"), "jin"] == 1.33
    assert published.table3().at["wang_occ", ("hci", "occluded")] == 37.26


def test_scene_names_are_matched_within_their_dataset_only() -> None:
    """A built-in scene called dots is not the benchmark's Dots."""
    assert published.paper_scene("hci", "cotton") == "Cotton"
    archive = ["buddha", "buddha2", "horses", "medieval", "monasRoom", "papillon", "stillLife"]
    # each folder of the archive meets its row, or it has no published figure, average and rank
    assert [published.paper_scene("hci_2013", name) for name in archive] == published.scenes("hci_2013")
    assert published.paper_scene("hci", "monasRoom") is None
    assert published.paper_scene("hci", "buddha") is None
    assert published.paper_scene("builtin", "dots") is None
