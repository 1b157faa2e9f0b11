"""The rules, as Snakemake reads them: what would leave stale results, or jobs that a cluster ends, without a word."""

import os
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from snakemake.iocontainers import Wildcards
from workflow_copy import REPOSITORY, TINY, Workflow

from sepi.errors import SepiError
from sepi.registry import added
from sepi.report.plan import PUBLISHED
from sepi.variants import HANDED_ON, STAGES, VARIANTS
from sepi.workflow.code_digest import code_digest, stage_modules
from sepi.workflow.config import load_settings
from sepi.workflow.settings import MOST_ON_PAGE, Report

pytestmark = pytest.mark.workflow

BEST = VARIANTS["best"].choices


def scene(**labels: str) -> Wildcards:
    names = {"dataset": "builtin", "scene": "dots", "which": "", "report": "", "variant": "best", "world": "sticks"}
    names |= BEST | labels
    return Wildcards(fromdict=names)


@pytest.fixture(scope="module")
def read(tmp_path_factory: pytest.TempPathFactory) -> Any:
    """The workflow with a light field of one's own, and maps of another method, of which one is there."""
    root = tmp_path_factory.mktemp("rules")
    (root / "maps").mkdir()
    (root / "maps/dots.pfm").touch()
    maps = {"there": str(root / "maps"), "absent": str(root / "nowhere")}
    for name in ("mine.npy", "truth.png", "net.onnx"):
        (root / name).touch()
    network = {"initial": {"onnx": {"model": str(root / "net.onnx")}}}
    own = {"mine": {"path": str(root / "mine.npy"), "truth": str(root / "truth.png"), "truth_scale": 0.5}}
    config = TINY | {"external": maps, "light_fields": own, "stages": TINY["stages"] | network}
    return Workflow(REPOSITORY, root / "run", config).read()


def needs(folder: Path, size: int, attempt: int = 1, **more: Any) -> tuple[int, dict[str, dict[str, int]]]:
    """Threads of the first stage for a built-in scene of this size; of some rules the memory and minutes of a job."""
    config = {"builtin": {"scenes": ["dots"], "size": size}, **more}
    rules = {rule.name: rule.resources for rule in Workflow(REPOSITORY, folder / "run", config).read().rules}
    asked = {
        name: {key: rules[name][key].evaluate(scene(), attempt=attempt).value for key in ("mem_mb", "runtime")}
        for name in ("ingest", "initial", "occlusion", "optimize", "export")
    }
    return rules["initial"]["_cores"].evaluate(scene()).value, asked


def test_every_job_is_made_again_for_its_own_code(read: Any) -> None:
    """A rule without the digest of its command would keep what earlier code made."""
    checked = set()
    for rule in read.rules:
        command = re.search(r"-m (sepi[\w.]*)", rule.shellcmd or "")
        if command is None:
            continue
        checked.add(rule.name)
        params = dict(rule.params.items())
        main = command[1] + params.get("stage", "")
        assert rule.name not in STAGES or main == f"sepi.{rule.name}"
        code = params.get("code")
        for name, chosen in STAGES.get(rule.name, {"": None}).items():
            if name == HANDED_ON:
                continue
            modules = (main,) if chosen is None else stage_modules(rule.name, chosen)
            if rule.name == "maps":
                modules = (main, *added("scenes").values())
            if rule.name == "ingest":
                modules = ("sepi.ingest", "sepi.scenes.light_field")
            if rule.name == "render":
                modules = tuple(f"sepi.extensions.rendered.{name}" for name in ("rendering", "worlds.sticks"))
            if rule.name == "truth":
                modules = ("sepi.truth", "sepi.scenes.light_field")
            given = code(scene(**{rule.name: name})) if callable(code) else code
            assert given == code_digest(*modules), f"{rule.name} {name}"
    others = {"ingest", "truth", "evaluate", "export", "external", "numbers", "maps", "page", "render"}
    assert {*STAGES, *others} <= checked


