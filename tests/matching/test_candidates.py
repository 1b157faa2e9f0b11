"""How many candidates a light field gets: enough for the view that moves most, and no more than are of use."""

from dataclasses import replace

import numpy as np
import pytest

from sepi.errors import SepiError
from sepi.lightfield import DisparityRange, LightField
from sepi.matching.candidates import LEAST_CANDIDATES, MOST_CANDIDATES, CandidateParameters, CandidateRule
from sepi.matching.plane_sweep import CANDIDATES as PAPER
from sepi.matching.plane_sweep import SweepParameters
from sepi.matching.visibility_sweep import CANDIDATES as BEST
from sepi.matching.visibility_sweep import FirstDepthParameters
from sepi.scenes import render
from sepi.variants import STAGES

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
def test_the_sampling_in_the_farthest_view_stays_within_the_limits(
    rule: CandidateRule, width: float, reach: float
) -> None:
    """Coarser, and thin things fall between two candidates; finer is time for nothing."""
    number = rule.number(width, reach, 10_000)
    sampling = width * reach / (number - 1)
    assert sampling <= rule.coarsest * (1 + 1e-6)
    # one candidate fewer would be coarse enough, too
    assert number == LEAST_CANDIDATES or sampling >= rule.finest * (number - 2) / (number - 1) - 1e-9


def test_the_number_grows_with_the_range_and_the_grid() -> None:
    for rule in (PAPER, BEST):
        numbers = [rule.number(width, 2, PIXELS) for width in np.geomspace(0.01, 1e4, 60)]
        assert numbers == sorted(numbers)
        assert (numbers[0], numbers[-1]) == (LEAST_CANDIDATES, MOST_CANDIDATES if rule is PAPER else 1024)
        assert numbers == [rule.number(width / 2, 4, PIXELS) for width in np.geomspace(0.01, 1e4, 60)]


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


def test_what_is_settled_is_what_runs() -> None:
    """The result tells the number that was used."""
    scene = render("pyramids", size=64)
    for choices in STAGES.values():
        for choice in choices.values():
            settled = choice.parameters().settled(scene)
            if isinstance(settled, CandidateParameters):
                usual = {91, 181, choice.parameters().number(scene)}
                assert settled.num_disparities in usual
            assert settled.model_dump(exclude={"num_disparities"}) == choice.parameters().model_dump(
                exclude={"num_disparities"}
            )


def test_no_number_without_a_range() -> None:
    scene = replace(render("pyramids", size=64), disparity_range=None)
    with pytest.raises(SepiError, match="disparity range unknown"):
        SweepParameters().number(scene)
