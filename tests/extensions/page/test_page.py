"""The page of the report: what it holds, how large it is, and the figures beside its tables."""

import base64
import copy
import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt
import pandas as pd
import pytest
from click.testing import CliRunner
from error_lines import done
from page_example import COTTON, DOTS, PICTURE, Example

from sepi.extensions.page import page
from sepi.extensions.page.page import embedded, prose
from sepi.extensions.page.scene import page_json
from sepi.extensions.page.viewer import OTHER, PRECISE, STEPS, viewer_json
from sepi.io.scores import Evaluation
from sepi.lightfield import FloatMap, LightField
from sepi.report import charts, figures, published
from sepi.report.panels import Kind, Panel, SceneResults, panels_of
from sepi.report.runs import Runs
from sepi.scoring.scores import REGIONS

LARGEST_PAGE = 20_000_000
"""Bytes that a page of ten scenes of 512x512 may have."""

SCALE = (-1.0, 1.0)


def panel(number: int, values: Any, kind: Kind = "disparity", **more: Any) -> Panel:
    return Panel(f"panel {number}", "title", "group", kind, values, **more)


def some_map(seed: int, shape: tuple[int, int] = (20, 30)) -> FloatMap:
    return np.random.default_rng(seed).uniform(-1, 1, shape).astype(np.float32)


def a_light_field(picture: npt.NDArray[np.uint8]) -> LightField:
    """One whose views are all this picture."""
    return LightField(np.stack([[picture, picture]]), "views")


def decoded(picture: str) -> npt.NDArray[np.uint8]:
    """The RGB picture that an address holds."""
    assert picture.startswith("data:image/webp;base64,")
    data = np.frombuffer(base64.b64decode(picture.split(",")[1]), np.uint8)
    return cv2.imdecode(data, cv2.IMREAD_COLOR)[:, :, ::-1]


def test_equal_maps_are_kept_once() -> None:
    """Panels that show one map share its array; a map and a mask of equal values are two, read in different steps."""
    ones = np.ones((20, 30), np.float32)
    maps = [panel(number, some_map(seed)) for number, seed in enumerate((0, 1, 0))]
    found = viewer_json([*maps, panel(3, ones), panel(4, ones > 0, "mask"), panel(5, ones)], SCALE)
    assert [entry["map"] for entry in found["panels"]] == [0, 1, 0, 2, 3, 2]
    assert [array["step"] for array in found["arrays"]] == [STEPS[0][OTHER]] * 3 + [1]


@pytest.mark.parametrize("order", [(0, 1, 2), (2, 1, 0), (1, 0, 2)])
def test_an_equal_map_is_kept_as_finely_as_the_finest_panel_wants(order: tuple[int, ...]) -> None:
    """A variant that switches nothing off has the final map of another: its read-out must stay exact."""
    values = some_map(0)
    panels = [panel(0, values), panel(1, values, precise=True), panel(2, values, "confidence")]
    (array,) = viewer_json([panels[number] for number in order], SCALE)["arrays"]
    assert array["step"] == STEPS[0][PRECISE]


def test_large_pictures_are_thinned_out() -> None:
    """Every other row and column of a picture of 1500x1500, which a phone could not hold in thirty maps."""
    shape = (1501, 1500)
    y, x = np.indices(shape)
    panels = [panel(0, (x / 500).astype(np.float32), precise=True), panel(1, y < 700, "mask")]
    found = viewer_json(panels, SCALE, a_light_field(np.full((*shape, 3), 90, np.uint8)))
    assert (found["stride"], found["height"], found["width"]) == (2, 751, 750)
    assert decoded(found["picture"]).shape == (751, 750, 3)
    assert viewer_json([panel(0, np.zeros((1024, 1024), bool), "mask")], SCALE)["stride"] == 1


