"""The report: numbers and tables from a small set of result files, and pictures."""

import copy
import csv
import hashlib
import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from click.testing import CliRunner

from sepi import pipeline
from sepi.errors import SepiError
from sepi.evaluate import evaluation_of, score_maps
from sepi.external import NO_FILE
from sepi.io.external_maps import ExternalMap, write_external
from sepi.io.hdf5 import read_stage, write_light_field, write_stage
from sepi.io.scores import Evaluation, map_name, read_evaluations, write_scores
from sepi.lightfield import DisparityRange, LightField
from sepi.report import figures, numbers, tables
from sepi.report.numbers import collect
from sepi.report.plan import PARTS_TABLES, TABLES, Plan
from sepi.report.plots import pictures
from sepi.report.runs import Runs
from sepi.report.tabular.latex import as_latex
from sepi.report.tabular.layout import BEST, SECOND, as_csv, as_json, as_markdown, ranks
from sepi.stage import StageMaps

SIZE = 40
SCENES = {"builtin": ["dots", "flat"], "hci": ["cotton", "mine", "picture"]}
VARIANTS = {
    "paper": {"initial": "sepi", "occlusion": "half_sepi", "textureless": "lti", "optimize": "wls"},
    "no_occlusion": {"initial": "sepi", "occlusion": "none", "textureless": "lti", "optimize": "wls"},
    "wang": {"initial": "sepi", "occlusion": "wang", "textureless": "lti", "optimize": "wls"},
}
# error added to the ground truth after each stage; the scenes' own is added too
STAGE_ERROR = {"initial": 0.4, "occlusion": 0.3, "textureless": 0.2, "optimize": 0.1}
VARIANT_ERROR = {"paper": 0.0, "no_occlusion": 0.1, "wang": 0.2, "best": -0.05, "best_wls": 0.3}
SCENE_ERROR = {"dots": 0.0, "flat": 0.1, "cotton": 0.0, "mine": 0.1, "picture": 0.0}
# what is added to the ground truth of a scene in an imported map, or what is wrong with the map; one method has the
# name of a column that is there anyway, and is the most accurate of all
EXTERNAL: dict[str, dict[str, float | str]] = {
    "SPO": {"cotton": 0.2, "mine": NO_FILE, "picture": 0.2, "dots": NO_FILE},
    "zhou": {"cotton": 0.02, "mine": 0.04, "picture": NO_FILE, "dots": NO_FILE},
    "odd|_name_": {"cotton": "80x40 instead of 40x40", "mine": "not readable", "picture": NO_FILE, "dots": NO_FILE},
}


def light_field(name: str) -> LightField:
    random = np.random.default_rng(len(name))
    views = random.integers(0, 256, (3, 3, SIZE, SIZE, 3), np.uint8)
    ground_truth = (
        None if name == "picture" else np.linspace(-1, 1, SIZE, dtype=np.float32) * np.ones((SIZE, 1), np.float32)
    )
    masks = {"occluded": np.zeros((SIZE, SIZE), bool), "textureless": np.ones((SIZE, SIZE), bool)}
    if name != "flat":
        masks["occluded"][5:10] = True
    known = DisparityRange(-1.5, 1.5, "given")
    return LightField(views, name, "test", disparity_range=known, ground_truth=ground_truth, masks=masks)


