"""What error bars keep to, whatever the cues."""

import numpy as np
import pytest

from sepi.error_bars.bars import error_bars
from sepi.error_bars.calibration import SECOND_ORDER, WLS, Calibration
from sepi.error_bars.cues import FLOORS
from sepi.lightfield import DisparityRange


@pytest.mark.parametrize("calibration", [SECOND_ORDER, WLS])
@pytest.mark.parametrize("value", [0.0, 0.1, 1e6])
def test_an_unsure_pixel_lies_in_the_range_and_its_interval_holds_it(calibration: Calibration, value: float) -> None:
    """Where cues are as bad or as good as they can be, too: no depth beyond the range, no bound that is no number."""
    disparity = np.linspace(-1, 1, 30, dtype=np.float32).reshape(5, 6)
    cues = {name: np.full_like(disparity, value) for name in FLOORS}
    cues |= {"above": np.full_like(disparity, 3), "below": np.full_like(disparity, 2)}
    bars = error_bars(disparity, cues, DisparityRange(-1, 1, "given"), calibration)
    assert np.isfinite(list(bars.values())).all()
    low, high, confidence = bars["low"], bars["high"], bars["confidence"]
    assert ((low >= -1) & (low <= disparity) & (disparity <= high) & (high <= 1)).all()
    assert ((confidence >= 0) & (confidence <= 1)).all()
