"""Table 4 and the ablation of variant best."""

from typing import Any

from report_results import VARIANTS, csv_rows, markdown, numbers_of, only

from sepi.report.plan import Plan


def test_ablation_table(found: dict[str, Any]) -> None:
    rows = csv_rows(found, "table4_ablation")
    cotton = only(rows, scene="cotton", region="all")
    assert [cotton[name] for name in VARIANTS] == ["1.0000", "4.0000", "9.0000"]
    assert only(rows, scene="flat", region="occluded")["paper"] == "nan"
    printed = [row for row in rows if row["dataset"] == "hci" and row["row"] == "average printed"]
    assert [row["no_occlusion"] for row in printed] == ["8.11", "36.15", "3.97"]
    assert [row["wang"] for row in printed] == ["13.12", "", ""]
    page = markdown(found, "table4_ablation")
    assert "| cotton | 1.00/1.00/1.00 | 4.00/4.00/4.00 | 9.00/9.00/9.00 |" in page
    assert "| Average as printed (24 scenes) | 4.34/20.62/3.90 | 8.11/36.15/3.97 | 13.12 |" in page
    assert "| flat | 4.00/n/a/4.00 |" in page
    assert "| Average of 2 scenes available | 2.50/1.00/2.50 (2/1/2 scenes) |" in page
    assert only(rows, scene="Average of 1 scene available")["region"] == "occluded"


def test_best_has_an_ablation_of_its_own(complete: Plan) -> None:
    """Its reduced variants do not crowd the other tables."""
    found = numbers_of(complete)
    table4 = csv_rows(found, "table4_ablation")
    assert "best" in table4[0]
    assert "best_wls" not in table4[0]
    parts = csv_rows(numbers_of(complete, parts=True), "ablation_best")
    assert [(row["variant"], row["mse100"], row["seconds"]) for row in parts] == [
        ("best", "0.2500", "6.0000"),
        ("best_wls", "16.0000", "6.0000"),
    ]