def test_ten_noisy_scenes_stay_below_20_megabytes(example: Example) -> None:
    """Steps grow until a scene keeps its share; ten of them and the page fit."""
    shape = (512, 512)

    def noisy(seed: int) -> FloatMap:
        return cv2.GaussianBlur(some_map(seed, shape), (0, 0), 6) * 18 + np.float32(0.01) * some_map(seed + 100, shape)

    panels = [panel(number, noisy(number), precise=number < 3) for number in range(19)]
    panels += [panel(19 + number, noisy(number) > 0, "mask") for number in range(6)]
    picture = np.random.default_rng(0).integers(0, 256, (*shape, 3), np.uint8)
    scene = len(json.dumps(viewer_json(panels, SCALE, a_light_field(picture))))
    probes = max(len(json.dumps(found["probes"])) for found in example.scenes)
    rest = example.page.stat().st_size - sum(len(json.dumps(found)) for found in example.scenes)
    assert rest < 600_000
    assert 10 * (scene + probes) + rest < LARGEST_PAGE


def test_the_view_of_the_camera_is_handed_on(example: Example) -> None:
    """A cloud of a view beside the centre must not be sheared."""
    light_field = example.light_field(COTTON)
    moved = replace(light_field, view=(0, 3))
    maps = {name: {"optimize": example.final(COTTON, name)} for name in ("best", "paper")}
    results = SceneResults(moved, maps, {name: Evaluation() for name in maps}, ["best", "paper"])
    truthless = replace(results, light_field=replace(moved, ground_truth=None))
    camera = page_json(truthless, panels_of(truthless), *COTTON, [])["camera"]
    assert camera == {
        "scale": light_field.camera.scale,
        "offset": light_field.camera.offset,
        "focal": light_field.camera.focal_px,
        "from_centre": [-2, 1],
    }


def test_the_page_says_what_it_is_about(example: Example) -> None:
    """Datasets, variants, protocols, versions, machine, date, and total time; inputs with checksums, parameters."""
    text = re.sub(r"<wbr>", "", example.page.read_text(encoding="utf-8"))
    made = example.numbers.facts["made"]
    for expected in (made["date"], *(made["machines"][0][key] for key in ("sepi", "processor", "numpy"))):
        assert str(expected) in text
    for scene in example.numbers.facts["scenes"]:
        assert scene["light_field"]["sha256"] in text
        assert f"{scene['dataset']}/{scene['scene']}" in text
    # two variants of four stages of 1.5 to 4.5 s on three scenes
    assert f"<b>{3 * 2 * (1.5 + 2.5 + 3.5 + 4.5):.0f} s</b>" in text
    assert "leaves out 15 pixels on each side" in text
    for name in ("window_radius", "num_disparities"):
        assert f"<dt>{name}</dt>" in text
    assert "7x5 instead of 64x64" in text
    (cameras,) = re.findall(r'<svg class="standing".*?</svg>', text, re.DOTALL)
    assert "25 cameras, 4.0 view steps across and 4.0 down" in cameras
    assert cameras.count("<circle") == 25
    assert cameras.count('cx="0.0000" cy="0.0000"') == cameras.count('class="reference"') == 1


def test_json_in_the_page_cannot_end_its_script() -> None:
    value = {"</script><!--": "<b>&\"'\u2028", "x": [1, None]}
    text = str(embedded(value))
    assert "<" not in text
    assert json.loads(text) == value
    assert str(prose("a `b` <c> `d<e`")) == "a <code>b</code> &lt;c&gt; <code>d&lt;e</code>"


def run_page(folder: Path, example: Example) -> Any:
    words = ["--numbers", example.page.with_name("report.json"), "--output", folder / "index.html", "--scenes", folder]
    return CliRunner().invoke(page.command, list(map(str, words)), catch_exceptions=False)


def test_the_command_writes_the_same_page(example: Example, tmp_path: Path) -> None:
    for scene in example.scenes:
        path = tmp_path / scene["dataset"] / f"{scene['scene']}.json"
        path.parent.mkdir(exist_ok=True)
        path.write_text(json.dumps(scene))
    result = run_page(tmp_path, example)
    assert (result.exit_code, result.output) == (0, "")
    assert (tmp_path / "index.html").read_bytes() == example.page.read_bytes()


