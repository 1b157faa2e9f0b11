"""The page of the report: what it holds, how large it is, and the figures beside its tables."""

import base64
import copy
import json
import re
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt
import pandas as pd
import pytest
from click.testing import CliRunner
from page_example import COTTON, DOTS, PICTURE, SIZE, Example

from sepi.errors import SepiError
from sepi.extensions.page import page
from sepi.extensions.page.page import embedded, prose, read_scene
from sepi.extensions.page.scene import page_json
from sepi.extensions.page.viewer import CONFIDENCE, OTHER, PRECISE, STEPS, viewer_json
from sepi.io.scores import Evaluation
from sepi.lightfield import FloatMap, LightField
from sepi.report import charts, figures, published
from sepi.report.charts import write_error_bars
from sepi.report.panels import Kind, Panel, SceneResults, note_of, panels_of
from sepi.report.runs import Runs
from sepi.scoring.scores import REGIONS
from sepi.stage import StageMaps

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


def test_precise_maps_are_the_finest() -> None:
    for steps in STEPS:
        assert steps[PRECISE] == min(steps)
    for role in (PRECISE, CONFIDENCE, OTHER):
        assert sorted(steps[role] for steps in STEPS) == [steps[role] for steps in STEPS]
    panels = [panel(0, some_map(0), precise=True), panel(1, some_map(1), "confidence"), panel(2, some_map(2))]
    assert [array["step"] for array in viewer_json(panels, SCALE)["arrays"]] == list(STEPS[0])


def test_a_small_scene_is_never_made_coarse() -> None:
    """It has as many characters as one of 512x512."""
    panels = [panel(seed, some_map(seed, (64, 64)), precise=seed < 4) for seed in range(30)]
    assert {array["step"] for array in viewer_json(panels, SCALE)["arrays"]} == {0.001, 0.002}


def test_large_pictures_are_thinned_out() -> None:
    """Every other row and column of a picture of 1500x1500, which a phone could not hold in thirty maps."""
    shape = (1501, 1500)
    y, x = np.indices(shape)
    panels = [panel(0, (x / 500).astype(np.float32), precise=True), panel(1, y < 700, "mask")]
    found = viewer_json(panels, SCALE, a_light_field(np.full((*shape, 3), 90, np.uint8)))
    assert (found["stride"], found["height"], found["width"]) == (2, 751, 750)
    assert decoded(found["picture"]).shape == (751, 750, 3)
    assert viewer_json([panel(0, np.zeros((1024, 1024), bool), "mask")], SCALE)["stride"] == 1


def test_the_picture_keeps_its_colours() -> None:
    picture = np.full((16, 16, 3), (200, 100, 20), np.uint8)
    found = viewer_json([panel(0, some_map(0, (16, 16)))], SCALE, a_light_field(picture))
    assert np.abs(decoded(found["picture"]).astype(int) - picture).max() <= 6


def test_ten_noisy_scenes_stay_below_20_megabytes(example: Example) -> None:
    """Steps grow until a scene keeps its share, whatever its maps are like; ten of them and the page fit."""
    random = np.random.default_rng(0)
    shape = (512, 512)
    y, x = np.indices(shape)
    ground_truth = (np.sin(x / 60) + y / 300 + (x > 250)).astype(np.float32)
    picture = np.clip(random.normal(128, 30, (*shape, 3)), 0, 255).astype(np.uint8)

    def blobs() -> FloatMap:
        found: FloatMap = cv2.GaussianBlur(random.normal(0, 1, shape).astype(np.float32), (0, 0), 6) * 18
        return found

    def estimate() -> FloatMap:
        found = ground_truth + random.normal(0, 0.02, shape)
        wrong = random.random(shape) < 0.01
        found[wrong] = random.uniform(-1, 3, wrong.sum())
        return found.astype(np.float32)

    def confidence() -> FloatMap:
        return (blobs() + random.normal(0, 0.05, shape)).clip(0, 1).astype(np.float32)

    def with_bars(shown: Panel) -> Panel:
        assert shown.values is not None
        sigma = (10 ** (blobs() / 2 - 2) * random.uniform(0.9, 1.1, shape)).astype(np.float32)
        reach = 1.7 * sigma * (1 + blobs() / 9)
        bars = {"sigma": sigma, "low": shown.values - reach, "high": shown.values + reach}
        return replace(shown, bars=StageMaps(shown.values, sigma, bars))

    panels = [panel(0, ground_truth, precise=True)]
    panels += [panel(1 + number, estimate(), precise=number < 2) for number in range(16)]
    panels[1:3] = [with_bars(shown) for shown in panels[1:3]]
    panels += [panel(17 + number, confidence(), "confidence") for number in range(2)]
    panels += [panel(19 + number, blobs() > 1, "mask") for number in range(6)]
    scene = len(json.dumps(viewer_json(panels, SCALE, a_light_field(picture))))
    probes = max(len(json.dumps(found["probes"])) for found in example.scenes)
    rest = example.page.stat().st_size - sum(len(json.dumps(found)) for found in example.scenes)
    assert rest < 600_000
    assert 10 * (scene + probes) + rest < LARGEST_PAGE


