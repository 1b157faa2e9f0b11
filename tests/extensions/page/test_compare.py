"""`sepi compare`: two maps beside each other on a page, in a real browser; what is wrong with a map, in a line."""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from browser import canvas_pixels, choose, map_pixels, opened, part, point_at, read_out, settled
from error_lines import call, done, error_of

from sepi.extensions.page.compare import Comparison, comparison_page
from sepi.io.disparity_maps import write_pfm
from sepi.io.hdf5 import write_stage
from sepi.lightfield import FloatMap
from sepi.scenes import render, write_hci
from sepi.scoring.scores import score
from sepi.stage import StageMaps

SHAPE = (40, 60)
CLOUD = '[data-part="cloud"]'


def maps() -> tuple[FloatMap, FloatMap, FloatMap]:
    """Two maps that are easily told apart, with unknown pixels, and the ground truth."""
    random = np.random.default_rng(2)
    y, x = np.indices(SHAPE)
    ground_truth = np.sin(x / 9) + y / 30
    a = ground_truth + random.normal(0, 0.05, SHAPE)
    b = ground_truth[:, ::-1] + 0.02
    a[5:9, 7:20] = np.nan
    found = [np.asarray(values, np.float32) for values in (a, b, ground_truth)]
    return found[0], found[1], found[2]


def written(folder: Path) -> list[Path]:
    """The maps as PFM: ours, other, truth."""
    paths = [folder / f"{name}.pfm" for name in ("ours", "other", "ground_truth")]
    for path, values in zip(paths, maps(), strict=True):
        write_pfm(path, values)
    return paths


@pytest.fixture
def files(tmp_path: Path) -> list[Path]:
    return written(tmp_path)


