"""How many candidates a light field gets: enough for the view that moves most, and no more than are of use."""

from dataclasses import replace

import numpy as np
import pytest

from sepi.lightfield import DisparityRange, LightField
from sepi.matching.candidates import LEAST_CANDIDATES, CandidateRule
from sepi.matching.plane_sweep import CANDIDATES as PAPER
from sepi.matching.plane_sweep import SweepParameters
from sepi.matching.visibility_sweep import CANDIDATES as BEST
from sepi.matching.visibility_sweep import FirstDepthParameters

PIXELS = 512 * 512


def field_5x5() -> LightField:
    views = np.zeros((5, 5, 8, 8, 1), np.uint8)
    return LightField(views, "square", disparity_range=DisparityRange(-20, 20, "given"))


@pytest.mark.parametrize("width", [2, 3.1, 6.7, 8])
def test_light_fields_like_the_papers_get_the_published_number(width: float) -> None:
    """9x9 views and ranges of 2 to 8 pixels; any other number would change scores that are published."""
    assert PAPER.number(width, 4, PIXELS) == 181
    assert BEST.number(width, 4, PIXELS) == 91


@pytest.mark.parametrize("rule", [PAPER, BEST, CandidateRule(91, 0.1, 0.35)])
@pytest.mark.parametrize("width", [0.1, 0.6, 5.0, 20.0, 60.0])
@pytest.mark.parametrize("reach", [1.0, 2.0, 8.0])
def test_sampling_in_the_farthest_view_is_within_limits(rule: CandidateRule, width: float, reach: float) -> None:
    """Coarser, and thin things fall between two candidates; finer is time for nothing."""
    number = rule.number(width, reach, 10_000)
    sampling = width * reach / (number - 1)
    assert sampling <= rule.coarsest * (1 + 1e-6)
    # one candidate fewer would be coarse enough, too
    assert number == LEAST_CANDIDATES or sampling >= rule.finest * (number - 2) / (number - 1) - 1e-9


def test_a_cost_volume_is_bounded_but_never_below_the_usual_number() -> None:
    """A wide range on a large picture must not take all memory there is."""
    for pixels in (PIXELS, 2_000_000, 20_000_000):
        number = BEST.number(1000, 8, pixels)
        assert number == 91 or 4 * number * pixels <= 2**30
        assert number >= 91


def test_rows_further_apart_count() -> None:
    square = field_5x5()
    tall = replace(square, row_spacing=3.0)
    assert SweepParameters().number(square) == 181
    assert SweepParameters().number(tall) == 481


def test_a_number_that_is_set_goes_before() -> None:
    square = field_5x5()
    assert SweepParameters(num_disparities=5).candidates(square).tolist() == [-20, -10, 0, 10, 20]
    assert FirstDepthParameters(num_disparities=5).settled(square).num_disparities == 5
