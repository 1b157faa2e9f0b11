"""The report: tables from a small set of result files, and pictures."""

import csv
import json
from pathlib import Path

import cv2
import numpy as np
import pytest
from click.testing import CliRunner

from sepi import pipeline
from sepi.errors import SepiError
from sepi.evaluate import evaluation_of
from sepi.io.hdf5 import write_light_field, write_stage
from sepi.io.scores import write_scores
from sepi.lightfield import DisparityRange, LightField
from sepi.report import figures, pictures, tables
from sepi.report.plan import TABLES, Plan
from sepi.stage import StageMaps

SIZE = 40
SCENES = {"builtin": ["dots", "flat"], "hci": ["cotton", "mine", "picture"]}
VARIANTS = {
    "paper": {"initial": "sepi", "occlusion": "half_sepi", "textureless": "lti", "optimize": "wls"},
    "no_occlusion": {"initial": "sepi", "occlusion": "none", "textureless": "lti", "optimize": "wls"},
    "wang": {"initial": "sepi", "occlusion": "wang", "textureless": "lti", "optimize": "wls"},
}
# error added to the truth after each stage; the scenes' own is added too
STAGE_ERROR = {"initial": 0.4, "occlusion": 0.3, "textureless": 0.2, "optimize": 0.1}
VARIANT_ERROR = {"paper": 0.0, "no_occlusion": 0.1, "wang": 0.2, "best": -0.05, "best_wls": 0.3}
SCENE_ERROR = {"dots": 0.0, "flat": 0.1, "cotton": 0.0, "mine": 0.1, "picture": 0.0}


def light_field(name: str) -> LightField:
    random = np.random.default_rng(len(name))
    views = random.integers(0, 256, (3, 3, SIZE, SIZE, 3), np.uint8)
    truth = None if name == "picture" else np.linspace(-1, 1, SIZE, dtype=np.float32) * np.ones((SIZE, 1), np.float32)
    masks = {"occluded": np.zeros((SIZE, SIZE), bool), "textureless": np.ones((SIZE, SIZE), bool)}
    if name != "flat":
        masks["occluded"][5:10] = True
    known = DisparityRange(-1.5, 1.5, "given")
    return LightField(views, name, "test", disparity_range=known, truth=truth, masks=masks)