def stage_maps(scene: LightField, variant: str, stage: str) -> StageMaps:
    ground_truth = scene.ground_truth if scene.ground_truth is not None else np.zeros(scene.shape, np.float32)
    step = np.float32(STAGE_ERROR[stage] + VARIANT_ERROR[variant] + SCENE_ERROR[scene.name])
    extra = {
        "occluded": scene.masks["occluded"],
        "textureless": scene.masks["textureless"],
        "superpixels": (np.indices(scene.shape) // 10).sum(0).astype(np.int32),
    }
    return StageMaps(ground_truth + step, np.full(scene.shape, 0.5, np.float32), extra)


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
            for stage in (stage for stage in made.stages if made.runs_stage(variant, stage)):
                maps = stage_maps(scene, variant, stage)
                step = {"stage": stage, "choice": made.variants[variant][stage], "parameters": "{}", "made_from": "[]"}
                write_stage(made.stage_file(dataset, name, variant, stage), maps, step)
                timing = made.stage_file(dataset, name, variant, stage, "time.json")
                timing.write_text(json.dumps({"seconds": 1.5, "peak_memory_mb": 200 + 10 * len(stage)}))
        folder = made.files(dataset, name).stages
        for parts in (False, True):
            files = made.scored_files(dataset, name, parts)
            disparity = {map_name(folder, file): read_stage(file).disparity for file in files}
            scored = score_maps(scene, disparity, {})[0]
            write_scores(made.scores_file(dataset, name, parts), scored, {"scene": name})
        if made.external:
            maps = {method: imported_map(scene, EXTERNAL[method][name]) for method in made.external}
            write_external(made.external_file(dataset, name), maps)
    return made


def imported_map(scene: LightField, what: float | str) -> ExternalMap:
    """A map with this error added to the ground truth, or one with this problem."""
    if isinstance(what, str):
        return ExternalMap("/maps/none.pfm", what)
    ground_truth = np.zeros(scene.shape, np.float32) if scene.ground_truth is None else scene.ground_truth
    disparity = ground_truth + np.float32(what)
    scores = Evaluation() if scene.ground_truth is None else evaluation_of(scene, disparity)
    return ExternalMap("/maps/some.pfm", "", 64 * "a", disparity, scores)


@pytest.fixture(scope="module")
def report(plan: Plan, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder with every table."""
    folder = tmp_path_factory.mktemp("reports")
    write_tables(plan, folder)
    return folder


@pytest.fixture(scope="module")
def imported(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """Numbers of four scenes with best, the paper's variant, and imported maps of three methods."""
    variants = {"paper": VARIANTS["paper"], "best": pipeline.VARIANTS["best"].choices}
    scenes = {"builtin": ["dots"], "hci": ["cotton", "mine", "picture"]}
    made = with_results(Plan(tmp_path_factory.mktemp("imported"), scenes, variants, tuple(EXTERNAL)))
    return json.loads(numbers.as_text(collect(made)))  # type: ignore[no-any-return]


def write_tables(plan: Plan, folder: Path, *names: str) -> None:
    """Collect the numbers of a plan, then write these tables from them, or all."""
    for number, more in enumerate([(), ("--parts",)]):
        path = folder.parent / f"numbers of {folder.name}" / f"{number}.json"
        run(numbers.command, plan, path, *more)
        held = [name for name in names or TABLES if (name in PARTS_TABLES) == bool(more)]
        chosen = [word for name in held for word in ("--table", name)] if names else []
        if held:
            arguments = ["--numbers", str(path), "--output", str(folder), *chosen]
            result = CliRunner().invoke(tables.command, arguments, catch_exceptions=False)
            assert result.exit_code == 0, result.output


def report_of(found: dict[str, Any], name: str) -> tables.Report:
    return tables.BUILDERS[name](Runs(found))


def cells_of(found: dict[str, Any], table: str, heading: str, row: str) -> dict[str, Any]:
    """Head of each column to the cell of the JSON in one row of one section of a table."""
    (section,) = [one for one in found["tables"][table]["sections"] if one["heading"].split(":")[0] == heading]
    (line,) = [line for line in section["rows"] if line["cells"][0]["text"] == row]
    return {column["head"]: cell for column, cell in zip(section["columns"], line["cells"], strict=True)}


def table_rows(page: str) -> list[list[str]]:
    """Cells of every row of a Markdown page's tables."""
    return [re.split(r"(?<!\\)\|", line)[1:-1] for line in page.splitlines() if line.startswith("|")]


def csv_rows(found: dict[str, Any], table: str) -> list[dict[str, str]]:
    """Rows of a table's CSV file, in which cells may hold line breaks."""
    return list(csv.DictReader(as_csv(report_of(found, table).data).splitlines(keepends=True)))


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


def test_every_table_is_written_thrice(report: Path) -> None:
    endings = ("csv", "md", "tex")
    assert {path.name for path in report.iterdir()} == {f"{name}.{end}" for name in TABLES for end in endings}


def test_our_figure_stands_beside_the_published_ones(report: Path) -> None:
    """Folder cotton is the paper's Cotton; its MSE x100 here is 100 * 0.1^2, its Q25 x100 is 10."""
    mse = only(rows_of(report, "table1_mse"), dataset="hci", scene="Cotton")
    assert (mse["ours"], mse["zhou"], mse["mishiba"], mse["jin"]) == ("1.0000", "1.20", "0.91", "1.99")
    q25 = only(rows_of(report, "table2_q25"), dataset="hci", scene="Cotton")
    assert (q25["ours"], q25["zhou"]) == ("10.0000", "0.34")
    assert (mse["ratio"], q25["ratio"]) == ("0.8333", "29.4118")
    page = (report / "table1_mse.md").read_text()
    assert "| Cotton | *1.00* | 0.83 | 1.20 | 1.24 | 4.17 | 5.90 | 1.94 | **0.91** | 13.59 | 0.21 |" in page


def test_scenes_not_at_hand_are_published_only(report: Path) -> None:
    rows = rows_of(report, "table1_mse")
    antinous = only(rows, dataset="hci", scene="Antinous")
    assert (antinous["ours"], antinous["ratio"], antinous["zhou"], antinous["jin"]) == ("", "", "12.84", "")
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
        assert (row["ours"], row["ratio"], row["zhou"]) == (ours, "", "")
    assert only(rows, dataset="hci", scene="Dots")["ours"] == ""


def test_pictures_without_truth_have_no_row(report: Path) -> None:
    for table in ("table1_mse", "table2_q25", "table4_ablation", "stages"):
        assert not [row for row in rows_of(report, table) if row["scene"] == "picture"]


def test_averages_say_over_what(report: Path) -> None:
    """Averages compare only over the same scenes: a method without a figure for one of them gets none."""
    rows = rows_of(report, "table1_mse")
    ours = only(rows, dataset="builtin", row="average")
    assert (ours["scene"], ours["ours"]) == ("Average of 2 scenes available", "2.5000")
    assert only(rows, dataset="hci", row="average")["zhou"] == ""
    printed = only(rows, dataset="hci", row="average printed")
    assert (printed["ours"], printed["zhou"]) == ("", "4.34")
    assert not [row for row in rows if row["dataset"] == "hci_2013" and row["row"] == "average"]


def test_average_of_scenes_at_hand_covers_the_published_ones(plan: Plan, tmp_path: Path) -> None:
    alone = Plan(plan.results, {"hci": ["cotton"]}, VARIANTS)
    write_tables(alone, tmp_path / "reports", "table1_mse")
    row = only(rows_of(tmp_path / "reports", "table1_mse"), dataset="hci", row="average")
    assert (row["scene"], row["ours"], row["zhou"]) == ("Average of 1 scene available", "1.0000", "1.20")
    assert row["ratio"] == "0.8333"


def test_regions_table(report: Path) -> None:
    """The occluded average leaves out the scene that has no occluded pixel."""
    rows = rows_of(report, "table3_regions")
    ours = only(rows, method="ours")
    assert (ours["builtin_occluded"], ours["builtin_textureless"]) == ("1.0000", "2.5000")
    assert (ours["hci_occluded"], ours["hci_2013_occluded"]) == ("2.5000", "")
    assert only(rows, method="zhou")["hci_occluded"] == "20.62"
    assert only(rows, method="wang_occ")["hci_2013_textureless"] == "3.95"
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
    assert {row["ratio"] for row in rows} == {""}


def test_published_seconds_are_divided_by_ours_for_scenes_of_their_size(imported: dict[str, Any]) -> None:
    """Another number of pixels is other work, and its ratio would flatter."""
    found = copy.deepcopy(imported)
    for scene in found["scenes"]:
        if scene["scene"] == "cotton":
            scene["light_field"] |= {"shape": [512, 512], "grid": [9, 9]}
    rows = csv_rows(found, "runtime")
    cotton = only(rows, scene="cotton", variant="paper", stage="total")
    assert (cotton["seconds"], cotton["published_seconds"], cotton["ratio"]) == ("6.0000", "1800.60", "300.1000")
    assert only(rows, scene="cotton", variant="best", stage="total")["ratio"] == ""
    assert only(rows, scene="mine", variant="paper", stage="total")["ratio"] == ""
    assert "| paper | 1.50 | 1.50 | 1.50 | 1.50 | 6.00 | 300.10 | 310.00 |" in as_markdown(report_of(found, "runtime"))


def test_pages_name_their_protocol(report: Path) -> None:
    for name in TABLES:
        text = (report / f"{name}.md").read_text().lower()
        assert "protocol" in text or name == "runtime"
        assert "benchmark (border 15)" in text or name != "stages"


def test_tables_are_the_same_bytes_each_time(plan: Plan, report: Path, tmp_path: Path) -> None:
    write_tables(plan, tmp_path / "reports")
    for path in report.iterdir():
        assert path.read_bytes() == (tmp_path / "reports" / path.name).read_bytes()


def linked(plan: Plan, folder: Path, parts: bool) -> Plan:
    """The plan in a folder that has the inputs of its numbers and nothing else."""
    for path in plan.number_inputs(parts):
        copied = folder / path.relative_to(plan.results)
        copied.parent.mkdir(parents=True, exist_ok=True)
        copied.hardlink_to(path)
    return replace(plan, results=folder)


@pytest.fixture(scope="module")
def complete(tmp_path_factory: pytest.TempPathFactory) -> Plan:
    """Results of one scene with best, one of its parts, and imported maps."""
    variants = {name: pipeline.VARIANTS[name].choices for name in ("paper", "best", "best_wls")}
    return with_results(Plan(tmp_path_factory.mktemp("complete"), {"hci": ["cotton"]}, variants, ("SPO", "zhou")))


@pytest.mark.parametrize("parts", [False, True])
def test_numbers_read_only_their_declared_inputs(parts: bool, complete: Plan, tmp_path: Path) -> None:
    """The workflow collects the numbers when their declared inputs are there; they must not need another."""
    found = collect(linked(complete, tmp_path, parts), parts=parts)
    assert set(found["tables"]) == {name for name in TABLES if (name in PARTS_TABLES) == parts}


@pytest.mark.parametrize("parts", [False, True])
def test_numbers_read_all_their_declared_inputs(parts: bool, complete: Plan, tmp_path: Path) -> None:
    """An input that is not read would make the workflow run again for nothing."""
    there = linked(complete, tmp_path, parts)
    for path in there.number_inputs(parts):
        away = path.rename(path.with_name("away"))
        with pytest.raises(SepiError, match=re.escape(str(path))):
            collect(there, parts=parts)
        away.rename(path)


def test_best_has_its_columns_and_an_ablation_of_its_own(tmp_path: Path) -> None:
    """The default variant must be seen beside the paper's; its reduced variants do not crowd the other tables."""
    variants = VARIANTS | {name: pipeline.VARIANTS[name].choices for name in ("best", "best_wls")}
    made = with_results(Plan(tmp_path / "results", {"hci": ["cotton", "picture"]}, variants))
    write_tables(made, tmp_path / "reports")
    mse = only(rows_of(tmp_path / "reports", "table1_mse"), dataset="hci", scene="Cotton")
    assert (mse["ours_best"], mse["ours"], mse["zhou"]) == ("0.2500", "1.0000", "1.20")
    assert (mse["ratio_best"], mse["ratio"]) == ("0.2083", "0.8333")
    assert (
        "| this code, best | this code, paper | best / published | paper / published | Zhou et al."
        in (tmp_path / "reports/table1_mse.md").read_text()
    )
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
    # of each scene: scores, times of nine stages, the light field, and the paper's final maps
    assert len(plan.number_inputs()) == 5 * (1 + 1 + 3 * 3 - 1 + 2)


def test_a_stage_that_hands_its_maps_on_has_no_file_but_scores(plan: Plan) -> None:
    """Choice none is no job: what is asked for after it is the file before, and its time is nothing."""
    initial = plan.stage_file("hci", "cotton", "paper", "initial")
    assert plan.stage_file("hci", "cotton", "no_occlusion", "occlusion") == initial
    assert plan.stage_file("hci", "cotton", "no_occlusion", "textureless") == (
        plan.results / "hci/cotton/stages/sepi/none/lti/textureless.h5"
    )
    numbers_of = Runs(collect(plan))
    scores, handed_on = (
        numbers_of.scores("hci", "cotton", "no_occlusion", stage) for stage in ("initial", "occlusion")
    )
    assert handed_on == scores
    assert numbers_of.timing("hci", "cotton", "no_occlusion", "occlusion").seconds == 0
    assert numbers_of.timing("hci", "cotton", "no_occlusion", "optimize").seconds == 1.5


def test_a_map_without_scores_is_named(plan: Plan, tmp_path: Path) -> None:
    """Scores of an earlier configuration, say: a table must not go on without a row."""
    there = linked(plan, tmp_path / "results", False)
    path = there.scores_file("hci", "cotton")
    scored = read_evaluations(path)
    path.unlink()
    write_scores(path, {"sepi": scored["sepi"]}, {"scene": "cotton"})
    with pytest.raises(SepiError, match=r"cotton/scores.h5: no scores of 'sepi/half_sepi'; it holds: sepi$"):
        collect(there)


def test_the_last_stage_may_hand_its_maps_on() -> None:
    choices = {"initial": "sepi", "occlusion": "none", "textureless": "none", "optimize": "none"}
    made = Plan(Path("results"), SCENES, VARIANTS | {"mine": choices})
    assert made.stage_file("hci", "cotton", "mine", "optimize") == Path("results/hci/cotton/stages/sepi/initial.h5")
    assert made.made_by("mine", "optimize") == "initial"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("{", "plan: expected JSON"),
        ('{"scenes": {}}', "plan: expected JSON"),
        ('{"scenes": {}, "variants": {"mine": {"initial": "sepi"}}}', "no variant 'paper'"),
        ('{"scenes": [], "variants": {}}', "plan: expected JSON"),
        ('{"scenes": {"hci": "cotton"}, "variants": {}}', "plan: expected JSON"),
        ('{"scenes": {}, "variants": {"paper": {}}, "external": "SPO"}', "plan: expected JSON"),
    ],
)
def test_a_wrong_plan_is_a_clear_error(text: str, message: str) -> None:
    with pytest.raises(SepiError, match=message):
        Plan.from_json(Path("results"), text)


