"""The numbers of the error bars make the errors likeliest, and say of other scenes what they say of these."""

import numpy as np
import pytest

from bench.error_model import as_code, fitted, judged, pooled
from bench.error_samples import Sample
from sepi.error_bars.calibration import CONSTANT, Calibration
from sepi.error_bars.cues import FLOORS

TRUE = Calibration(
    scale={CONSTANT: 1.0, "deviation": 0.8, "second_difference": 0.0, "few_views": 0.7},
    outlier_scale={CONSTANT: -0.7},
    outlier={CONSTANT: -3.0, "confidence": -1.0},
    rim={CONSTANT: -3.0},
)
FORM = Calibration(*(dict.fromkeys(part, 0.0) for part in TRUE))


def drawn(name: str, seed: int, pixels: int = 20_000) -> Sample:
    """Errors as the model of :data:`TRUE` has them."""
    rng = np.random.default_rng(seed)
    cues = {
        "deviation": np.exp(rng.uniform(-7, -2, pixels)),
        "second_difference": np.exp(rng.uniform(-8, -2, pixels)),
        "confidence": rng.uniform(0.05, 1, pixels),
        "few_views": rng.choice([1.02, 1.5, 2], pixels),
        "above": rng.uniform(0, 1, pixels),
        "below": np.zeros(pixels),
        "smooth_confidence": rng.uniform(0, 1, pixels),
    }
    scale = np.exp(1.0) * cues["deviation"] ** 0.8 * np.maximum(cues["few_views"], FLOORS["few_views"]) ** 0.7
    odds = np.stack([np.ones(pixels), np.exp(-3.0) / cues["confidence"], np.full(pixels, np.exp(-3.0))])
    chosen = (rng.uniform(size=pixels) * odds.sum(axis=0) > np.cumsum(odds, axis=0)).sum(axis=0)
    width = np.choose(chosen, [scale, np.full(pixels, np.exp(-0.7)), 0.2 * cues["above"] + 0.01])
    error = np.where(chosen == 2, cues["above"], 0.0) + width * rng.laplace(size=pixels)
    return Sample(name, name, "best", error, cues, 0.0)


def assert_close(found: Calibration, tolerance: float) -> None:
    for part, true in zip(found, TRUE, strict=True):
        assert part == pytest.approx(true, abs=tolerance)


def test_a_fit_finds_the_numbers_that_errors_were_drawn_with() -> None:
    """A cue that tells nothing gets no power, and nine of ten errors of another scene are held."""
    found = fitted([drawn("one", 0), drawn("another", 1)], FORM)
    assert_close(found, 0.15)
    other = drawn("a third", 2)
    assert 89 < judged(other, found).coverage < 91
    # of the tenth of the pixels whose confidence is off by most
    off, *_ = pooled([other], found)["`confidence` off by at most"].split()
    assert float(off) <= 0.03
    names = {"Calibration": Calibration, "CONSTANT": CONSTANT}
    exec(as_code("WRITTEN", found), names)
    assert names["WRITTEN"] == found


def test_a_cue_is_added_without_moving_what_it_rests_on() -> None:
    """Of few views alone: full light fields keep their bars to the last digit that is written."""
    constant = 1.0 + TRUE.scale["few_views"] * np.log(FLOORS["few_views"])
    before = TRUE._replace(scale=TRUE.scale | {CONSTANT: constant, "few_views": 0.0})
    found = fitted([drawn("one", 0)], before, ["few_views"])
    assert_close(found, 0.05)
    assert {**found.scale, CONSTANT: 1.0, "few_views": 0.7} == TRUE.scale