def stage_maps(scene: LightField, variant: str, stage: str) -> StageMaps:
    truth = scene.truth if scene.truth is not None else np.zeros(scene.shape, np.float32)
    step = np.float32(STAGE_ERROR[stage] + VARIANT_ERROR[variant] + SCENE_ERROR[scene.name])
    extra = {
        "occluded": scene.masks["occluded"],
        "textureless": scene.masks["textureless"],
        "superpixels": (np.indices(scene.shape) // 10).sum(0).astype(np.int32),
    }
    return StageMaps(truth + step, np.full(scene.shape, 0.5, np.float32), extra)


@pytest.fixture(scope="module")
def plan(tmp_path_factory: pytest.TempPathFactory) -> Plan:
    """Results of five scenes (one built-in called like a benchmark scene, one picture without truth) and 3 variants."""
    return with_results(Plan(tmp_path_factory.mktemp("results"), SCENES, VARIANTS))


def with_results(made: Plan) -> Plan:
    """The plan, its result files written."""
    for dataset, name in made.pairs:
        scene = light_field(name)
        write_light_field(made.light_field_file(dataset, name), scene)
        for variant in made.variants:
            for stage in made.stages:
                maps = stage_maps(scene, variant, stage)
                write_stage(made.stage_file(dataset, name, variant, stage), maps, {"stage": stage})
                scores = made.stage_file(dataset, name, variant, stage, "scores.h5")
                write_scores(scores, evaluation_of(scene, maps.disparity), {"stage": stage})
                timing = made.stage_file(dataset, name, variant, stage, "time.json")
                timing.write_text(json.dumps({"seconds": 1.5, "peak_memory_mb": 200 + 10 * len(stage)}))
    return made


@pytest.fixture(scope="module")
def report(plan: Plan, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder with every table."""
    folder = tmp_path_factory.mktemp("reports")
    run(tables.command, plan, folder)
    return folder


def run(command: object, plan: Plan, output: Path, *more: str) -> None:
    arguments = ["--results", str(plan.results), "--plan", plan.to_json(), "--output", str(output), *more]
    result = CliRunner().invoke(command, arguments, catch_exceptions=False)  # type: ignore[arg-type]
    assert result.exit_code == 0, result.output


def rows_of(folder: Path, table: str) -> list[dict[str, str]]:
    with (folder / f"{table}.csv").open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def only(rows: list[dict[str, str]], **cells: str) -> dict[str, str]:
    found = [row for row in rows if all(row[key] == value for key, value in cells.items())]
    assert len(found) == 1, (cells, found)
    return found[0]


def test_every_table_is_written_twice(report: Path) -> None:
    assert {path.name for path in report.iterdir()} == {f"{name}.{end}" for name in TABLES for end in ("csv", "md")}


def test_our_figure_stands_beside_the_published_ones(report: Path) -> None:
    """Folder cotton is the paper's Cotton; its MSE x100 here is 100 * 0.1^2, its Q25 x100 is 10."""
    mse = only(rows_of(report, "table1_mse"), dataset="hci", scene="Cotton")
    assert (mse["ours"], mse["zhou"], mse["mishiba"], mse["jin"]) == ("1.0000", "1.20", "0.91", "1.99")
    q25 = only(rows_of(report, "table2_q25"), dataset="hci", scene="Cotton")
    assert (q25["ours"], q25["zhou"]) == ("10.0000", "0.34")
    assert "| Cotton | 1.00 | 1.20 | 1.24 |" in (report / "table1_mse.md").read_text()


def test_scenes_not_at_hand_are_published_only(report: Path) -> None:
    rows = rows_of(report, "table1_mse")
    antinous = only(rows, dataset="hci", scene="Antinous")
    assert (antinous["ours"], antinous["zhou"], antinous["jin"]) == ("", "12.84", "")
    assert len([row for row in rows if row["row"] == "scene" and row["zhou"]]) == 31


def test_scenes_the_paper_does_not_have_get_our_figures_only(report: Path) -> None:
    """A built-in scene called dots must not be compared with the benchmark's Dots."""
    rows = rows_of(report, "table1_mse")
    for dataset, scene, ours in (
        ("builtin", "dots", "1.0000"),
        ("builtin", "flat", "4.0000"),
        ("hci", "mine", "4.0000"),
    ):
        row = only(rows, dataset=dataset, scene=scene)
        assert (row["ours"], row["zhou"]) == (ours, "")
    assert only(rows, dataset="hci", scene="Dots")["ours"] == ""


def test_pictures_without_truth_have_no_row(report: Path) -> None:
    for table in ("table1_mse", "table2_q25", "table4_ablation", "stages"):
        assert not [row for row in rows_of(report, table) if row["scene"] == "picture"]


def test_averages_say_over_what(report: Path) -> None:
    """Averages compare only over the same scenes: a method without a figure for one of them gets none."""
    rows = rows_of(report, "table1_mse")
    ours = only(rows, dataset="builtin", row="average")
    assert (ours["scene"], ours["ours"]) == ("Average of 2 scenes at hand", "2.5000")
    assert only(rows, dataset="hci", row="average")["zhou"] == ""
    printed = only(rows, dataset="hci", row="average printed")
    assert (printed["ours"], printed["zhou"]) == ("", "4.34")
    assert not [row for row in rows if row["dataset"] == "hci_old" and row["row"] == "average"]


def test_average_of_scenes_at_hand_covers_the_published_ones(plan: Plan, tmp_path: Path) -> None:
    alone = Plan(plan.results, {"hci": ["cotton"]}, VARIANTS)
    run(tables.command, alone, tmp_path, "--table", "table1_mse")
    row = only(rows_of(tmp_path, "table1_mse"), dataset="hci", row="average")
    assert (row["scene"], row["ours"], row["zhou"]) == ("Average of 1 scene at hand", "1.0000", "1.20")


def test_regions_table(report: Path) -> None:
    """The occluded average leaves out the scene that has no occluded pixel."""
    rows = rows_of(report, "table3_regions")
    ours = only(rows, method="ours")
    assert (ours["builtin_occluded"], ours["builtin_textureless"]) == ("1.0000", "2.5000")
    assert (ours["hci_occluded"], ours["hci_old_occluded"]) == ("2.5000", "")
    assert only(rows, method="zhou")["hci_occluded"] == "20.62"
    assert only(rows, method="wang_occ")["hci_old_textureless"] == "3.95"
    assert not [row for row in rows if row["method"] == "mishiba"]
    assert "hci: cotton, mine" in (report / "table3_regions.md").read_text()


def test_ablation_table(report: Path) -> None:
    rows = rows_of(report, "table4_ablation")
    cotton = only(rows, scene="cotton", region="all")
    assert [cotton[name] for name in VARIANTS] == ["1.0000", "4.0000", "9.0000"]
    assert only(rows, scene="flat", region="occluded")["paper"] == "nan"
    printed = [row for row in rows if row["dataset"] == "hci" and row["row"] == "average printed"]
    assert [row["no_occlusion"] for row in printed] == ["8.11", "36.15", "3.97"]
    assert [row["wang"] for row in printed] == ["13.12", "", ""]
    page = (report / "table4_ablation.md").read_text()
    assert "| cotton | 1.00/1.00/1.00 | 4.00/4.00/4.00 | 9.00/9.00/9.00 |" in page
    assert "| Average as printed (24 scenes) | 4.34/20.62/3.90 | 8.11/36.15/3.97 | 13.12 |" in page
    assert "| flat | 4.00/n/a/4.00 |" in page


def test_stage_table_follows_the_stages(report: Path) -> None:
    rows = [row for row in rows_of(report, "stages") if row["scene"] == "cotton" and row["variant"] == "wang"]
    whole = [row for row in rows if row["protocol"] == "benchmark" and row["region"] == "all"]
    assert [(row["stage"], row["choice"]) for row in whole] == list(VARIANTS["wang"].items())
    assert [row["mse100"] for row in whole] == ["36.0000", "25.0000", "16.0000", "9.0000"]
    assert {(row["pixels"], row["non_finite"]) for row in whole} == {("100", "0")}
    assert len(rows) == 4 * 2 * 3


def test_runtime_table(report: Path) -> None:
    rows = [row for row in rows_of(report, "runtime") if row["scene"] == "picture"]
    total = only(rows, variant="paper", stage="total")
    assert (total["seconds"], total["peak_memory_mb"]) == ("6.0000", "310.0000")
    assert total["published_seconds"] == "1800.60"
    assert only(rows, variant="wang", stage="initial")["published_seconds"] == ""


def test_pages_name_their_protocol(report: Path) -> None:
    for name in TABLES:
        text = (report / f"{name}.md").read_text().lower()
        assert "protocol" in text or name == "runtime"
        assert "benchmark (border 15)" in text or name != "stages"


def test_tables_are_the_same_bytes_each_time(plan: Plan, report: Path, tmp_path: Path) -> None:
    run(tables.command, plan, tmp_path)
    for path in report.iterdir():
        assert path.read_bytes() == (tmp_path / path.name).read_bytes()


@pytest.mark.parametrize("table", TABLES)
def test_tables_read_only_their_declared_inputs(table: str, plan: Plan, tmp_path: Path) -> None:
    """The workflow runs a table when its declared inputs are there; it must not need another."""
    for path in plan.table_inputs(table):
        copy = tmp_path / "results" / path.relative_to(plan.results)
        copy.parent.mkdir(parents=True, exist_ok=True)
        copy.hardlink_to(path)
    run(tables.command, Plan(tmp_path / "results", SCENES, VARIANTS), tmp_path / "reports", "--table", table)
    assert (tmp_path / "reports" / f"{table}.csv").is_file()


def test_best_has_its_columns_and_an_ablation_of_its_own(tmp_path: Path) -> None:
    """The default variant must be seen beside the paper's; its reduced variants do not crowd the other tables."""
    variants = VARIANTS | {name: pipeline.VARIANTS[name].choices for name in ("best", "best_wls")}
    made = with_results(Plan(tmp_path / "results", {"hci": ["cotton", "picture"]}, variants))
    run(tables.command, made, tmp_path / "reports")
    mse = only(rows_of(tmp_path / "reports", "table1_mse"), dataset="hci", scene="Cotton")
    assert (mse["ours_best"], mse["ours"], mse["zhou"]) == ("0.2500", "1.0000", "1.20")
    assert "| this code, best | this code, paper |" in (tmp_path / "reports/table2_q25.md").read_text()
    assert only(rows_of(tmp_path / "reports", "table3_regions"), method="ours_best")["hci_textureless"] == "0.2500"
    table4 = rows_of(tmp_path / "reports", "table4_ablation")
    assert "best" in table4[0]
    assert "best_wls" not in table4[0]
    parts = rows_of(tmp_path / "reports", "ablation_best")
    assert [(row["variant"], row["mse100"], row["seconds"]) for row in parts] == [
        ("best", "0.2500", "6.0000"),
        ("best_wls", "16.0000", "6.0000"),
    ]
    confidence = rows_of(tmp_path / "reports", "confidence")
    assert {row["variant"] for row in confidence} == {"best", "paper"}
    row = only(confidence, variant="best", error="mae100")
    assert float(row["decile 1"]) == pytest.approx(5, abs=1e-3)
    assert float(row["area"]) == pytest.approx(float(row["oracle"]), abs=1e-3)


def test_variants_share_the_files_of_their_first_stages(plan: Plan) -> None:
    files = [plan.stage_file("hci", "cotton", variant, "initial") for variant in VARIANTS]
    assert len(set(files)) == 1
    assert files[0] == plan.results / "hci/cotton/stages/sepi/initial.h5"
    assert len(plan.table_inputs("stages")) == 5 * (1 + 3 * 3)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("{", "plan: expected JSON"),
        ('{"scenes": {}}', "plan: expected JSON"),
        ('{"scenes": {}, "variants": {"mine": {"initial": "sepi"}}}', "no variant 'paper'"),
        ('{"scenes": [], "variants": {}}', "plan: expected JSON"),
    ],
)
def test_a_wrong_plan_is_a_clear_error(text: str, message: str) -> None:
    with pytest.raises(SepiError, match=message):
        Plan.from_json(Path("results"), text)


