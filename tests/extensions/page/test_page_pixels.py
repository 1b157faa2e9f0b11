"""What the method sees at single pixels, on the report's page in a real browser."""

import base64
from typing import Any

import numpy as np
import pytest
from browser import WIPE, part, place_of
from page_example import ASKED, COTTON, COTTON_TITLE, Example


def cotton_probes(example: Example) -> list[dict[str, Any]]:
    (scene,) = [scene for scene in example.scenes if scene["scene"] == "cotton"]
    probes: list[dict[str, Any]] = scene["probes"]
    return probes


def test_a_click_shows_the_nearest_prepared_pixel(page: Any, example: Example) -> None:
    probes = cotton_probes(example)
    for x, y in ((0, 63), (60, 10), (30, 40)):
        nearest = min(probes, key=lambda probe: np.hypot(probe["x"] - x, probe["y"] - y))
        page.mouse.click(*place_of(page, WIPE, x, y))
        page.wait_for_function(
            "(wanted) => document.getElementById('pixel').dataset.pixel === wanted",
            arg=f"{nearest['x']} {nearest['y']}",
        )
        asked = part(page, "asked")
        assert (f"[[{y}, {x}]]" in asked) == ((nearest["x"], nearest["y"]) != (x, y)), asked
        assert not asked or f"{COTTON_TITLE}: " in asked


def test_a_pixel_that_the_configuration_asks_for_comes_first(page: Any, example: Example) -> None:
    y, x = ASKED[COTTON]
    assert page.get_attribute("#pixel", "data-pixel") == f"{x} {y}"
    buttons = page.locator('[data-part="pixels"] button')
    assert buttons.all_text_contents()[0] == "1 asked for"
    facts = part(page, "facts")
    for variant in ("paper", "best"):
        assert f"chosen by {variant}{example.final(COTTON, variant).disparity[y, x]:.3f}" in facts
    interval = cotton_probes(example)[0]["interval"]
    assert "90 % interval of best{:.3f} … {:.3f}".format(*interval) in facts
    assert page.locator('[data-part="curves"] rect.interval').count() == 1
    ground_truth = example.light_field(COTTON).ground_truth
    assert f"ground truth{ground_truth[y, x]:.3f}" in facts


def test_the_curve_has_its_minimum_where_the_text_says(page: Any, example: Example) -> None:
    """Read back from the drawing: the lowest point of the curve over all views is at the candidate of least cost."""
    probe = cotton_probes(example)[0]
    points = page.get_attribute('[data-part="curves"] polyline.full', "points")
    places = np.array([[float(number) for number in point.split(",")] for point in points.split()])
    ticks = page.locator('[data-part="curves"] text').evaluate_all(
        "(all) => all.map((t) => [Number(t.getAttribute('x')), t.textContent])"
    )
    low, high = probe["range"]
    left, right = (next(x for x, text in ticks if text == f"{end:.2f}") for end in (low, high))
    lowest = places[places[:, 1].argmax(), 0]
    step = (high - low) / (len(places) - 1)
    assert low + (lowest - left) / (right - left) * (high - low) == pytest.approx(probe["minimum"], abs=2 * step)
    costs = np.frombuffer(base64.b64decode(probe["costs"]["full"]), "<u2")
    assert len(places) == len(costs)