def test_every_file_that_a_job_reads_is_an_input(read: Any) -> None:
    """A new picture, a published figure that was mended, a map of another method, a template: none would be seen.

    Those of the user's are seen by size and date: what another program unpacks has an old one.
    """
    rules = {rule.name: rule for rule in read.rules}
    mine = scene(dataset="own", scene="mine", initial="onnx")
    for rule, kind, of, name in (
        ("ingest", "files", mine, "mine.npy"),
        ("truth", "files", mine, "truth.png"),
        ("initial", "files", mine, "net.onnx"),
        ("external", "maps", scene(), "maps/dots.pfm"),
    ):
        (file,) = getattr(rules[rule].input, kind)(of)
        assert file.endswith(name)
        before = rules[rule].params.dates(of)
        assert rules[rule].params.dates(of) == before
        os.utime(file, ns=(0, 1))
        older = rules[rule].params.dates(of)
        Path(file).write_text("more")
        os.utime(file, ns=(0, 1))
        assert len({before, older, rules[rule].params.dates(of)}) == 3
    for name in ("numbers", "page"):
        assert {Path(file) for file in rules[name].input.published} == set(PUBLISHED.glob("*.csv"))
    assert {Path(file) for file in rules["page"].input.templates} == set(
        (REPOSITORY / "sepi/extensions/page/templates").iterdir()
    )


def test_the_page_can_be_left_out_and_is_by_itself_where_there_are_too_many_scenes(tmp_path: Path) -> None:
    """Nothing of it is made then, and whoever asks for it is told in one line."""
    for page in (True, False):
        planned = Workflow(REPOSITORY, tmp_path / "run", TINY | {"report": {"page": page}}).plan("all")
        assert ("page" in planned) == page
    settings = load_settings({"report": {"page": False}})
    with pytest.raises(SepiError, match=r"^reports/index.html: not made: report.page is false; true asks for it$"):
        settings.require_target("reports/index.html")
    scenes = {("own", str(number)): None for number in range(MOST_ON_PAGE)}
    many = replace(settings, scenes=scenes, report=Report())
    assert many.has_page
    assert not replace(many, scenes=scenes | {("own", "one"): None}).has_page


@pytest.mark.parametrize(
    ("target", "wrong", "meant"),
    [
        ("results/builtin/dotz/paper/result.h5", "dotz", "dots"),
        ("reports/comparison/page/bultin/dots.json", "bultin", "builtin"),
    ],
)
def test_a_wrong_scene_in_a_target_is_told(target: str, wrong: str, meant: str) -> None:
    """Snakemake would show a dozen lines of its own, or of Python."""
    settings = load_settings({})
    with pytest.raises(SepiError, match=f"unknown '{wrong}'; did you mean '{meant}'"):
        settings.require_target(target)
    settings.require_target(target.replace(wrong, meant))


def test_jobs_ask_for_what_their_scene_takes(tmp_path: Path) -> None:
    """Of one thread alone, a benchmark scene takes three times as long; a cluster ends jobs that ask for too little."""
    assert [needs(tmp_path, size)[0] for size in (64, 512, 1024)] == [1, 3, 8]
    once, again = (needs(tmp_path, 512, attempt)[1] for attempt in (1, 2))
    for rule, asked in once.items():
        assert all(again[rule][name] == 2 * asked[name] > 0 for name in ("mem_mb", "runtime"))
    # candidates of a wide range need memory and time
    many = needs(tmp_path, 512, stages={"initial": {"semi_global": {"num_disparities": 911}}})[1]["initial"]
    assert many["mem_mb"] - once["initial"]["mem_mb"] >= 800 * 4 * 512 * 512 / 2**20
    assert many["runtime"] > 2 * once["initial"]["runtime"]


def test_no_command_grows_with_the_number_of_scenes(tmp_path: Path) -> None:
    """The system takes 128 kB for one: thousands of light fields would end with `Argument list too long`."""
    report = {"plan", "numbers", "page"}
    one, three = (
        {
            job.rule.name: job.shellcmd
            for job in Workflow(REPOSITORY, tmp_path / "run", {"builtin": {"scenes": names}}).jobs("all")
            if job.rule.name in report
        }
        for names in (["dots"], ["dots", "wall", "stripes"])
    )
    assert one.keys() == report
    assert one == three
