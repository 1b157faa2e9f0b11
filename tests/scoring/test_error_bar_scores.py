"""Scores of error bars on arrays whose right answer is plain."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import norm

from sepi.evaluate import evaluation_of
from sepi.scenes import render
from sepi.scoring.error_bars import ERROR_BAR_SCORES, ErrorBars, ause, coverage, normal_nll, reliability
from sepi.scoring.scores import score
from sepi.stage import StageMaps

NAN = np.nan


def test_coverage_counts_what_is_known_of_the_truth() -> None:
    """Of five known pixels three are held, one of them at its very bound; an interval that is none holds nothing."""
    truth = np.array([0.0, 1.0, 1.0, 1.0, 1.0, NAN], np.float32)
    low = np.array([-1.0, 1.0, 0.5, 1.125, NAN, -9.0], np.float32)
    high = np.array([1.0, 2.0, 1.0, 3.0, 9.0, 9.0], np.float32)
    assert coverage(low, high, truth) == 60
    # a truth in steps of 0.25 may be 0.125 off
    assert coverage(low, high, truth, truth_step=0.25) == 80
    assert coverage(low, high, truth, truth_step=0.2) == 60
    high[0] = np.inf
    assert coverage(low, high, truth) == 40
    assert np.isnan(coverage(low[5:], high[5:], truth[5:]))


def test_the_interval_of_a_normal_sample_holds_nine_of_ten() -> None:
    """And with the right sigma neither a smaller nor a larger one is as likely."""
    random = np.random.default_rng(1)
    sigma = random.uniform(0.01, 0.2, 20000).astype(np.float32)
    error = (random.normal(size=20000) * sigma).astype(np.float32)
    width = norm.ppf(0.95) * sigma
    assert coverage(error - width, error + width, np.zeros(20000)) == pytest.approx(90, abs=1)
    likelihoods = [normal_nll(error, factor * sigma) for factor in (0.7, 1, 1.4)]
    assert min(likelihoods) == likelihoods[1]
    confidence = norm.cdf(0.07 / sigma) - norm.cdf(-0.07 / sigma)
    assert reliability(confidence, error, 0.07).gap < 5
    assert reliability(confidence**2, error, 0.07).gap > 15


@pytest.mark.parametrize("step", [0, 1e-6, 0.05, 0.5])
def test_the_likelihood_is_scipys(step: float) -> None:
    """Of the density, and of a rounded truth the mean density over its step, far out in the tails too."""
    error = np.array([0.0, -0.03, 0.1, 2.0, NAN])
    sigma = np.array([0.01, 0.02, 0.1, 0.3, 1.0])
    near, far = ((np.abs(error[:4]) + side * step / 2) / sigma[:4] for side in (-1, 1))
    density = (norm.sf(near) - norm.sf(far)) / step if step > 1e-3 else norm.pdf(error[:4] / sigma[:4]) / sigma[:4]
    assert normal_nll(error, sigma, step) == pytest.approx(-np.log(density).mean(), rel=1e-6)
    assert np.isfinite(normal_nll(np.array([3.0]), np.array([1e-3]), step))
    assert np.isnan(normal_nll(error[4:], sigma[4:], step))


def test_the_sparsification_error_of_known_orders() -> None:
    """Zero for the order of the errors; of 1 and 3 in the wrong order, 1 in place of 3 is taken away first.

    Up to 25 % taken away both are there (means of 2); from then on 3 stays in place of 1. Of 100 shares, 0 % to 25 %
    round to two pixels.
    """
    error = np.array([1.0, -3.0, NAN])
    assert ause(np.array([0.1, 0.2, 9]), error) == 0
    assert ause(np.array([0.2, 0.1, 9]), error) == pytest.approx(74 / 100 * (3 - 1) / 2)
    # what has no standard deviation is doubted most
    assert ause(np.array([0.1, NAN, 9]), error) == 0
    assert ause(np.array([NAN, 0.1, 9]), error) == ause(np.array([0.2, 0.1, 9]), error)
    assert ause(np.ones(4), np.zeros(4)) == 0
    assert np.isnan(ause(np.ones(1), np.array([NAN])))


def test_reliability_sorts_by_what_was_said() -> None:
    """Bins of a tenth, the last with 1 in it; one of few pixels does not make the gap."""
    said = np.array([0.05] * 100 + [0.62] * 100 + [1.0] * 100 + [0.35])
    error = np.array([0.5] * 90 + [0.01] * 10 + [0.07] * 60 + [-0.08] * 39 + [NAN] + [0.0] * 98 + [9.0] * 2 + [0.0])
    found = reliability(said, error, close=0.07)
    assert found.pixels.tolist() == [100, 0, 0, 1, 0, 0, 100, 0, 0, 100]
    assert found.found[[0, 6, 9]].tolist() == [0.1, 0.6, 0.98]
    assert found.said[[0, 6, 9]] == pytest.approx([0.05, 0.62, 1])
    assert found.gap == pytest.approx(5)
    assert np.isnan(reliability(said[:0], error[:0], 0.07).gap)


def test_a_map_has_scores_of_its_error_bars_in_every_region() -> None:
    """Over the very pixels of the other scores; the confidence is about less where views stand farther apart."""
    light_field = render("curved_occluders", size=64, views=3)
    truth = light_field.ground_truth
    holed = truth.copy()
    holed[:20] = NAN
    one = np.ones(truth.shape, np.float32)
    estimate = truth + np.float32(0.1)
    estimate[30, 30] = NAN
    bars = {"sigma": 0.1 * one, "low": estimate - np.float32(0.2), "high": estimate + 0.1 * one}
    bars["low"][40:] = estimate[40:] - np.float32(0.05)
    bars["high"][30, 30], bars["low"][30, 30] = 9, -9
    maps = StageMaps(estimate, 0.95 * one, bars)
    for views in (1, 2):
        seen = replace(light_field, ground_truth=holed, positions=views * light_field.baselines)
        found = evaluation_of(seen, maps)
        whole = found.scores["paper"]["all"]
        assert whole.keys() >= ERROR_BAR_SCORES.keys()
        assert whole["coverage"] == pytest.approx(100 * (20 * 64 - 1) / (44 * 64))
        assert whole["width"] == pytest.approx(0.15)
        assert whole["nll"] == pytest.approx(-norm.logpdf(0.1, scale=0.1), rel=1e-4)
        # 0.28 and 0.14 pixels per view step, of which all errors are less
        assert whole["gap"] == pytest.approx(5, abs=0.1)
        assert found.scores["paper"]["occluded"]["pixels"] > 0
        rows = found.regions["occluded"][20:40] & np.isfinite(estimate[20:40])
        of_region = found.scores["paper"]["occluded"]
        assert of_region["coverage"] == pytest.approx(100 * rows.sum() / of_region["pixels"])
    farther = evaluation_of(replace(light_field, ground_truth=holed, positions=4 * light_field.baselines), maps)
    assert farther.scores["paper"]["all"]["gap"] == pytest.approx(95)
    plain = evaluation_of(replace(light_field, ground_truth=holed), estimate)
    assert not plain.scores["paper"]["all"].keys() & ERROR_BAR_SCORES.keys()
    assert plain.reliability is None


def test_without_known_pixels_scores_are_nan() -> None:
    nothing = np.full((4, 4), NAN, np.float32)
    flat = np.zeros((4, 4), np.float32)
    bars = ErrorBars.of(StageMaps(flat, flat, {"sigma": flat, "low": flat, "high": flat}), reach=4)
    scores = score(flat, nothing, bars=bars)
    assert all(np.isnan(scores[name]) for name in ERROR_BAR_SCORES)
