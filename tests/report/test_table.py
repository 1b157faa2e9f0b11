"""Marks of the best and second best figures."""

import pandas as pd
import pytest

from sepi.report.table import BEST, SECOND, ranks, shown


@pytest.mark.parametrize(
    ("values", "expected"),
    [
        ([3, 1, 2], [None, BEST, SECOND]),
        ([0.4849, 0.4751, 0.9], [BEST, BEST, SECOND]),
        ([0.474, 0.476], [BEST, SECOND]),
        ([1, 1, 1], [BEST, BEST, BEST]),
        ([2, 1, 2], [SECOND, BEST, SECOND]),
        ([None, 5, float("nan"), 4], [None, SECOND, None, BEST]),
        ([None, 5, None], [None, None, None]),
        ([], []),
    ],
)
def test_marks_follow_the_printed_figures(values: list[float | None], expected: list[str | None]) -> None:
    """What looks equal is marked alike, and a lone figure not at all."""
    marks = ranks(shown(pd.DataFrame({"figure": values}, dtype=float), missing="n/a"))
    assert [mark or None for mark in marks["figure"]] == expected
