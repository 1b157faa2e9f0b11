"""The workflow, run for real on a tiny scene: what it makes, and above all what it makes again and what not.

One complete run is shared by the tests; most of them then only ask Snakemake what it would do (a dry run).
"""

import copy
import csv
import json
import os
import re
import shutil
import signal
import sys
from collections import Counter
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hostile_names import FOLDER
from pydantic import ValidationError
from small_networks import convolution
from snakemake_runs import begin_snakemake
from workflow_copy import (
    REPOSITORY,
    SIZE,
    SLOW_WRITING,
    TINY,
    Workflow,
    copy_of_the_project,
    edited,
    files_below,
    of_stages,
    wait_for,
)

from sepi.io.disparity_maps import write_pfm
from sepi.io.hdf5 import read_attributes, read_stage
from sepi.io.images import write_png
from sepi.io.result_folder import read_result
from sepi.io.scores import Evaluation, read_evaluations, write_scores
from sepi.pipeline import estimate_depth
from sepi.reading import read_light_field
from sepi.report.plan import TABLES
from sepi.scenes import render, write_hci
from sepi.variants import STAGES, VARIANTS, compared_methods, needing_files

pytestmark = pytest.mark.workflow

# the paper's six variants and best; stage files that variants share are made once, choice none is no job
COMPLETE = {"ingest": 1, "initial": 4, "occlusion": 5, "textureless": 6, "optimize": 8}
# the variant of the fewest stages
QUICK = "no_occlusion_no_textureless"
# what the ablation of best asks for beyond that
PARTS = {"initial": 2, "occlusion": 10, "textureless": 11, "optimize": 16}
# the target also makes the paper's maps with costs as noise makes them, which nothing shares
ABLATION = {rule: n + 1 for rule, n in PARTS.items()}


@pytest.fixture(scope="module")
def workflow(tmp_path_factory: pytest.TempPathFactory) -> Workflow:
    """The workflow on a folder of pictures with ground truth, without parameters, not yet run."""
    inside = tmp_path_factory.mktemp("workflow") / FOLDER
    scene = inside / "my scenes" / "training" / "box"
    write_hci(render("curved_occluders", size=SIZE, views=5), scene)
    (scene / "parameters.cfg").unlink()
    config = TINY | {"builtin": {"scenes": []}, "hci_root": str(inside / "my scenes"), "bad_thresholds": [0.25]}
    return Workflow(REPOSITORY, inside / "fresh", config)


# names that methods may have: all that a shell, Snakemake or a page could take for something else, in few of them
NAMED = [
    """it's "so" \\ %s $HOME ~ * ? $(touch hacked) `touch hacked`""",
    "a;touch hacked&touch hacked|touch hacked >hacked",
    "{scene}{wildcards.scene}{{a}}",
    "<script>hacked()<img src=x onerror=hacked()>&amp;",
    "--help",
]