def test_a_plan_comes_back_from_its_text(plan: Plan) -> None:
    """External may be left out, as in the plans that only draw pictures."""
    whole = replace(plan, scenes={"hci": ("cotton",)}, external=("SPO", "a b"))
    assert Plan.from_json(plan.results, whole.to_json()) == whole
    without = {key: value for key, value in whole.content().items() if key != "external"}
    assert Plan.from_json(plan.results, json.dumps(without)).external == ()
    assert whole.external_file("hci", "cotton") == plan.results / "hci/cotton/external.h5"
    assert whole.external_file("hci", "cotton") in whole.map_inputs("hci", "cotton")


@pytest.mark.parametrize("ending", ["lightfield.h5", "scores.h5", "time.json", "optimize.h5", "external.h5"])
@pytest.mark.parametrize("content", [None, b"", b"[1]"])
def test_a_missing_or_broken_file_is_one_line(
    ending: str, content: bytes | None, complete: Plan, tmp_path: Path
) -> None:
    there = linked(complete, tmp_path / "results", False)
    path = next(path for path in there.number_inputs() if path.name.endswith(ending))
    path.unlink()
    if content is not None:
        path.write_bytes(content)
    arguments = ["--results", str(there.results), "--plan", there.to_json(), "--output", str(tmp_path / "out.json")]
    result = CliRunner().invoke(numbers.command, arguments)
    assert result.exit_code == 1
    assert result.output.startswith(f"sepi: {path}: ")
    assert len(result.output.splitlines()) == 1
    assert not (tmp_path / "out.json").exists()