def test_a_missing_or_broken_file_is_one_line(plan: Plan, tmp_path: Path) -> None:
    for table in ("table1_mse", "runtime"):
        arguments = ["--results", str(tmp_path), "--plan", plan.to_json(), "--output", str(tmp_path / "out")]
        result = CliRunner().invoke(tables.command, [*arguments, "--table", table])
        assert result.exit_code == 1
        assert result.output.startswith(f"sepi: {tmp_path}/builtin/dots/stages/sepi/")
        assert len(result.output.splitlines()) == 1
    assert not (tmp_path / "out").exists()


def test_pictures_of_a_scene(plan: Plan, tmp_path: Path) -> None:
    run(figures.command, plan, tmp_path, "--dataset", "hci", "--scene", "cotton")
    written = {str(path.relative_to(tmp_path)) for path in tmp_path.rglob("*.png")}
    common = {"overview.png", "centre.png", "truth.png", "occluded_truth.png", "textureless_truth.png"}
    stages = {"1_initial", "2_occlusion", "3_textureless", "4_optimize"}
    each = stages | {"error", "confidence", "occluded", "textureless", "superpixels"}
    common.add("paper/sparsification.png")
    assert written == common | {f"{variant}/{name}.png" for variant in VARIANTS for name in each}
    centre = cv2.imread(str(tmp_path / "centre.png"))[:, :, ::-1]
    np.testing.assert_array_equal(centre, light_field("cotton").views[1, 1])


