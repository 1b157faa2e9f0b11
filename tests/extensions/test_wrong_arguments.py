"""As tests/test_arguments.py, of what extensions add."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from test_arguments import ONES, SCENE, Calls, exchanged, refused

import sepi
from sepi.extensions.benchmark.hci_submission import problems_of, write_submission

CALLS: Calls = [
    (sepi.estimate_all_views, {"light_field": SCENE}),
    (sepi.refocus, {"light_field": SCENE, "disparity": 0, "maps": ONES, "aperture": 1}),
    (sepi.all_in_focus, {"light_field": SCENE, "maps": ONES}),
    (write_submission, {"path": "unwritten", "entries": {}}),
    (problems_of, {"path": "unwritten"}),
]


@pytest.mark.parametrize(("function", "given", "name"), exchanged(CALLS))
def test_an_argument_of_another_type_is_told(
    function: Callable[..., object], given: dict[str, Any], name: str, here: Path
) -> None:
    refused(function, given, name, here)
