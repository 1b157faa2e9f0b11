"""The maps of the report's page in a real browser: slider, numbers under the cursor, close-ups, other scenes."""

from typing import Any

import numpy as np
import pytest
from browser import (
    CLOUD,
    WIPE,
    as_shown,
    border_is,
    canvas_pixels,
    changed_pixels,
    choose,
    map_pixels,
    part,
    place_of,
    point_at,
    read_out,
    show_scene,
)
from page_example import COTTON, DOTS_TITLE, PICTURE, PICTURE_TITLE, SIZE, UNKNOWN, Example

from sepi.matching.unknown import with_unknown
from sepi.report.pictures import disparity_limits, error_picture, map_picture

# pixels (x, y): corners, inside
PLACES = [(0, 0), (63, 63), (5, 50)]


def test_the_slider_wipes_between_two_maps(page: Any) -> None:
    """By the keyboard: one end shows B alone, the other A alone, between them the border lies where the slider is."""
    assert border_is(page, SIZE // 2)
    slider = page.locator('[data-part="slider"]')
    slider.focus()
    for key, border in (("Home", 0), ("PageUp", round(0.1 * SIZE)), ("End", SIZE)):
        page.keyboard.press(key)
        assert border_is(page, border), key
    page.keyboard.press("ArrowLeft")
    assert slider.input_value() == "999"
    assert page.get_attribute('[data-part="slider"]', "aria-valuetext") == "100 % of A"


def test_the_picture_itself_can_be_dragged(page: Any) -> None:
    """And a drag is no click: it chooses no pixel."""
    before = page.get_attribute("#pixel", "data-pixel")
    page.mouse.move(*place_of(page, WIPE, 30, 5))
    page.mouse.down()
    x, y = place_of(page, WIPE, 50, 5)
    page.mouse.move(x, y, steps=5)
    page.mouse.up()
    value = int(page.input_value('[data-part="slider"]'))
    assert abs(value / 1000 - 50.5 / SIZE) < 0.01
    assert border_is(page, round(value / 1000 * SIZE))
    line = page.locator('[data-part="line"]').bounding_box()
    assert abs(line["x"] + line["width"] / 2 - x) < 3
    page.mouse.move(*place_of(page, WIPE, 20, 10))
    assert page.input_value('[data-part="slider"]') == str(value), "the slider follows a released button"
    assert page.get_attribute("#pixel", "data-pixel") == before


def test_the_read_out_shows_the_values_of_the_files(same_page: Any, example: Example) -> None:
    """Three decimals of what the HDF5 files hold, at corners, edges and inside."""
    ground_truth = example.light_field(COTTON).ground_truth
    finals = {side: example.final(COTTON, variant) for side, variant in (("a", "paper"), ("b", "best"))}
    choose(same_page, a="paper/4_optimize", b="best/4_optimize")
    for x, y in PLACES:
        point_at(same_page, x, y)
        shown = read_out(same_page)
        for side, maps in finals.items():
            value = float(shown[f"value {side}"])
            assert value == as_shown(maps.disparity[y, x]), (x, y, side)
            assert abs(float(shown[f"confidence {side}"]) - maps.confidence[y, x]) <= 0.0051
            if np.isfinite(ground_truth[y, x]):
                assert float(shown["ground_truth"]) == as_shown(ground_truth[y, x])
                error = float(shown[f"error {side}"])
                assert error == pytest.approx(value - as_shown(ground_truth[y, x]), abs=1e-6)
            else:
                assert (shown["ground_truth"], shown[f"error {side}"]) == ("unknown", "unknown")
    assert not np.isfinite(ground_truth[0, 0])


def test_the_read_out_of_other_maps_is_right_within_their_step(same_page: Any, example: Example) -> None:
    """Stages on the way, confidence as a map, another method's map; what it does not know is called unknown."""
    step = next(scene for scene in example.scenes if scene["scene"] == "cotton")["arrays"]
    panels = {panel["key"]: panel for panel in same_page.evaluate("Sepi.viewer.scene.panels")}
    maps = {
        "paper/1_initial": example.stage(COTTON, "paper", "initial").disparity,
        "best/2_occlusion": example.stage(COTTON, "best", "occlusion").disparity,
        "best/confidence": example.final(COTTON, "best").confidence,
        "external/SPO/disparity": example.external,
    }
    for key, values in maps.items():
        choose(same_page, a=key)
        half = step[panels[key]["map"]]["step"] / 2
        # as many decimals as the step has
        slack = half + (0.0005 if half < 0.005 else 0.005) + 1e-6
        for x, y in PLACES:
            point_at(same_page, x, y)
            assert abs(float(read_out(same_page)["value a"]) - values[y, x]) <= slack, (key, x, y)
    point_at(same_page, UNKNOWN[1].start, UNKNOWN[0].start)
    assert (read_out(same_page)["value a"], read_out(same_page)["error a"]) == ("unknown", "unknown")


def test_the_read_out_shows_the_interval(same_page: Any, example: Example) -> None:
    """As the files hold it, within the steps of 12 % that the page keeps its widths in; a map without one says so."""
    maps = with_unknown(example.light_field(COTTON), example.final(COTTON, "best"))
    reaches = maps.high - maps.disparity, maps.disparity - maps.low
    row, column = np.unravel_index(np.abs(reaches[0] - reaches[1]).argmax(), maps.low.shape)
    for other in ("external/SPO/disparity", "paper/1_initial", "best/sigma"):
        choose(same_page, a="best/4_optimize", b=other)
        for x, y in (*PLACES, (int(column), int(row))):
            point_at(same_page, x, y)
            shown = read_out(same_page)
            low, high = map(float, shown["interval a"].split(" … "))
            # from what the page has for the value, which is kept in steps, too
            value, own = float(shown["value a"]), maps.disparity[y, x]
            # half a step of a logarithm is 6 %, of two 12 %, and the ends are shown to three decimals; two digits of
            # sigma are another 5 %
            for shown_reach, reach in ((value - low, own - maps.low[y, x]), (high - value, maps.high[y, x] - own)):
                assert abs(shown_reach - reach) <= 0.125 * reach + 0.0006
            assert float(shown["sigma a"]) == pytest.approx(maps.sigma[y, x], rel=0.12)
            assert shown["sigma b"] == "–"
            if other == "best/sigma":
                assert (shown["value b"], shown["interval b"]) == (shown["sigma a"], "–")
            else:
                assert shown["interval b"] == "no interval"
    legends = part(same_page, "legends")
    assert "sure 0.001" in legends
    assert "1 unsure" in legends


def test_maps_have_the_colours_of_the_figures(same_page: Any, example: Example) -> None:
    """A page and a paper must not disagree: viridis, the scene's limits, magenta for unknown."""
    light_field = example.light_field(COTTON)
    limits = disparity_limits(light_field)
    expected = map_picture(example.external, limits).astype(int)
    shown = map_pixels(same_page, "external/SPO/disparity")[:, :, :3].astype(int)
    assert (shown[UNKNOWN] == (255, 0, 255)).all()
    assert np.abs(shown - expected).max() <= 6
    best = example.final(COTTON, "best").disparity
    error = error_picture(best - light_field.ground_truth).astype(int)
    assert np.abs(map_pixels(same_page, "best/error")[:, :, :3] - error).max() <= 6


def test_the_reference_view_is_the_picture(same_page: Any, example: Example) -> None:
    """Compressed, but upright, not mirrored, its colours in order."""
    light_field = example.light_field(COTTON)
    shown = map_pixels(same_page, "reference_view")[:, :, :3].astype(int)
    off = shown - light_field.views[light_field.reference_position]
    assert np.abs(off.mean(axis=2)).mean() < 5
    assert np.abs(off.mean(axis=(0, 1))).max() < 4
    mask = light_field.masks["occluded"]
    over = map_pixels(same_page, "occluded_ground_truth")[:, :, :3].astype(int)
    assert (over[mask][:, 0] > over[mask][:, 2] + 60).all()
    assert (np.abs(over[~mask] - shown[~mask] / 2) <= 1).all()


def test_another_scene_changes_everything(page: Any, example: Example) -> None:
    page.locator(CLOUD).scroll_into_view_if_needed()
    page.wait_for_selector(f"{CLOUD}[data-points]")
    cloud, picture = canvas_pixels(page, CLOUD), canvas_pixels(page, WIPE)
    choose(page, b="paper/4_optimize")
    show_scene(page, DOTS_TITLE)
    changed_pixels(page, CLOUD, cloud)
    assert (canvas_pixels(page, WIPE) != picture).any()
    assert page.input_value('[data-part="b"]') == "paper/4_optimize", "the map that was looked at stays chosen"
    assert part(page, "pixels").startswith("1 textured and sure")
    assert page.locator('[data-part="b"] option[value="external/SPO/disparity"]').count() == 0
    point_at(page, 20, 44)
    assert float(read_out(page)["value b"]) == as_shown(example.final(("builtin", "dots"), "paper").disparity[44, 20])
    page.click("#next")
    page.click("#next")
    page.wait_for_function("() => Sepi.viewer.shown && Sepi.viewer.scene.scene === 'picture'")
    page.click("#next")
    page.wait_for_function("() => Sepi.viewer.shown && Sepi.viewer.scene.scene === 'dots'")


def test_a_scene_without_truth(page: Any, example: Example) -> None:
    """Maps and numbers, but neither truth nor errors."""
    show_scene(page, PICTURE_TITLE)
    keys = page.locator('[data-part="a"] option').evaluate_all("(all) => all.map((o) => o.value)")
    assert "best/4_optimize" in keys
    assert not [key for key in keys if "error" in key or "ground_truth" in key or "change" in key]
    choose(page, a="best/4_optimize")
    point_at(page, 33, 12)
    shown = read_out(page)
    assert float(shown["value a"]) == as_shown(example.final(PICTURE, "best").disparity[12, 33])
    assert (shown["ground_truth"], shown["error a"]) == ("–", "–")
    assert "ground truthunknown" in part(page, "facts")
    assert page.locator("#changes canvas").count() == 0