@pytest.fixture(scope="module")
def external(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """Maps of other methods for the scene, right and wrong, and a method without any; name to folder."""
    folder = tmp_path_factory.mktemp("maps")
    ground_truth = render("curved_occluders", size=SIZE, views=5).ground_truth
    good = ground_truth + np.float32(0.1)
    holed = good.copy()
    holed[:10] = np.nan
    for method, values in {"good": good, "holed": holed, "small": ground_truth[:40]}.items():
        (folder / method).mkdir()
        np.save(folder / method / "box.npy", values)
    methods = {name: str(folder / name) for name in ("good", "holed", "small", "absent")}
    return methods | dict.fromkeys(NAMED, methods["good"])


# in place of Python: a stage's maps are the paper's
STAND_IN = """#!/bin/sh
case "$2" in
    {stages}) ;;
    *) exec {python} "$@" ;;
esac
for word; do
    case "$before" in
        --output) cp {made}.h5 "$word" ;;
        --timing) cp {made}.time.json "$word" ;;
    esac
    before=$word
done
"""


@pytest.fixture(scope="module")
def finished(workflow: Workflow, external: dict[str, str], tmp_path_factory: pytest.TempPathFactory) -> Workflow:
    """The workflow after ``snakemake all``, with other methods' maps; its output is in the file stdout.

    The stages of the paper's variant and of ``best`` are run for real.
    """
    done = replace(workflow, folder=workflow.folder.with_name("finished")).with_config(external=external)
    first = done.run(*(f"results/hci/box/{name}/result.h5" for name in ("paper", "best")))
    assert first.returncode == 0, first.stdout
    program = tmp_path_factory.mktemp("programs") / "python"
    stages = "|".join(f"sepi.{stage}" for stage in STAGES)
    made = "results/hci/box/stages/sepi/half_sepi/lti/wls/optimize"
    program.write_text(STAND_IN.format(stages=stages, python=sys.executable, made=made))
    program.chmod(0o700)
    second = done.run("all", python=str(program))
    assert second.returncode == 0, second.stdout
    (done.folder / "stdout").write_text(first.stdout + second.stdout)
    return done


class TestAll:
    def test_tables_and_maps_are_made_and_named(self, finished: Workflow) -> None:
        """The run's last words tell a newcomer where to look."""
        stdout = (finished.folder / "stdout").read_text()
        for name in ("disparity.pfm", "result.h5", "disparity.png", "confidence.png"):
            assert (finished.folder / "results/hci/box/paper" / name).stat().st_size > 0
        assert "\n  results/hci/box/paper/\n" in stdout
        tables = sorted((finished.folder / "reports").glob("table*.md"))
        assert len(tables) == 4
        for table in tables:
            assert f"\n  reports/{table.name}\n" in stdout

    def test_stage_files_say_what_made_them(self, finished: Workflow) -> None:
        last = finished.folder / "results/hci/box/stages/sepi/half_sepi/lti/wls/optimize.h5"
        attributes = read_attributes(last)
        assert attributes["disparity_range_source"] == "estimated"
        assert (attributes["stage"], attributes["choice"], attributes["scene"]) == ("optimize", "wls", "box")
        before = json.loads(attributes["made_from"])
        made = [("initial", "sepi"), ("occlusion", "half_sepi"), ("textureless", "lti")]
        assert [(step["stage"], step["choice"]) for step in before] == made
        assert before[0]["parameters"]["num_disparities"] == 21
        assert read_stage(last).disparity.shape == (SIZE, SIZE)

    def test_again_does_nothing(self, finished: Workflow) -> None:
        assert finished.plan("all") == {}

    def test_scenes_go_in_batches(self, finished: Workflow) -> None:
        """Thousands of light fields do not fit one plan; what they share is left to `all`."""
        assert finished.plan("scenes") == {"scene": 1, "scenes": 1}
        more = finished.with_config(builtin={"scenes": ["dots"], "size": SIZE})
        first = more.run("scenes", flags=("--dry-run", "--batch", "scenes=1/2"))
        assert first.returncode == 0, first.stdout
        assert [f"{name}: complete" in first.stdout for name in ("hci/box", "builtin/dots")] in (
            [True, False],
            [False, True],
        )


def other_parameters(stage: str, choice: str) -> dict[str, Any]:
    """One parameter of a choice with a value that is not its default."""
    model = STAGES[stage][choice].parameters
    defaults = model()
    for name in model.model_fields:
        value = getattr(defaults, name)
        candidates = [not value] if isinstance(value, bool) else []
        if isinstance(value, int | float) and not isinstance(value, bool):
            candidates = [value + 1, value - 1, value * 0.9, value * 1.1, value + 2]
        for other in candidates:
            try:
                if model(**{name: other}) != defaults:
                    return {name: other}
            except ValidationError:
                continue
    pytest.fail(f"{stage}.{choice} has no number to change")


# the jobs that a change in each stage's choice asks for, over all seven variants
RERUNS = {
    ("initial", "sepi"): {"initial": 1, "occlusion": 2, "textureless": 3, "optimize": 5},
    ("occlusion", "half_sepi"): {"occlusion": 2, "textureless": 2, "optimize": 3},
    ("occlusion", "wang"): {"occlusion": 1, "textureless": 1, "optimize": 1},
    ("textureless", "lti"): {"textureless": 4, "optimize": 4},
    ("optimize", "wls"): {"optimize": 6},
    ("initial", "semi_global"): {"initial": 2, "occlusion": 2, "textureless": 2, "optimize": 2},
    ("occlusion", "visibility"): {"occlusion": 2, "textureless": 2, "optimize": 2},
    ("textureless", "uniform_planes"): {"textureless": 2, "optimize": 2},
    ("optimize", "second_order"): {"optimize": 2},
}
# changed at once: no variant has two of these, so their jobs add up
CHANGED = [
    [("initial", "sepi"), ("initial", "semi_global")],
    [("occlusion", "wang"), ("occlusion", "visibility")],
    [("occlusion", "half_sepi"), ("textureless", "uniform_planes")],
    [("textureless", "lti"), ("optimize", "second_order")],
    [("optimize", "wls")],
]


class TestRerun:
    @pytest.mark.parametrize("changed", CHANGED)
    def test_a_changed_parameter_reruns_what_follows(self, finished: Workflow, changed: list[tuple[str, str]]) -> None:
        assert {one for some in CHANGED for one in some} == RERUNS.keys()
        stages = copy.deepcopy(TINY["stages"])
        expected: Counter[str] = Counter()
        for stage, choice in changed:
            stages.setdefault(stage, {}).setdefault(choice, {}).update(other_parameters(stage, choice))
            expected.update(RERUNS[stage, choice])
        assert finished.with_config(stages=stages).stage_plan("all") == expected

    def test_changed_code_reruns_what_follows_and_a_comment_nothing(self, finished: Workflow, tmp_path: Path) -> None:
        sepi = copy_of_the_project(tmp_path / "tree") / "sepi"
        changed = replace(finished, tree=sepi.parent)
        with (
            edited(sepi / "textureless.py", "\nCHOICES", "\n_MORE = 1\n\nCHOICES"),
            edited(sepi / "initial.py", "\nCHOICES", "\n# a comment\nCHOICES"),
            edited(sepi / "lightfield.py", '"""The light field', '"""A light field'),
        ):
            assert changed.stage_plan("all") == {"textureless": 6, "optimize": 6}
        with edited(sepi / "evaluate.py", "\nif __name__", "\n_MORE = 1\n\nif __name__"):
            plan = changed.plan("all")
        assert of_stages(plan) == {}
        # what is made of scores
        assert {"evaluate", "external", "numbers", "maps", "page"} <= plan.keys()

    def test_a_changed_picture_reruns_its_scene(self, finished: Workflow) -> None:
        """Also where its date is old: so unzip, rsync -a, cp -p and tar leave it."""
        picture = Path(finished.config["hci_root"]) / "training" / "box" / "input_Cam003.png"
        other = picture.with_name("input_Cam004.png")
        before, times = picture.read_bytes(), picture.stat()
        try:
            picture.write_bytes(other.read_bytes())
            os.utime(picture, (1_500_000_000, 1_500_000_000))
            plan = finished.stage_plan("all")
        finally:
            picture.write_bytes(before)
            os.utime(picture, ns=(times.st_atime_ns, times.st_mtime_ns))
        assert plan == COMPLETE

    def test_a_given_range_reruns_its_scene(self, finished: Workflow) -> None:
        assert finished.with_config(disparity_range={"hci/box": [-3, 3]}).stage_plan("all") == COMPLETE

    def test_own_variants_share_what_they_can(self, finished: Workflow) -> None:
        """What hands its maps on is no job, wherever it stands."""
        mine = {"base": "no_sepi", "occlusion": "none", "optimize": "none"}
        other = {"base": "paper", "textureless": {"tolerance": 0.1}}
        plan = finished.with_config(variants={"mine": mine, "other": other}).plan("all")
        others = {"textureless": 2, "optimize": 1, "evaluate": 1, "export": 2}
        assert {rule: plan.get(rule) for rule in [*COMPLETE, *others]} == dict.fromkeys(COMPLETE) | others

    def test_ground_truth_asks_for_scores_and_for_no_map(self, finished: Workflow) -> None:
        """Whoever measures it later must not wait for all maps again."""
        file = Path(finished.config["hci_root"]) / "training" / "box" / "gt_disp_lowres.pfm"
        before, times = file.read_bytes(), file.stat()
        try:
            write_pfm(file, render("dots", size=SIZE).ground_truth)
            plan = finished.plan("all")
        finally:
            file.write_bytes(before)
            os.utime(file, ns=(times.st_atime_ns, times.st_mtime_ns))
        # what shows the scene
        shown = {"numbers": 1, "page": 1, "all": 1}
        assert plan == {"truth": 1, "evaluate": 1, "external": 1, "maps": 1} | shown

    def test_what_is_changed_is_made_and_nothing_else(self, finished: Workflow, tmp_path: Path) -> None:
        """Overrides and a network of one's own, a changed parameter, and ground truth of one's own, in one run.

        Maps by overrides lie beside those of the choice as it is. The scores of a scene are one job, whatever changed
        of it. Ground truth in levels with a scale, some of them unknown, is what maps are held to.
        """
        shutil.copytree(finished.folder, tmp_path / "run", symlinks=True)
        scene = tmp_path / "run/results/own/box"
        (tmp_path / "run/results/hci").rename(scene.parent)
        (scene / "truth.h5").unlink()
        levels = np.full((SIZE, SIZE), 4, np.uint16)
        levels[:10] = 0
        write_png(tmp_path / "truth.png", levels)
        views = Path(finished.config["hci_root"]) / "training" / "box"
        entry = {"path": str(views), "truth": str(tmp_path / "truth.png"), "truth_scale": 0.125}
        path = convolution(tmp_path / "net.onnx", np.full((1, 25, 1, 1), 0.04))
        inputs = {"choice": "onnx", "model": str(path), "inputs": ["all: 1 (t s) y x"], "grey": True, "grid": [5, 5]}
        variants = {
            "mine": {"base": QUICK, "optimize": {"tau_2": 1, "alpha": 1e-5}},
            "network": {"initial": inputs, "occlusion": "none", "textureless": "none", "optimize": "none"},
        }
        run = replace(finished, folder=tmp_path / "run").with_config(
            hci_root=None, variants=variants, light_fields={"box": entry}
        )
        # what an earlier file says is nothing to go by
        before = read_evaluations(scene / "scores.h5")
        write_scores(
            scene / "scores.h5", {name: Evaluation({"paper": {"all": {"mse100": 7.0}}}) for name in before}, {}
        )
        targets = ["results/own/box/network/result.h5", "results/own/box/scores.h5"]
        assert run.plan(*targets) == {"initial": 1, "optimize": 1, "truth": 1, "evaluate": 1, "export": 1}
        result = run.run(*targets)
        assert result.returncode == 0, result.stdout
        attributes = read_attributes(scene / "stages/sepi/none/none/wls+alpha=1e-05+tau_2=1/optimize.h5")
        assert (attributes["choice"], json.loads(attributes["parameters"])["alpha"]) == ("wls", 1e-5)
        assert list(scene.glob("scores*")) == [scene / "scores.h5"]
        disparity = read_stage(scene / "stages/sepi/half_sepi/lti/wls/optimize.h5").disparity[10:]
        whole = read_evaluations(scene / "scores.h5")["sepi/half_sepi/lti/wls"].scores["paper"]["all"]
        assert whole["pixels"] == disparity.size
        assert whole["badpix_0.25"] == pytest.approx(100 * (np.abs(disparity - 0.5) > 0.25).mean())
        assert run.plan(*targets) == {}
        convolution(path, np.full((1, 25, 1, 1), 0.02))
        assert run.stage_plan(targets[0]) == {"initial": 1}
        other_scale = run.with_config(light_fields={"box": entry | {"truth_scale": 0.25}})
        assert {"truth", "evaluate"} <= other_scale.plan(targets[1]).keys()


class TestReport:
    def test_the_page_and_its_files_are_made(self, finished: Workflow) -> None:
        """What a researcher opens, and what goes into a paper."""
        reports = finished.folder / "reports"
        page = (reports / "index.html").read_text()
        assert ">hci/box</option>" in page
        assert "0.0165" in page  # a parameter of the paper's sweep
        assert all(
            (reports / f"{table}.{ending}").stat().st_size for table in TABLES[""] for ending in ("csv", "md", "tex")
        )
        # a threshold of the user's
        with (reports / "stages.csv").open(newline="") as file:
            rows = [row for row in csv.DictReader(file) if row["pixels"] != "0" and row["variant"] in VARIANTS]
        assert all(0 < float(row["badpix_0.25"]) <= float(row["badpix007"]) for row in rows if row["region"] == "all")
        assert re.search(r"BadPix 0.07 [\d.]+ %,\\nBadPix 0.25 [\d.]+ %", page)
        figures = [reports / "figures" / name for name in ("ablation", "time_and_memory", "error_bars")]
        figures += [reports / "maps/hci/box" / name for name in ("overview", "pixels", "best/sparsification")]
        for figure in figures:
            assert figure.with_suffix(".png").read_bytes().startswith(b"\x89PNG")
            assert figure.with_suffix(".pdf").read_bytes().startswith(b"%PDF")
        assert [scene["scene"] for scene in json.loads((reports / "report.json").read_text())["scenes"]] == ["box"]

    def test_what_is_asked_for_of_the_page_is_made(self, finished: Workflow) -> None:
        """A pixel redraws its scene alone; the parts of best are computed."""
        asked = finished.with_config(report={"pixels": {"hci/box": [[20, 30]]}})
        assert asked.plan("all") == {"all": 1, "maps": 1, "page": 1}
        plan = finished.with_config(report={"parts_of_best": True}).plan("all")
        assert plan["optimize"] == PARTS["optimize"]
        assert plan["page"] == 1

    def test_bad_maps_of_other_methods_stop_nothing(self, finished: Workflow, external: dict[str, str]) -> None:
        """The report still comes; the cell and a line at the end say what is wrong.

        Methods may be named by any printable text: it stands in tables and on the page, and nothing runs what is in it.
        """
        folder, stdout = finished.folder, (finished.folder / "stdout").read_text()
        with (folder / "reports/table1_mse.csv").open(newline="") as file:
            row = next(row for row in csv.DictReader(file) if (row["scene"], row["row"]) == ("box", "scene"))
        wrong = f"{SIZE}x40 instead of {SIZE}x{SIZE}"
        cells = {"good": "1.0000", "holed": "1.0000", "small": wrong, "absent": "no file"}
        cells |= dict.fromkeys(NAMED, "1.0000")
        assert {name: row[name] for name in cells} == cells
        lines = [line for line in stdout.splitlines() if line.startswith("sepi: warning: external")]
        assert any("external small, scene hci/box" in line and f"{SIZE}x40" in line for line in lines)
        assert any("external holed, scene hci/box" in line and str(10 * SIZE) in line for line in lines)
        assert "sepi: warning: external absent: no map of hci/box" in lines
        assert "| 1.00 (16 % unknown) |" in (folder / "reports/table1_mse.md").read_text()
        page = (folder / "reports/index.html").read_text()
        assert "good (external)" in page
        assert '"external/good/disparity"' in page
        assert '"external/small/disparity"' not in page
        assert not re.search("<script>hacked|<img src=x", page)
        assert external.keys() == cells.keys()
        one_more = finished.with_config(external=external | {"later": external["good"]})
        assert one_more.plan("all").keys().isdisjoint(COMPLETE)
        assert one_more.plan("all")["external"] == 1
        maps = Path(external["good"]).parent
        assert not [path for root in (maps, finished.folder.parent) for path in root.rglob("hacked")]

    def test_snakemakes_own_report_works(self, finished: Workflow) -> None:
        """For provenance: each file with its category and caption."""
        result = finished.run("all", flags=("--report", "provenance.html"))
        assert result.returncode == 0, result.stdout
        text = (finished.folder / "provenance.html").read_text()
        for word in ("Tables", "Charts", "Scenes", "table1_mse.csv", "MSE x100 with single parts of the method"):
            assert word in text


# the compared method that is run; its stages hand on a cost volume
RUN = "oavc"


class TestComparison:
    def test_the_compared_methods_are_computed_beside_what_is_there(self, finished: Workflow, tmp_path: Path) -> None:
        """Ours are not computed again, and a second run has nothing to do."""
        shutil.copytree(finished.folder, tmp_path / "run", symlinks=True)
        config = {key: value for key, value in finished.config.items() if key != "external"}
        few = {choice: {"num_disparities": 21} for choice in compared_methods()}
        config["stages"] = TINY["stages"] | {"initial": TINY["stages"]["initial"] | few}
        done = replace(finished, folder=tmp_path / "run", config=config)
        methods = {"initial": 7, "occlusion": 2, "optimize": 7}
        pictured = {"export": 7, "maps": 1, "page": 1}
        assert methods.items() | pictured.items() <= done.plan("comparison").items()
        target = "reports/comparison/methods.csv"
        assert done.stage_plan(target) == methods
        # as if all methods but one had made the paper's maps
        made = done.folder / "results/hci/box/stages/sepi/half_sepi/lti/wls/optimize"
        jobs = [job for job in done.jobs(target) if job.rule.name in STAGES and job.wildcards.initial != RUN]
        files = [file for stage in STAGES for job in jobs if job.rule.name == stage for file in job.output]
        for path in (done.folder / file for file in files):
            path.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(made.with_suffix("".join(path.suffixes)), path)
        result = done.run(target, f"results/hci/box/{RUN}/result.h5")
        assert result.returncode == 0, result.stdout
        # what its stages hand on by files is what they do in memory
        light_field = read_light_field(done.folder / "results/hci/box/lightfield.h5")
        expected = estimate_depth(light_field, RUN, parameters={"initial": few[RUN]})
        disparity = read_result(done.folder / f"results/hci/box/{RUN}/result.h5").disparity
        np.testing.assert_array_equal(disparity, expected.disparity)
        with (done.folder / target).open(newline="") as file:
            rows = {row["variant"]: row for row in csv.DictReader(file)}
        assert [*rows] == ["best", "fast", "paper", *compared_methods()]
        assert {rows[name]["mse100"] for name in compared_methods() if name != RUN} == {rows["paper"]["mse100"]}
        assert all(float(row["badpix_0.25"]) <= float(row["badpix007"]) for row in rows.values())
        assert done.plan(target) == {}


class TestTargets:
    def test_ablation_makes_all_other_variants(self, finished: Workflow) -> None:
        """What `all` has made is not made again."""
        jobs = finished.jobs("ablation")
        variants = {job.wildcards.variant for job in jobs if job.rule.name == "export"}
        assert variants == set(VARIANTS) - {*compared_methods(), *needing_files(), "best", "paper"}
        assert of_stages(Counter(job.rule.name for job in jobs)) == ABLATION


class TestConfiguration:
    def test_an_unknown_key_is_one_line_and_nothing_runs(self, workflow: Workflow) -> None:
        result = workflow.with_config(builtn={"size": 64}).run("all")
        assert result.returncode == 1
        lines = [line for line in result.stdout.splitlines() if line.startswith("sepi: ")]
        assert len(lines) == 1
        assert "unknown 'builtn'; did you mean 'builtin'?" in lines[0]
        assert "Traceback" not in result.stdout
        assert not (workflow.folder / "results").exists()

    def test_values_on_the_command_line(self, workflow: Workflow) -> None:
        """``--config`` reaches nested keys, and a folder of scenes is one word."""
        values = ("--config", "builtin={scenes: [wall, dots], size: 72}", f"hci_root={workflow.config['hci_root']}")
        bare = replace(workflow, config={})
        result = bare.run("all", flags=("--dry-run", *values))
        assert result.returncode == 0, result.stdout
        scenes = set(re.findall(r"(\w+/\w+): reading the light field", result.stdout))
        assert scenes == {"builtin/wall", "builtin/dots", "hci/box"}

    @pytest.mark.parametrize(
        ("text", "message"),
        [
            ('hci_root: !!python/object/apply:os.system ["touch made-by-yaml"]', "not valid JSON or YAML"),
            ("hci_root: [1", "not valid JSON or YAML"),
        ],
    )
    def test_yaml_builds_no_objects(self, workflow: Workflow, tmp_path: Path, text: str, message: str) -> None:
        """A configuration from someone else must not run programs."""
        (tmp_path / "other.yaml").write_text(text)
        there = replace(workflow, folder=tmp_path / "run")
        result = there.run("all", flags=("--configfile", str(tmp_path / "other.yaml")))
        assert result.returncode != 0
        assert "Traceback" not in result.stdout
        assert message in result.stdout
        assert not (there.folder / "made-by-yaml").exists()
        assert not (there.folder / "results").exists()


def test_own_light_fields_are_read_as_they_are_said_to_be(workflow: Workflow, tmp_path: Path) -> None:
    """Also those with views left out and in another order; the end tells of a wrong one and of another view's truth."""
    views = render("curved_occluders", size=SIZE, views=5).views
    even = render("dots", size=SIZE, views=4)
    write_hci(replace(even, views=even.views[::-1, ::-1].copy()), tmp_path / "even")
    np.save(tmp_path / "right.npy", views)
    np.save(tmp_path / "turned.npy", views.transpose(1, 0, 2, 3, 4))
    entries = {
        "right": {"path": str(tmp_path / "right.npy"), "exclude": ["0,0"], "view": [2, 1]},
        "turned": {"path": str(tmp_path / "turned.npy"), "order": "transpose"},
        "wrong": {"path": str(tmp_path / "turned.npy")},
        "even": {"path": str(tmp_path / "even"), "order": "flip-both"},
    }
    own = replace(workflow, folder=tmp_path / "run").with_config(hci_root=None, light_fields=entries)
    targets = [f"results/own/{name}/lightfield.h5" for name in entries]
    result = own.run(*targets, "results/own/even/truth.h5")
    assert result.returncode == 0, result.stdout
    kept = read_light_field(own.folder / "results/own/right/lightfield.h5", check_order=False)
    assert kept.reference_position == (2, 1)
    assert np.argwhere(~kept.present).tolist() == [[0, 0]]
    turned = read_light_field(own.folder / "results/own/turned/lightfield.h5", check_order=False)
    np.testing.assert_array_equal(turned.views, views)
    even, *warnings = sorted(line for line in result.stdout.splitlines() if line.startswith("sepi: warning:"))
    assert "even: its ground truth is of view 1,1" in even
    # in a wrong order little matches in any range
    assert len(warnings) == 2
    assert all("turned.npy" in warning for warning in warnings)
    assert any("--order transpose" in warning for warning in warnings)
    again = own.with_config(light_fields=entries | {"turned": entries["turned"] | {"order": "as-given"}})
    assert again.stage_plan(*targets)["ingest"] == 1


def test_a_damaged_scene_is_told_and_leaves_the_tables_of_the_others(finished: Workflow, tmp_path: Path) -> None:
    """No looking for the log; and who computed for days must not go without tables, nor take them for whole."""
    write_hci(render("dots", size=SIZE, views=3), tmp_path / "broken")
    picture = tmp_path / "broken" / "input_Cam002.png"
    picture.write_bytes(picture.read_bytes()[:100])
    shutil.copytree(finished.folder, tmp_path / "run", symlinks=True)
    # what a job that was killed some days ago had begun to write
    leftover = tmp_path / "run/results/own/broken/.truth-0123456789ab.h5"
    leftover.parent.mkdir(parents=True)
    leftover.touch()
    os.utime(leftover, (0, 0))
    run = replace(finished, folder=tmp_path / "run").with_config(
        light_fields={"broken": {"path": str(tmp_path / "broken")}}
    )
    target = "reports/table1_mse.md"
    failed = run.run(target, flags=("--keep-going",))
    assert failed.returncode != 0
    assert re.search(rf"^ *sepi: .*{picture.name}.*$", failed.stdout, re.MULTILINE)
    assert "Traceback" not in failed.stdout
    assert [path.name for path in files_below(run.folder / "results/own")] == ["truth.h5"]
    result = run.with_config(report={"partial": True}).run(target)
    assert result.returncode == 0
    assert "\nsepi: the tables are without own/broken, not computed yet\n" in result.stdout
    assert f"\n  {target}\n" in result.stdout
    table = (run.folder / target).read_text()
    assert "Without `own/broken`, not computed yet" in table
    assert "box" in table
    # the scene is given up: the table is to be whole
    assert "numbers" in replace(run, config=finished.config).plan(target)


@pytest.fixture(scope="module")
def slow(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Workflow]:
    """The workflow by a package that writes files as slowly as it is told."""
    root = tmp_path_factory.mktemp("slow")
    tree = copy_of_the_project(root / "tree")
    with edited(tree / "sepi" / "io" / "files.py", "temporary.replace(path)", SLOW_WRITING):
        yield Workflow(tree, root / "run", TINY)


@pytest.mark.parametrize("number", [signal.SIGINT, pytest.param(signal.SIGKILL, marks=pytest.mark.system)])
def test_an_interrupted_run_resumes(slow: Workflow, tmp_path: Path, number: signal.Signals) -> None:
    """Ctrl-C at the terminal, or a machine that goes down, in the middle of writing a stage file.

    Another run beside it is told that the folder is in use, and harms nothing.
    """
    there = replace(slow, folder=tmp_path / "run")
    target = "results/builtin/dots/lightfield.h5"
    light_field = there.folder / target
    environment = there.environment | {"SLEEP": "60"}
    process = begin_snakemake(there.words(target), there.folder, environment, tmp_path / "out", tmp_path / "taken")

    def begun() -> list[Path]:
        return list(light_field.parent.glob(".lightfield-*.h5"))

    wait_for(begun)
    if number == signal.SIGINT:
        second = there.run(target)
        assert second.returncode != 0
        assert "Directory cannot be locked" in second.stdout
        assert len(begun()) == 1
    # as a terminal does: to Snakemake and its jobs alike
    os.killpg(process.pid, number)
    process.join(60)
    assert process.exitcode
    assert not light_field.exists()
    if number == signal.SIGINT:
        assert files_below(there.folder / "results") == []
    else:
        unlocked = there.run(target, flags=("--unlock",))
        assert unlocked.returncode == 0, unlocked.stdout
    for path in begun():
        os.utime(path, (0, 0))
    # of a run of other targets, which may be writing it
    fresh = light_field.with_name(".lightfield-0123456789ab.h5")
    fresh.parent.mkdir(parents=True, exist_ok=True)
    fresh.touch()
    result = there.run(target)
    assert result.returncode == 0, result.stdout
    assert light_field.is_file()
    assert begun() == [fresh]
