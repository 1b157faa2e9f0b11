"""Cues of error: what they are on maps and sums whose answer is known."""

import numpy as np

from sepi.error_bars.cues import FLOORS, cues_of_map, cues_of_stage_before, cues_of_texture, cues_of_views
from sepi.lightfield import DisparityRange
from sepi.matching.gauss_newton import Evidence

RANGE = DisparityRange(-1, 1, "given")
SHAPE = (40, 50)
y, x = np.mgrid[: SHAPE[0], : SHAPE[1]].astype(np.float32)


def evidence(updates: tuple[float, float, float, float], information: float = 100.0) -> tuple[np.ndarray, ...]:
    """Gradient, curvature and evidence of four halves that would have the map move so."""
    halves = np.full((4, 2, *SHAPE), information, np.float32)
    halves[:, 0] = information * np.array(updates, np.float32)[:, None, None]
    ones = np.ones(SHAPE, np.float32)
    # each view is in one half of either pair
    gradient, curvature = halves[:2, 0].sum(axis=0), halves[:2, 1].sum(axis=0)
    return gradient, curvature, Evidence(halves, 3e-4 * ones, ones, 0.5 * ones, 2 * ones)


def test_a_plane_has_no_bend_and_a_step_has_its_two_surfaces() -> None:
    plane = cues_of_map(0.01 * x - 0.02 * y, np.full(SHAPE, 1e4, np.float32), RANGE)
    inner = np.s_[9:-9, 9:-9]
    for name in ("second_difference", "point_second_difference", "long_second_difference"):
        assert np.abs(plane[name][inner]).max() < 1e-5
    assert plane["smooth_confidence"][inner].min() > 0.98
    np.testing.assert_allclose(plane["above"][inner], 0.06, atol=1e-5)
    step = cues_of_map(np.where(x < 25, 0.5, -0.25).astype(np.float32), np.full(SHAPE, 1e4, np.float32), RANGE)
    # columns within two pixels of the step
    assert (step["below"] > 0).any(axis=0).nonzero()[0].tolist() == [23, 24]
    assert (step["above"] > 0).any(axis=0).nonzero()[0].tolist() == [25, 26]
    assert step["smooth_confidence"][:, 24].max() < 0.1


def test_a_curve_that_smoothing_flattens_is_seen_over_eight_pixels() -> None:
    """Of a cylinder, which is straight along its axis, nothing is flattened that way."""
    ball, cylinder = (
        cues_of_map(0.5 * bent, np.full(SHAPE, 1e4, np.float32), RANGE)["long_second_difference"][20, 25]
        for bent in (1e-3 * (x**2 + y**2), 1e-3 * x**2)
    )
    np.testing.assert_allclose(ball, 0.064, rtol=1e-3)
    assert cylinder < 1e-5


def test_views_disagree_where_opposite_halves_want_other_depths() -> None:
    """A reflection, or a wrong surface at an occlusion, moves the two sides apart; a wrong depth moves both alike."""
    alike = cues_of_views(*evidence((0.02, 0.02, 0.02, 0.02)), noise=0.01)
    apart = cues_of_views(*evidence((0.03, 0.01, 0.02, 0.02)), noise=0.01)
    np.testing.assert_allclose(alike["step"], 0.02, rtol=1e-4)
    assert alike["disagreement"].max() < 1e-6
    np.testing.assert_allclose(apart["step"], 0.02, rtol=1e-4)
    # a difference of 0.02 between halves of equal information, on one of two axes
    np.testing.assert_allclose(apart["disagreement"], 0.01 / np.sqrt(2), rtol=1e-2)
    np.testing.assert_allclose(alike["misfit"], np.sqrt(3e-4 / 3) / 0.01, rtol=1e-4)
    np.testing.assert_allclose(alike["agreement"], 0.5, rtol=1e-4)
    np.testing.assert_allclose(alike["wide_deviation"], 1 / np.sqrt(200), rtol=1e-3)


def test_a_row_of_views_is_not_asked_what_it_cannot_know() -> None:
    """Views of one row disagree by what left and right say; that there is nothing above and below is no agreement."""
    gradient, curvature, told = evidence((0.03, 0.01, 0.0, 0.0))
    told.halves[2:] = 0
    row = cues_of_views(gradient, curvature, told, noise=0.01)["disagreement"]
    np.testing.assert_allclose(row, 0.01, rtol=1e-2)


def test_where_no_view_sees_signs_are_numbers() -> None:
    gradient, curvature, told = evidence((0.0, 0.0, 0.0, 0.0), information=0.0)
    nothing = Evidence(*(np.zeros_like(values) for values in told))
    cues = {
        **cues_of_map(np.zeros((2, 3), np.float32), np.zeros((2, 3), np.float32), RANGE),
        **cues_of_views(gradient, curvature, nothing, noise=0.0),
        **cues_of_stage_before(nothing.seeing, np.ones(SHAPE, bool), None, np.ones(SHAPE, np.float32)),
        **cues_of_texture(nothing.seeing, nothing.seeing, nothing.seeing),
    }
    for name, values in cues.items():
        assert np.isfinite(values).all(), name
    assert set(FLOORS) <= set(cues)


def test_a_border_is_no_evidence_for_the_bare_pixels_beside_it() -> None:
    """Sky beside a wire matches the wire's depth as well, since nothing changes there; the wire knows its own."""
    wire = np.abs(x - 25) < 2
    curvature, confidence = np.where(wire, 1e4, 1.0).astype(np.float32), np.where(wire, 0.9, 0.1).astype(np.float32)
    gradient, _, told = evidence((0.0, 0.0, 0.0, 0.0))
    cues = cues_of_stage_before(confidence, ~wire, None, curvature) | cues_of_views(gradient, curvature, told, 0.01)
    for name, of_sky in (("wide_deviation", 1.0), ("wide_confidence", 0.1)):
        np.testing.assert_allclose(cues[name][:, 29], of_sky, rtol=0.01)
        assert np.abs(cues[name][:, 25] / of_sky - 1).min() > 0.5
