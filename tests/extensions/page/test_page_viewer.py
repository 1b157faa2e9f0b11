"""The maps of the report's page in a real browser: slider, numbers under the cursor, close-ups, other scenes."""

from itertools import product
from typing import Any

import cv2
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
    settled,
    show_scene,
)
from page_example import COTTON, DOTS_TITLE, PICTURE, PICTURE_TITLE, SIZE, UNKNOWN, Example

from sepi.matching.unknown import with_unknown
from sepi.report.pictures import disparity_limits, error_picture, map_picture

# pixels (x, y): corners, inside
PLACES = [(0, 0), (63, 63), (5, 50)]


def tile(key: str) -> str:
    return f'figure[data-key="{key}"] canvas'


def visible_tile(page: Any, key: str) -> str:
    """Selector of a small panel, once it is in sight and drawn."""
    page.locator(tile(key)).scroll_into_view_if_needed()
    page.wait_for_function("(selector) => document.querySelector(selector).width > 10", arg=tile(key))
    settled(page)
    return tile(key)


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


def test_swapping_and_choosing(page: Any) -> None:
    page.click('[data-part="swap"]')
    page.wait_for_selector('#viewer[data-shown="best/4_optimize reference_view"]')
    assert border_is(page, SIZE // 2)
    figure = page.locator('figure[data-key="paper/1_initial"]')
    figure.get_by_role("button", name="as B").click()
    page.wait_for_selector('#viewer[data-shown="best/4_optimize paper/1_initial"]')
    assert border_is(page, SIZE // 2)
    assert "paper" in part(page, "legends")


def test_the_read_out_shows_the_values_of_the_files(same_page: Any, example: Example) -> None:
    """Three decimals of what the HDF5 files hold, at corners, edges and inside."""
    ground_truth = example.light_field(COTTON).ground_truth
    assert ground_truth is not None
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


def test_the_read_out_of_truth_and_errors(same_page: Any, example: Example) -> None:
    light_field = example.light_field(COTTON)
    assert light_field.ground_truth is not None
    choose(same_page, a="ground_truth", b="best/error")
    for x, y in PLACES[1:]:
        point_at(same_page, x, y)
        ground_truth = as_shown(light_field.ground_truth[y, x])
        estimate = as_shown(example.final(COTTON, "best").disparity[y, x])
        shown = read_out(same_page)
        assert float(shown["value a"]) == ground_truth
        assert float(shown["value b"]) == pytest.approx(estimate - ground_truth, abs=1e-6)
        assert shown["error a"] == "–"


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
    assert maps.sigma is not None
    assert maps.low is not None
    assert maps.high is not None
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


def test_pictures_have_no_numbers(same_page: Any) -> None:
    choose(same_page, a="reference_view", b="occluded_ground_truth")
    point_at(same_page, 10, 10)
    shown = read_out(same_page)
    names = ("value", "error", "confidence", "sigma", "interval")
    assert {shown[f"{name} {side}"] for name in names for side in "ab"} == {"–"}


def test_every_panel_of_the_grid_reads_out(same_page: Any, example: Example) -> None:
    """The cursor over a small panel is the cursor everywhere."""
    choose(same_page, b="best/4_optimize")
    for key in ("ground_truth", "paper/1_initial"):
        selector = visible_tile(same_page, key)
        for x, y in ((12, 40), (55, 20)):
            point_at(same_page, x, y, selector)
            value = example.final(COTTON, "best").disparity[y, x]
            assert float(read_out(same_page)["value b"]) == as_shown(value)


def test_the_cursor_moves_by_the_keyboard(page: Any, example: Example) -> None:
    page.locator(WIPE).focus()
    for key, expected in (("ArrowRight", (33, 32)), ("ArrowUp", (33, 31)), ("Shift+ArrowLeft", (23, 31))):
        page.keyboard.press(key)
        settled(page)
        assert read_out(page)["pixel"] == "x {}, y {}".format(*expected)
    for _ in range(5):
        page.keyboard.press("Shift+ArrowLeft")
    settled(page)
    assert read_out(page)["pixel"] == "x 0, y 31", "the cursor must stay in the picture"
    assert float(read_out(page)["value b"]) == as_shown(example.final(COTTON, "best").disparity[31, 0])


def test_legends_have_the_scale_of_the_scene(same_page: Any, example: Example) -> None:
    ground_truth = example.light_field(COTTON).ground_truth
    assert ground_truth is not None
    choose(same_page, a="reference_view", b="best/4_optimize")
    legends = part(same_page, "legends")
    assert f"{np.nanmin(ground_truth):.2f}" in legends
    assert f"{np.nanmax(ground_truth):.2f}" in legends
    choose(same_page, a="paper/error")
    assert "-0.20" in part(same_page, "legends")
    assert "MSE" in part(same_page, "legends")


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


def magnified(picture: Any, x: int, y: int, side: int, reach: int = 20) -> Any:
    """The surroundings of a pixel in a square of canvas pixels; grey outside the picture."""
    places = np.floor((np.arange(side) + 0.5) * (2 * reach + 1) / side).astype(int) - reach
    rows, columns = places[:, None] + y, places[None, :] + x
    inside = (rows >= 0) & (rows < picture.shape[0]) & (columns >= 0) & (columns < picture.shape[1])
    found = picture[rows.clip(0, picture.shape[0] - 1), columns.clip(0, picture.shape[1] - 1), :3]
    return np.where(inside[:, :, None], found, 128)


def test_close_ups_in_all_panels_follow_the_cursor(page: Any) -> None:
    """In a lower corner of each panel, the one that is farther away from the cursor."""
    keys = ("ground_truth", "best/3_textureless")
    page.locator(tile(keys[1])).scroll_into_view_if_needed()
    for key in keys:
        visible_tile(page, key)
    point_at(page, 32, 20, tile(keys[1]))
    before = {key: canvas_pixels(page, tile(key)) for key in keys}
    for (x, y), key in product([(12, 30), (50, 8)], keys):
        point_at(page, x, y, tile(keys[1]))
        settled(page)
        now = canvas_pixels(page, tile(key))
        assert (now != before[key]).any(), key
        height, width = now.shape[:2]
        side = round(0.46 * min(width, height))
        left = width - side if x < SIZE // 2 else 0
        seen = now[height - side :, left : left + side, :3].astype(int)
        wanted = magnified(map_pixels(page, key), x, y, side).astype(int)
        # pixels at the borders of cells, the frame and the mark of the cursor may differ
        assert (np.abs(seen - wanted).max(axis=2) < 12).mean() > 0.8, key
    # without close-ups the corner shows what the panel shows there
    page.uncheck('[data-part="close-ups"]')
    plain = canvas_pixels(page, visible_tile(page, key))[height - side :, left : left + side, :3].astype(int)
    whole = cv2.resize(map_pixels(page, key), (width, height), interpolation=cv2.INTER_NEAREST)
    corner = whole[height - side :, left : left + side, :3].astype(int)
    assert (np.abs(plain - corner).max(axis=2) < 12).mean() > 0.8
    assert (np.abs(plain - seen).max(axis=2) < 12).mean() < 0.8


def test_the_large_close_ups_follow_the_cursor(same_page: Any) -> None:
    choose(same_page, a="ground_truth", b="paper/4_optimize")
    for x, y in ((10, 12), (60, 40)):
        point_at(same_page, x, y)
        for side, key in (("a", "ground_truth"), ("b", "paper/4_optimize")):
            seen = canvas_pixels(same_page, f'[data-part="close-{side}"]')[:, :, :3].astype(int)
            wanted = magnified(map_pixels(same_page, key), x, y, len(seen)).astype(int)
            assert (np.abs(seen - wanted).max(axis=2) < 12).mean() > 0.95


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


def test_what_an_earlier_scene_began_is_not_shown(page: Any) -> None:
    """A slow scene, left before it is there, must not appear over the one that was chosen after it."""
    page.evaluate(
        """() => {
          const quick = Sepi.unpack;
          const held = new Promise((done) => { window.release = done; });
          Sepi.unpack = async (...given) => {
            const late = window.slow;
            if (late) await held;
            const found = await quick(...given);
            if (late) window.late = true;
            return found;
          };
        }"""
    )
    page.locator(WIPE).scroll_into_view_if_needed()
    page.evaluate("window.slow = true")
    page.select_option("#scene", label=DOTS_TITLE)
    # a pointer that moves meanwhile finds nothing to read
    page.mouse.move(*place_of(page, WIPE, 10, 10))
    page.mouse.move(*place_of(page, WIPE, 30, 30))
    settled(page)
    assert read_out(page)["pixel"] != "x 30, y 30", "numbers of the scene before"
    page.evaluate("window.slow = false")
    page.select_option("#scene", label=PICTURE_TITLE)
    page.wait_for_function("() => Sepi.viewer.shown")
    page.evaluate("window.release()")
    page.wait_for_function("() => window.late")
    settled(page)
    assert page.evaluate("Sepi.viewer.scene.scene") == "picture"
    assert border_is(page, SIZE // 2)
    selector = visible_tile(page, "best/1_initial")
    seen = cv2.resize(canvas_pixels(page, selector), (SIZE, SIZE), interpolation=cv2.INTER_AREA)
    wanted = map_pixels(page, "best/1_initial")
    top = slice(0, SIZE // 3)
    assert (np.abs(seen[top].astype(int) - wanted[top].astype(int)).max(axis=2) < 40).mean() > 0.8
    point_at(page, 12, 40)
    assert read_out(page)["ground_truth"] == "–"