def test_pictures_without_ground_truth(plan: Plan, tmp_path: Path) -> None:
    """A real picture: maps, but neither truth nor errors."""
    run(figures.command, plan, tmp_path, "--dataset", "hci", "--scene", "picture")
    written = {path.stem for path in tmp_path.rglob("*.png")}
    assert {"overview", "centre", "4_optimize"} <= written
    assert not written & {"truth", "error", "occluded_truth", "textureless_truth"}


def test_pictures_are_the_same_bytes_each_time(plan: Plan, tmp_path: Path) -> None:
    for name in ("one", "two"):
        run(figures.command, plan, tmp_path / name, "--dataset", "builtin", "--scene", "dots")
    for path in (tmp_path / "one").rglob("*.png"):
        assert path.read_bytes() == (tmp_path / "two" / path.relative_to(tmp_path / "one")).read_bytes()


def test_error_picture_shows_sign_and_unknown() -> None:
    """Red is too near, blue too far, white right, magenta unknown."""
    near, far, right, unknown = pictures.error_picture(np.array([[1, -1, 0, np.nan]], np.float32))[0]
    assert near[0] > 100
    assert near[2] == 0
    assert far[2] > 50
    assert far[0] == 0
    assert (right > 250).all()
    np.testing.assert_array_equal(unknown, [255, 0, 255])


def test_disparity_colours_share_the_truths_scale() -> None:
    scene = light_field("cotton")
    assert pictures.disparity_limits(scene) == (-1, 1)
    assert pictures.disparity_limits(light_field("picture")) == (-1.5, 1.5)
    ends = pictures.map_picture(np.array([[-5, -1, 1, 5]], np.float32), (-1, 1))[0]
    np.testing.assert_array_equal(ends[0], ends[1])
    np.testing.assert_array_equal(ends[2], ends[3])
    assert (ends[1] != ends[2]).any()


def test_superpixel_outlines_lie_on_the_borders() -> None:
    centre = np.zeros((4, 4, 3), np.uint8)
    labels = np.repeat([[0, 0, 1, 1]], 4, axis=0)
    drawn = pictures.outline_picture(centre, labels).any(axis=2)
    np.testing.assert_array_equal(drawn, labels == np.array([9, 9, 1, 9]))