def test_pictures_and_the_scene_for_the_page_come_from_one_command(example: Example, tmp_path: Path) -> None:
    """With the pixels that the configuration asks for; the scene is the same as it was the first time."""
    plan = replace(example.plan, scenes={COTTON[0]: COTTON[1:]})
    words = ["--results", plan.results, "--plan", plan.to_json(), "--pixels", "[[20, 41]]"]
    words += ["--output", tmp_path / "pictures", "--page", tmp_path / "page.json"]
    done(*words, of=figures.command)
    (scene,) = [found for found in example.scenes if found["scene"] == "cotton"]
    assert json.loads((tmp_path / "page.json").read_text()) == scene
    assert (scene["probes"][0]["y"], scene["probes"][0]["x"]) == (20, 41)
    written = {path.name for path in (tmp_path / "pictures").iterdir()}
    assert {f"{name}.{ending}" for name in ("overview", "pixels") for ending in ("png", "pdf")} <= written


@pytest.fixture
def runs(example: Example) -> Runs:
    return example.numbers


def score_of(
    example: Example, scene: tuple[str, str], variant: str, region: str = "all", name: str = "mse100"
) -> float:
    """A score of a final map, looked up in the numbers by hand."""
    keys = {"dataset": scene[0], "scene": scene[1], "variant": variant, "stage": "optimize", "protocol": "paper"}
    found = example.numbers.numbers
    for key, text in (keys | {"region": region, "score": name}).items():
        found = found[found[key] == text]
    return float(found["value"].item())


def test_headline_figures(runs: Runs, example: Example) -> None:
    """Ours beside the paper's, for the scenes that the paper has; then the others."""
    row, other = page.headline(runs)
    assert other["scene"] == "builtin/dots"
    assert other["published"] == [None, None]
    assert other["ours"]["paper"] == [score_of(example, DOTS, "paper", "all", name) for name in ("mse100", "q25")]
    assert row["scene"] == "hci/cotton"
    assert row["published"] == [1.20, 0.34]
    expected = {v: [score_of(example, COTTON, v, "all", name) for name in ("mse100", "q25")] for v in ("best", "paper")}
    assert row["ours"] == expected


def test_ablation_bars(runs: Runs, example: Example) -> None:
    """Averages over the scenes available, beside the published averages of the same variant and region."""
    groups = charts.ablation_bars(runs)
    assert {title.split(", ")[1] for title in groups} == {"whole map", *REGIONS[1:]}
    whole = groups["hci, whole map"]
    assert whole.at["paper", "published"] == published.table4().at[("hci", "paper"), "all"] == 4.34
    assert np.isnan(whole.at["best", "published"])
    assert whole.at["paper", "ours"] == score_of(example, COTTON, "paper")
    assert groups["builtin, occluded"].at["paper", "ours"] == score_of(example, DOTS, "paper", "occluded")
    assert groups["hci_2013, whole map, published only"]["ours"].isna().all()
    assert not [title for title in groups if title.startswith(f"{PICTURE[0]},")], "a dataset without truth has no bars"


def test_averages_name_the_scenes_that_have_no_such_region(runs: Runs) -> None:
    """One scene's figure is not shown as the average of all."""
    facts = copy.deepcopy(runs.facts) | {"plan": runs.facts["plan"] | {"scenes": {"builtin": ["dots", "wall"]}}}
    wall = runs.numbers[runs.numbers["scene"] == "dots"].assign(scene="wall")
    wall.loc[(wall["region"] == "occluded") & (wall["score"] == "mse100"), "value"] = np.nan
    changed = Runs(facts, pd.concat([runs.numbers, wall]))
    assert {"builtin, whole map, average of 2 scenes", "builtin, occluded, 1 of 2 scenes"} <= {
        *charts.ablation_bars(changed)
    }
    wall.loc[wall["score"] == "mse100", "value"] = np.nan
    changed = Runs(facts, pd.concat([runs.numbers, wall]))
    assert page.headline(changed)[-1]["notes"]["paper"] == "1/2 scenes"


def test_charts_are_written(example: Example, tmp_path: Path) -> None:
    """Each as a picture to look at and as one for a paper."""
    names = ("ablation", "time_and_memory", "error_bars")
    one = tmp_path / "one"
    for name in names:
        charts.CHARTS[name](one, name, example.numbers)
    assert {path.name for path in one.iterdir()} == {f"{name}.{ending}" for name in names for ending in ("png", "pdf")}
    for path in one.iterdir():
        if path.suffix == ".pdf":
            assert path.read_bytes().startswith(b"%PDF")
            assert b"CreationDate" not in path.read_bytes()
        else:
            picture = cv2.imread(str(path))
            assert picture.std() > 5, "an empty picture"
