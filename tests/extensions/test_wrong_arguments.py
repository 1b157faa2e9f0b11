"""As tests/test_arguments.py, of what extensions add."""

from pathlib import Path

import pytest
from test_arguments import ONES, SCENE, VIEWS, call

import sepi
from sepi.extensions.benchmark.hci_submission import problems_of, write_submission

WRONG = {
    "views of an array": (lambda: sepi.estimate_all_views(VIEWS), "light field: expected a LightField"),  # type: ignore[arg-type]
    "focus on text": (lambda: sepi.refocus(SCENE, "a"), "dots: disparity to focus at .* got 'a'"),  # type: ignore[arg-type]
    "focus everywhere on an array": (call(sepi.all_in_focus, VIEWS, ONES), "light field: expected a LightField"),
    "focus everywhere by text": (call(sepi.all_in_focus, SCENE, "a"), "dots: map: expected an array of numbers"),
    "focus everywhere by complex": (call(sepi.all_in_focus, SCENE, ONES.astype(complex)), "dots: map: .* complex128"),
    "aperture of text": (call(sepi.refocus, SCENE, 0, aperture="a"), "dots: aperture: expected a radius"),
    "submission of numbers": (call(write_submission, "unwritten", 3), "unwritten: entries: expected scenes"),
    "submission from nowhere": (call(problems_of, None), "submission: expected a path"),
}


@pytest.mark.parametrize("wrong", WRONG)
def test_a_wrong_argument_is_told_in_one_line(wrong: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    make, message = WRONG[wrong]
    with pytest.raises(sepi.SepiError, match=message):
        make()
    assert not list(tmp_path.iterdir())