@pytest.mark.parametrize(
    ("content", "arguments", "message"),
    [
        (None, [], "cannot be read"),
        ("{", [], "not JSON"),
        ('{"plan": {}}', [], "not the numbers of a report"),
        (
            '{"plan": {}, "scenes": [], "tables": {"runtime": {}}}',
            ["--table", "ablation_best"],
            "no table 'ablation_best'; it holds: runtime",
        ),
    ],
)
def test_wrong_numbers_are_one_line(content: str | None, arguments: list[str], message: str, tmp_path: Path) -> None:
    path = tmp_path / "report.json"
    if content is not None:
        path.write_text(content)
    words = ["--numbers", str(path), "--output", str(tmp_path / "out"), *arguments]
    result = CliRunner().invoke(tables.command, words)
    assert result.exit_code == 1
    assert result.output.startswith(f"sepi: {path}: {message}")
    assert len(result.output.splitlines()) == 1
    assert not (tmp_path / "out").exists()


def test_numbers_say_what_they_are_of(complete: Plan) -> None:
    found = collect(complete, {"initial": {"sepi": {"num_disparities": 9}, "structure_tensor": {"radius": 1}}})
    assert re.fullmatch(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d[+-]\d\d:\d\d", found["made"]["date"])
    assert found["made"]["libraries"]["numpy"] == np.__version__
    assert found["made"]["machine"]["cores"] > 0
    assert found["protocols"] == {"paper": 0, "benchmark": 15}
    assert found["plan"]["external"] == ["SPO", "zhou"]
    assert found["parameters"]["initial"] == {"sepi": {"num_disparities": 9}}
    (scene,) = found["scenes"]
    known = light_field("cotton")
    assert known.ground_truth is not None
    expected = {
        "grid": [3, 3],
        "shape": [SIZE, SIZE],
        "channels": 3,
        "dtype": "uint8",
        "source": "test",
        "range": [-1.5, 1.5],
        "range_source": "given",
        "ground_truth": True,
        "masks": ["occluded", "textureless"],
        "notes": [],
        "camera": None,
        "sha256": hashlib.sha256(known.views.tobytes()).hexdigest(),
        "truth_sha256": hashlib.sha256(known.ground_truth.tobytes()).hexdigest(),
    }
    assert scene["light_field"] == expected
    assert list(scene["stages"])[:2] == ["sepi", "sepi/half_sepi"]
    first = scene["stages"]["sepi"]
    assert (first["stage"], first["seconds"], first["peak_memory_mb"]) == ("initial", 1.5, 270)
    assert first["scores"]["paper"]["all"]["mse100"] == pytest.approx(16)
    assert {name: len(values) for name, values in scene["confidence"]["best"].items()} == {
        "squared": 10,
        "absolute": 10,
        "curve": 100,
        "oracle": 100,
    }
    spo = scene["external"]["SPO"]
    assert (spo["problem"], spo["source"], spo["sha256"]) == ("", "/maps/some.pfm", 64 * "a")
    assert spo["scores"]["benchmark"]["all"]["mse100"] == pytest.approx(4)


def test_numbers_of_the_parts_hold_only_these(complete: Plan) -> None:
    (scene,) = collect(complete, parts=True)["scenes"]
    assert set(scene) == {"dataset", "scene", "stages"}
    assert set(scene["stages"]) == {
        *(complete.stage_key("best", stage) for stage in complete.stages),
        complete.stage_key("best_wls", "optimize"),
    }
    assert [stage["scores"] is None for stage in scene["stages"].values()] == [True, True, True, False, False]


def test_a_score_over_no_pixels_is_null_and_comes_back(plan: Plan) -> None:
    """JSON has no NaN; a browser refuses a file that does."""
    found = json.loads(numbers.as_text(collect(plan)), parse_constant=pytest.fail)
    (flat,) = [scene for scene in found["scenes"] if scene["scene"] == "flat"]
    assert flat["stages"]["sepi"]["scores"]["paper"]["occluded"]["mse100"] is None
    assert np.isnan(Runs(found).final("builtin", "flat", "mse100", "occluded"))
    cells = cells_of(found, "table4_ablation", "builtin", "flat")
    assert (cells["paper"]["text"], cells["paper"]["value"]) == ("4.00/n/a/4.00", 4)


def test_numbers_are_the_same_text_each_time(plan: Plan) -> None:
    """All but when and where they were made; a difference shows one scene or score per line."""
    one, two = (numbers.as_text(collect(plan) | {"made": {}}) for _ in range(2))
    assert one == two
    assert re.search(r'^ +"all": \{"mse100": .*"pixels": 1600\},?$', one, re.MULTILINE)


@pytest.mark.parametrize("table", [name for name in TABLES if name not in PARTS_TABLES])
def test_the_page_and_the_tables_show_the_same(table: str, imported: dict[str, Any]) -> None:
    """The HTML page shows what JSON says, a paper what LaTeX says: no figure may differ."""
    report = report_of(imported, table)
    shown = imported["tables"][table]
    assert shown == json.loads(json.dumps(as_json(report)))
    assert {"title", "caption", "sections"} == set(shown)
    rows = table_rows(as_markdown(report))
    signs = {"best": "**", "second": "*", None: ""}
    expected = []
    for section in shown["sections"]:
        expected.append([column["head"] for column in section["columns"]])
        expected += [
            [f"{signs[c['mark']]}{c['text']}{signs[c['mark']]}" for c in row["cells"]] for row in section["rows"]
        ]
    plain = [[cell.strip().replace("\\", "") for cell in row] for row in rows if not row[0].startswith(" ---")]
    assert plain == expected
    in_latex = [line for line in as_latex(report, table).splitlines() if line.endswith(r"\\")]
    assert [line.count(" & ") + 1 for line in in_latex] == [len(row) for row in expected]


def test_cells_say_their_kind(imported: dict[str, Any]) -> None:
    """The page colours and sorts by it."""
    cells = cells_of(imported, "table1_mse", "hci", "Cotton")
    best = {"text": "0.25", "value": pytest.approx(0.25), "kind": "ours", "mark": BEST}
    assert cells["this code, best"] == best
    assert cells["best / published"] == {
        "text": "0.21",
        "value": pytest.approx(0.25 / 1.2),
        "kind": "ratio",
        "mark": None,
    }
    assert cells["Mishiba et al."] == {"text": "0.91", "value": 0.91, "kind": "published", "mark": SECOND}
    assert cells["SPO (imported)"] == {"text": "4.00", "value": pytest.approx(4), "kind": "imported", "mark": None}
    assert cells["odd|_name_ (imported)"]["text"] == "80x40 instead of 40x40"
    assert cells["odd|_name_ (imported)"]["value"] is None
    rows = [row for section in imported["tables"]["table1_mse"]["sections"] for row in section["rows"]]
    at_hand = {row["cells"][0]["text"] for row in rows if row["at_hand"]}
    assert at_hand == {"Cotton", "mine", "dots", "Average of 1 scene available", "Average of 2 scenes available"}
    assert {row["kind"] for row in rows} == {"scene", "average", "average printed"}


def test_imported_maps_stand_beside_ours(imported: dict[str, Any]) -> None:
    """A method whose name is that of a published column does not take its place."""
    rows = csv_rows(imported, "table1_mse")
    cotton = only(rows, dataset="hci", scene="Cotton")
    assert (cotton["SPO"], cotton["zhou (imported)"], cotton["zhou"]) == ("4.0000", "0.0400", "1.20")
    mine = only(rows, dataset="hci", scene="mine")
    assert (mine["SPO"], mine["zhou (imported)"], mine["odd|_name_"]) == (NO_FILE, "0.1600", "not readable")
    average = only(rows, dataset="hci", row="average")
    assert (average["SPO"], average["zhou (imported)"], average["odd|_name_"]) == ("", "0.1000", "")
    assert only(rows, dataset="hci", scene="Antinous")["SPO"] == ""


def test_imported_maps_in_the_other_tables(imported: dict[str, Any]) -> None:
    """An average over fewer scenes than ours would not compare: the cell says how many there are."""
    regions = csv_rows(imported, "table3_regions")
    assert only(regions, method="SPO")["hci_textureless"] == "1 of 2 scenes"
    assert only(regions, method="SPO")["builtin_textureless"] == NO_FILE
    assert only(regions, method="odd|_name_")["hci_occluded"] == "0 of 2 scenes"
    assert only(regions, method="zhou (imported)")["hci_textureless"] == "0.1000"
    stages = [row for row in csv_rows(imported, "stages") if row["stage"] == "imported"]
    for protocol, pixels in (("paper", "1600"), ("benchmark", "100")):
        row = only(stages, scene="cotton", variant="SPO", protocol=protocol, region="all")
        assert (row["mse100"], row["badpix007"], row["pixels"]) == ("4.0000", "100.0000", pixels)
    missing = only(stages, scene="mine", variant="SPO", protocol="paper", region="occluded")
    assert (missing["mse100"], missing["pixels"]) == (NO_FILE, "")
    assert not [row for row in stages if row["scene"] == "picture"]
    assert "| SPO | imported | 4.00 | 20.00 | 100.00 |" in as_markdown(report_of(imported, "stages"))


def test_methods_have_no_column_for_data_sets_they_have_nothing_of(imported: dict[str, Any]) -> None:
    """But one without any file at all has columns: a mistyped folder must be seen."""
    cells = cells_of(imported, "table1_mse", "builtin", "dots")
    assert list(cells) == ["scene", "this code, best", "this code, paper"]
    found = copy.deepcopy(imported)
    for scene in found["scenes"]:
        scene["external"]["SPO"] |= {"problem": NO_FILE, "scores": {}}
    found["tables"] = {"table1_mse": as_json(report_of(found, "table1_mse"))}
    assert cells_of(found, "table1_mse", "builtin", "dots")["SPO (imported)"]["text"] == NO_FILE


def test_best_and_second_best_are_marked_as_in_the_paper(imported: dict[str, Any]) -> None:
    """Boxes and Dino are in colour in the paper's table 1. Learned and imported methods are not ranked."""

    def marked(heading: str, row: str) -> dict[str, str]:
        cells = cells_of(imported, "table1_mse", heading, row)
        return {head: cell["mark"] for head, cell in cells.items() if cell["mark"]}

    assert marked("hci", "Boxes") == {"Zhou et al. (SEPI)": BEST, "Han et al. (OAVC)": SECOND}
    assert marked("hci", "Dino") == {"Han et al. (OAVC)": BEST, "Zhang et al. (SPO)": SECOND}
    assert marked("hci", "Cotton") == {"this code, best": BEST, "Mishiba et al.": SECOND}
    assert marked("hci", "Average as printed (24 scenes)") == {"Zhou et al. (SEPI)": BEST, "Zhang et al. (SPO)": SECOND}
    assert marked("builtin", "dots") == {"this code, best": BEST, "this code, paper": SECOND}
    # Buddha: 0.45, then twice 0.48
    assert list(marked("hci_2013", "Buddha").values()) == [SECOND, SECOND, BEST]


def test_regions_are_ranked_over_the_same_scenes_only(imported: dict[str, Any]) -> None:
    """Our average over two easy scenes must not beat the paper's over all of its 24."""
    rows = {
        row["cells"][0]["text"]: row["cells"] for row in imported["tables"]["table3_regions"]["sections"][0]["rows"]
    }
    heads = [column["head"] for column in imported["tables"]["table3_regions"]["sections"][0]["columns"]]
    column = heads.index("hci, textureless")
    marks = {name: cells[column]["mark"] for name, cells in rows.items() if cells[column]["mark"]}
    assert rows["this code, best"][column]["value"] < 3.9
    assert marks == {"Zhou et al. (SEPI)": BEST, "Zhang et al. (SPO)": SECOND}
    marks = {name: cells[heads.index("builtin, occluded")]["mark"] for name, cells in rows.items()}
    assert (marks["this code, best"], marks["this code, paper"]) == (BEST, SECOND)


@pytest.mark.parametrize(
    ("values", "expected"),
    [
        ([3, 1, 2], [None, BEST, SECOND]),
        ([0.4849, 0.4751, 0.9], [BEST, BEST, SECOND]),
        ([0.474, 0.476], [BEST, SECOND]),
        ([1, 1, 1], [BEST, BEST, BEST]),
        ([2, 1, 2], [SECOND, BEST, SECOND]),
        ([None, 5, float("nan"), 4], [None, SECOND, None, BEST]),
        ([None, 5, None], [None, None, None]),
        ([], []),
    ],
)
def test_marks_follow_the_printed_figures(values: list[float | None], expected: list[str | None]) -> None:
    """What looks equal is marked alike, and a lone figure not at all."""
    assert ranks(values) == expected


def renamed(value: Any, names: dict[str, str]) -> Any:
    if isinstance(value, dict):
        return {names.get(key, key): renamed(inner, names) for key, inner in value.items()}
    if isinstance(value, list):
        return [renamed(inner, names) for inner in value]
    return names.get(value, value) if isinstance(value, str) else value


def test_no_name_of_the_users_breaks_a_table(imported: dict[str, Any]) -> None:
    """Folders may have any name."""
    scene, method = "_a_ | b\\|c\n<img> *d* `e` & [f](g) #1 ~~h~~", 'x,"y"; | 50 % $z^2$ {\\end}'
    found = renamed(imported, {"mine": scene, "SPO": method})
    for name in TABLES:
        if name in PARTS_TABLES:
            continue
        report = report_of(found, name)
        sections = iter(report.page)
        for line in as_markdown(report).splitlines():
            if line.startswith("|"):
                # what is escaped is no markup
                bare = re.sub(r"\\.", "", line).replace("**", "").replace("*", "")
                assert not re.search(r"[<>`\[\]&~\\]|(?<!\w)_|_(?!\w)", bare), line
                if not bare.strip("| -:"):
                    assert bare.count("|") == len(next(sections).grid.columns) + 1
        assert next(sections, None) is None
        rows = list(csv.reader(as_csv(report.data).splitlines(keepends=True)))
        assert {len(row) for row in rows} == {len(report.data.columns)}
    assert only(csv_rows(found, "table1_mse"), scene=scene)[method] == NO_FILE


def test_pictures_of_a_scene(plan: Plan, tmp_path: Path) -> None:
    run(figures.command, plan, tmp_path, "--dataset", "hci", "--scene", "cotton")
    written = {str(path.relative_to(tmp_path)) for path in tmp_path.rglob("*.png")}
    common = {
        "overview.png",
        "reference_view.png",
        "ground_truth.png",
        "occluded_ground_truth.png",
        "textureless_ground_truth.png",
    }
    stages = {"1_initial", "2_occlusion", "3_textureless", "4_optimize"}
    each = stages | {"error", "confidence", "occluded", "textureless", "superpixels"}
    common |= {"paper/sparsification.png", "pixels.png"}
    common |= {f"{variant}/change.png" for variant in VARIANTS if variant != "paper"}
    assert written == common | {f"{variant}/{name}.png" for variant in VARIANTS for name in each}
    view = cv2.imread(str(tmp_path / "reference_view.png"))[:, :, ::-1]
    np.testing.assert_array_equal(view, light_field("cotton").views[1, 1])


def test_pictures_without_ground_truth(plan: Plan, tmp_path: Path) -> None:
    """A real picture: maps, but neither truth nor errors."""
    run(figures.command, plan, tmp_path, "--dataset", "hci", "--scene", "picture")
    written = {path.stem for path in tmp_path.rglob("*.png")}
    assert {"overview", "reference_view", "4_optimize"} <= written
    assert not written & {"ground_truth", "error", "occluded_truth", "textureless_truth"}


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