def test_panels_name_arrays_that_are_there(example: Example) -> None:
    """A dangling number would be an error when the reader chooses the panel."""
    for scene in example.scenes:
        assert (scene["height"], scene["width"], scene["stride"]) == (SIZE, SIZE, 1)
        keys = [shown["key"] for shown in scene["panels"]]
        assert len(set(keys)) == len(keys)
        kinds = {shown["kind"] for shown in scene["panels"]}
        assert kinds <= {"picture", "disparity", "error", "change", "confidence", "sigma", "grey", "mask", "outline"}
        for shown in scene["panels"]:
            for role in ("map", "minus", "ground_truth", "confidence", "sigma", "below", "above"):
                if role in shown:
                    is_mask = role == "map" and shown["kind"] in ("mask", "outline")
                    assert (scene["arrays"][shown[role]]["step"] == 1) == is_mask, (shown, role)
        assert {scene["first"]["a"], scene["first"]["b"]} <= set(keys)


def test_a_scene_has_every_panel(example: Example) -> None:
    """Reference view, truth, every stage, errors, changes, masks, confidence, other methods."""
    panels = {scene["scene"]: {shown["key"]: shown for shown in scene["panels"]} for scene in example.scenes}
    numbered = [f"{number}_{stage}" for number, stage in enumerate(example.plan.stages, start=1)]
    stages = {f"{variant}/{stage}" for variant in ("paper", "best") for stage in numbered}
    cotton = set(panels["cotton"])
    assert {"reference_view", "ground_truth", "occluded_ground_truth", "textureless_ground_truth", *stages} <= cotton
    assert {"paper/error", "best/error", "best/change", "external/SPO/disparity", "external/SPO/error"} <= cotton
    assert {
        "paper/confidence",
        "best/confidence",
        "paper/sigma",
        "best/sigma",
        "paper/superpixels",
        "paper/lti",
    } <= cotton
    for kind, count in (("mask", 7), ("outline", 1), ("grey", 1)):
        assert sum(shown["kind"] == kind for shown in panels["cotton"].values()) == count, kind
    assert not any("external" in key for key in panels["dots"])
    without = set(panels["picture"])
    assert stages <= without
    assert not any("ground_truth" in key or "error" in key or "change" in key for key in without)
    assert re.fullmatch(r"MSE \d+\.\d\d, Q25 \d+\.\d\d, BadPix 0\.07 \d+\.\d %", panels["cotton"]["best/error"]["note"])
    assert note_of(Evaluation()) == ""


def test_the_view_of_the_camera_is_handed_on(example: Example) -> None:
    """A cloud of a view beside the centre must not be sheared."""
    light_field = example.light_field(COTTON)
    assert light_field.camera is not None
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


