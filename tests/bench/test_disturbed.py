"""The bench of disturbed light fields, and what it is for: never a wrong word on the order of the views."""

import pytest

from bench.disturbed import DISTURBANCES, disturbed_verdicts
from sepi.scenes import render

pytestmark = pytest.mark.slow


@pytest.mark.parametrize("name", ["curved_occluders", "slanted_plane"])
def test_no_verdict_is_wrong(name: str) -> None:
    """A wrong word turns depth inside out, or makes nonsense of it."""
    turns = ["transpose-flip-rows"]
    found = dict(disturbed_verdicts(render(name, size=64, views=5), turns))
    assert list(found) == list(DISTURBANCES)
    assert not any(verdicts.orders["wrong"] for verdicts in found.values())
    assert all(sum(verdicts.orders.values()) == len(turns) for verdicts in found.values())
    told = sum(verdicts.orders["right"] for verdicts in found.values())
    assert (told > 6 * len(turns)) == (name == "curved_occluders")
    assert all(verdicts.row_spacing == 1 for verdicts in found.values())
