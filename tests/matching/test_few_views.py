"""Smoothing by how many views a mean of costs is over."""

import pytest

from sepi.matching.semi_global import SmoothingParameters


def test_few_views_weigh_less_against_the_penalties() -> None:
    """If this fails, two pictures are smoothed as if they were eighty-one, and three as if nothing were known."""
    usual = SmoothingParameters()
    assert usual.for_views(25, 25) == usual.for_views(81, 27) == usual
    few = usual.for_views(9, 9)
    assert few.large_penalty == pytest.approx(25 / 9)
    assert few.small_penalty == pytest.approx(0.03 * 25 / 9)
    assert few.colour_weakening == usual.colour_weakening
    # nine of many weigh as little, and their window stays as narrow
    assert usual.for_views(81, 9) == few.model_copy(update={"window_radius": usual.window_radius})
    # samples of all views in the window, and no more than twice its radius
    assert [usual.for_views(n, n).window_radius for n in (24, 13, 12, 9, 7, 2)] == [2, 2, 3, 3, 4, 4]
    assert SmoothingParameters(window_radius=0).for_views(2, 2).window_radius == 0