class Page(HTMLParser):
    """What a page refers to, and its identifiers."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.addresses: list[str] = []
        self.ids: list[str] = []
        self.links: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        for name, value in attrs:
            if name == "id" and value:
                self.ids.append(value)
            if name in ("src", "href", "action", "data", "poster", "srcset", "xlink:href") and value:
                (self.links if tag == "a" else self.addresses).append(value)


def test_the_page_is_one_file(example: Example) -> None:
    """Nothing is loaded from anywhere; links go to places in the page that are there."""
    text = example.page.read_text(encoding="utf-8")
    found = Page(text)
    assert all(address.startswith("data:") for address in found.addresses), found.addresses
    assert {link.removeprefix("#") for link in found.links} <= set(found.ids)
    assert len(set(found.ids)) == len(found.ids)
    style = text[text.index("<style>") : text.index("</style>")]
    assert "@import" not in style
    assert "url(" not in style


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


@pytest.mark.parametrize(
    ("content", "message"),
    [(None, "cannot be read"), ("{", "not JSON"), ("[]", "not a scene of a report"), ('{"dataset": 1}', "not a scene")],
)
def test_what_is_no_scene_is_named(content: str | None, message: str, example: Example, tmp_path: Path) -> None:
    """And an earlier page stays as it was."""
    (tmp_path / "index.html").write_text("earlier")
    first = example.scenes[0]
    scene = tmp_path / first["dataset"] / f"{first['scene']}.json"
    scene.parent.mkdir()
    if content is not None:
        scene.write_text(content)
    result = run_page(tmp_path, example)
    assert result.exit_code == 1
    assert message in result.stderr
    assert result.stderr.startswith(f"sepi: {scene}: ")
    assert (tmp_path / "index.html").read_text() == "earlier"
    with pytest.raises(SepiError):
        read_scene(scene)


def test_pictures_and_the_scene_for_the_page_come_from_one_command(example: Example, tmp_path: Path) -> None:
    """With the pixels that the configuration asks for; the scene is the same as it was the first time."""
    words = ["--results", example.plan.results, "--plan", example.plan.to_json(), "--dataset", COTTON[0]]
    words += ["--scene", COTTON[1], "--pixels", "[[20, 41]]", "--output", tmp_path / "pictures"]
    words += ["--page", tmp_path / "page.json"]
    result = CliRunner().invoke(figures.command, list(map(str, words)), catch_exceptions=False)
    assert result.exit_code == 0, result.output
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


def test_scenes_of_the_paper_that_are_not_at_hand(runs: Runs) -> None:
    found = page.missing_scenes(runs)
    assert "Cotton" not in found["hci"]
    assert "Antinous" in found["hci"]
    assert len(found["hci"]) == 23
    assert len(found["hci_2013"]) == 7


def test_ablation_bars(runs: Runs, example: Example) -> None:
    """Averages over the scenes available, beside the published averages of the same variant and region."""
    groups = {(group.dataset, group.region): group for group in charts.ablation_bars(runs)}
    assert {region for _, region in groups} == {"whole map", *REGIONS[1:]}
    whole = groups["hci", "whole map"]
    bars = {bar.variant: bar for bar in whole.rows}
    assert (whole.scenes, whole.over) == (1, "")
    assert bars["paper"].published == published.table4().at[("hci", "paper"), "all"] == 4.34
    assert bars["best"].published is None
    assert bars["paper"].ours == score_of(example, COTTON, "paper")
    assert whole.largest == max(score_of(example, COTTON, "paper"), score_of(example, COTTON, "best"), 4.34)
    builtin = {bar.variant: bar for bar in groups["builtin", "occluded"].rows}
    assert builtin["paper"].ours == score_of(example, DOTS, "paper", "occluded")
    assert groups["hci_2013", "whole map"].scenes == 0
    assert all(bar.ours is None for bar in groups["hci_2013", "whole map"].rows)
    assert not [key for key in groups if key[0] == PICTURE[0]], "a dataset without truth has no bars"


def test_averages_name_the_scenes_that_have_no_such_region(runs: Runs) -> None:
    """One scene's figure is not shown as the average of all."""
    facts = copy.deepcopy(runs.facts) | {"plan": runs.facts["plan"] | {"scenes": {"builtin": ["dots", "wall"]}}}
    wall = runs.numbers[runs.numbers["scene"] == "dots"].assign(scene="wall")
    wall.loc[(wall["region"] == "occluded") & (wall["score"] == "mse100"), "value"] = np.nan
    changed = Runs(facts, pd.concat([runs.numbers, wall]))
    groups = {group.region: group for group in charts.ablation_bars(changed) if group.dataset == "builtin"}
    assert (groups["whole map"].over, groups["occluded"].over) == ("2 scenes", "1 of 2 scenes")
    wall.loc[wall["score"] == "mse100", "value"] = np.nan
    changed = Runs(facts, pd.concat([runs.numbers, wall]))
    assert page.headline(changed)[-1]["notes"]["paper"] == "1/2 scenes"


def test_times(runs: Runs, example: Example) -> None:
    rows = charts.stage_times(runs)
    assert list(rows.index[:2]) == [("builtin/dots", "best"), ("builtin/dots", "paper")]
    assert len(rows) == 6
    assert rows["seconds"].iloc[0].to_dict() == {"initial": 1.5, "occlusion": 2.5, "textureless": 3.5, "optimize": 4.5}
    assert rows["peak_memory_mb"].iloc[0].max() == 230
    assert page.total_seconds(example.numbers) == 72.0


def test_the_first_scene(example: Example) -> None:
    """One that the paper has; else the last, the built-in ones being ordered from easy to hard."""
    assert page.first_scene(example.numbers) == "hci/cotton"
    plan = example.numbers.facts["plan"] | {"scenes": {"builtin": ["dots", "wall"]}}
    assert page.first_scene(replace(example.numbers, facts={"plan": plan})) == "builtin/wall"


def test_charts_are_written_twice_the_same(example: Example, tmp_path: Path) -> None:
    """Each as a picture to look at and as one for a paper."""
    wanted = ("ablation", "time_and_memory", "error_bars")
    # all are saved in one way
    for name, some in (("one", wanted), ("two", wanted[1:2])):
        for chart in some:
            charts.CHARTS[chart](tmp_path / name, chart, example.numbers)
    one = tmp_path / "one"
    names = {f"{name}.{ending}" for name in wanted for ending in ("png", "pdf")}
    assert {path.name for path in one.iterdir()} == names
    again = list((tmp_path / "two").iterdir())
    assert len(again) == 2
    for path in again:
        assert path.read_bytes() == (one / path.name).read_bytes(), path.name
    for path in one.iterdir():
        if path.suffix == ".pdf":
            assert path.read_bytes().startswith(b"%PDF")
            assert b"CreationDate" not in path.read_bytes()
        else:
            picture = cv2.imread(str(path))
            assert picture.std() > 5, "an empty picture"


def test_a_chart_without_a_scene_with_truth(example: Example, tmp_path: Path) -> None:
    """The rule promises the files: they come, and say why they are empty."""
    charts.write_bars(tmp_path, "ablation", [])
    write_error_bars(tmp_path, "error_bars", replace(example.numbers, numbers=example.numbers.numbers.iloc[:0]))
    for name in ("ablation", "error_bars"):
        assert (cv2.imread(str(tmp_path / f"{name}.png")) < 128).any()