@pytest.fixture(scope="module", params=["ground_truth", "no truth"])
def page(request: pytest.FixtureRequest, browser: Any, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    """The page of two maps, with and without their truth, as the tests before have left it."""
    output = tmp_path_factory.mktemp("page") / "page.html"
    words = written(output.parent)[: 3 if request.param == "ground_truth" else 2]
    assert call("compare", *words, "-o", output).exit_code == 0
    with opened(browser, output, color_scheme="light") as found:
        yield found


def test_the_read_out_shows_the_values_of_the_files(page: Any) -> None:
    """To three decimals; differences and errors are those of what is shown."""
    ours, other, ground_truth = maps()
    with_truth = page.locator('[data-part="a"] option[value="ground_truth"]').count() == 1
    for x, y in ((0, 0), (59, 39), (31, 20), (10, 6)):
        choose(page, a="a", b="b")
        point_at(page, x, y)
        shown = read_out(page)
        for side, values in (("a", ours), ("b", other)):
            if np.isnan(values[y, x]):
                assert shown[f"value {side}"] == "unknown"
                continue
            value = float(shown[f"value {side}"])
            assert value == float(f"{values[y, x]:.3f}")
            if with_truth:
                assert float(shown["ground_truth"]) == float(f"{ground_truth[y, x]:.3f}")
                assert float(shown[f"error {side}"]) == pytest.approx(value - float(shown["ground_truth"]), abs=1e-6)
            else:
                assert (shown["ground_truth"], shown[f"error {side}"]) == ("–", "–")
        choose(page, b="difference")
        difference = read_out(page)["value b"]
        if np.isnan(ours[y, x]):
            assert difference == "unknown"
        else:
            expected = float(f"{ours[y, x]:.3f}") - float(f"{other[y, x]:.3f}")
            assert float(difference) == pytest.approx(expected, abs=1e-6)


@pytest.mark.parametrize("page", ["ground_truth"], indirect=True)
def test_which_map_is_nearer_to_the_truth(page: Any) -> None:
    """Red where A is, blue where B is."""
    ours, other, ground_truth = maps()
    nearer = np.abs(other - ground_truth) - np.abs(ours - ground_truth)
    shown = map_pixels(page, "change").astype(int)
    assert (shown[nearer > 0.1][:, 0] > shown[nearer > 0.1][:, 2]).all()
    assert (shown[nearer < -0.04][:, 0] < shown[nearer < -0.04][:, 2]).all()
    assert (shown[np.isnan(nearer)][:, :3] == (255, 0, 255)).all()
    # ... and its legend says so of A
    choose(page, a="change", b="change")
    legend = page.locator('[data-part="legends"] .legend').first
    colours = re.findall(r"rgb\((\d+), \d+, (\d+)\)", legend.locator(".bar").get_attribute("style"))
    (low_red, low_blue), (high_red, high_blue) = (map(int, colours[end]) for end in (0, -1))
    assert low_red < low_blue
    assert high_red > high_blue
    assert re.match(r"less accurate -.* more accurate$", legend.text_content())


def test_a_point_cloud_without_a_picture(page: Any) -> None:
    """Coloured by disparity, since there is no view; it turns."""
    page.locator(CLOUD).scroll_into_view_if_needed()
    page.wait_for_selector(f"{CLOUD}[data-points]")
    settled(page)
    assert page.input_value('[data-part="cloud-colours"]') == "disparity"
    assert page.locator('[data-part="cloud-colours"] option[value="view"]').is_disabled()
    before = canvas_pixels(page, CLOUD)
    assert len(np.unique(before.reshape(-1, 4), axis=0)) > 20
    page.press(CLOUD, "ArrowLeft")
    settled(page)
    assert (canvas_pixels(page, CLOUD) != before).any()


def test_a_scene_brings_its_view_its_truth_and_its_regions(browser: Any, tmp_path: Path) -> None:
    light_field = render("dots", size=64, views=3)
    write_hci(light_field, tmp_path / "scene")
    for number, name in enumerate(("one", "two")):
        write_pfm(tmp_path / f"{name}.pfm", light_field.ground_truth + np.float32(0.04 * number))
    output = tmp_path / "page.html"
    result = done("compare", tmp_path / "one.pfm", tmp_path / "two.pfm", tmp_path / "scene", "-o", output)
    assert "occluded" in result.stdout
    with opened(browser, output) as page:
        choose(page, a="reference_view", b="b/error")
        # compressed: colours are coarser than brightness
        off = map_pixels(page, "reference_view")[:, :, :3].astype(int) - light_field.views[1, 1]
        assert np.abs(off.mean(axis=2)).mean() < 5
        assert np.abs(off.mean(axis=(0, 1))).max() < 4
        point_at(page, 30, 12)
        assert float(read_out(page)["value b"]) == pytest.approx(0.04, abs=0.0011)
        rows = page.locator("table.sortable tbody tr").all_text_contents()
        assert len(rows) == 8
        assert any("occluded" in row for row in rows)
        page.locator(CLOUD).scroll_into_view_if_needed()
        page.wait_for_selector(f"{CLOUD}[data-points]")
        assert "metric" in part(page, "cloud-note")


def test_scores_are_printed_and_on_the_page(files: list[Path], tmp_path: Path) -> None:
    """Those of sepi.evaluate, by both protocols; the better one is marked."""
    ours, other, ground_truth = maps()
    output = tmp_path / "page.html"
    result = call("compare", *files, "-o", output)
    assert result.stdout.rstrip().endswith(f"written: {output}")
    page = output.read_text()
    for values, name in ((ours, "ours.pfm"), (other, "other.pfm")):
        expected = score(values, ground_truth, 0, None)
        assert f"{expected['mse100']:.3f}" in page
        assert name in result.stdout
    found = Comparison(("x", "y"), (ours, other), ground_truth).scores
    assert found["x"]["paper"]["all"] == pytest.approx(score(ours, ground_truth, 0, None), nan_ok=True)
    assert page.count('class="best"') >= 2
    assert Comparison(("x", "y"), (ours, other)).scores == {}
    # without ground truth there is nothing to score
    assert "<td" not in comparison_page(Comparison(("x", "y"), (ours, other))).split('class="viewer"')[0]


def test_names_are_no_markup(browser: Any, tmp_path: Path) -> None:
    ours, other, ground_truth = maps()
    attack = "<img src=x onerror=hacked()><script>hacked()<!-- & \"q\" 'r' </script>"
    page_file = tmp_path / "page.html"
    page_file.write_text(comparison_page(Comparison((attack, "b"), (ours, other), ground_truth)), encoding="utf-8")
    with opened(browser, page_file) as page:
        assert page.text_content("h1") == f"{attack} beside b"
        assert page.title() == f"{attack} beside b"
        assert page.locator("img[src=x]").count() == 0
        assert attack in part(page, "legends")


def test_maps_without_a_single_known_pixel(browser: Any, tmp_path: Path) -> None:
    """Nothing to see, but a page, and no error."""
    nothing = np.full(SHAPE, np.nan, np.float32)
    page_file = tmp_path / "page.html"
    page_file.write_text(comparison_page(Comparison(("a", "b"), (nothing, nothing))), encoding="utf-8")
    with opened(browser, page_file) as page:
        point_at(page, 3, 4)
        assert read_out(page)["value a"] == "unknown"
        page.locator(CLOUD).scroll_into_view_if_needed()
        page.wait_for_selector(f'{CLOUD}[data-points="0"]')


def test_maps_of_different_sizes_are_refused(files: list[Path], tmp_path: Path) -> None:
    write_pfm(tmp_path / "small.pfm", np.zeros((4, 5), np.float32))
    output = tmp_path / "page.html"
    line = error_of(call("compare", files[0], tmp_path / "small.pfm", "-o", output))
    assert line == f"sepi: {tmp_path / 'small.pfm'}: is (4, 5), but {files[0]} is (40, 60) (height, width)"
    line = error_of(call("compare", files[0], files[1], tmp_path / "small.pfm", "-o", output))
    assert line.startswith(f"sepi: {tmp_path / 'small.pfm'}: is (4, 5)")
    write_hci(render("dots", size=64, views=2), tmp_path / "scene")
    line = error_of(call("compare", files[0], files[1], tmp_path / "scene", "-o", output))
    assert "(64, 64)" in line
    assert not output.exists()


def test_maps_of_different_views_are_refused(tmp_path: Path) -> None:
    """Results say which view they belong to; wiping between two views would mislead."""
    ours, other, _ = maps()
    for name, values, view in (("one", ours, (1, 1)), ("two", other, (0, 1))):
        attributes = {"view_position": view, "grid": (3, 3)}
        write_stage(tmp_path / f"{name}.h5", StageMaps(values, np.ones(SHAPE, np.float32)), attributes)
    line = error_of(call("compare", tmp_path / "one.h5", tmp_path / "two.h5", "-o", tmp_path / "page.html"))
    assert "depth of another view" in line
    assert not (tmp_path / "page.html").exists()
