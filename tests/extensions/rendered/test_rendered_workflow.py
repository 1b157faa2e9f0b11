"""Rendered scenes in the workflow: what the configuration names, which jobs that makes, how their files are read."""

import importlib.util
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np
import pytest
from click.testing import CliRunner
from rendered_files import write_drawn
from workflow_copy import REPOSITORY, TINY, Workflow

from sepi import ingest, truth
from sepi.errors import SepiError
from sepi.extensions.rendered.exposure import read_scene
from sepi.extensions.rendered.worlds import RENDERED
from sepi.io.hdf5 import read_light_field, read_with_truth
from sepi.scoring.scores import region_masks, score_regions
from sepi.workflow.code_digest import imported_modules
from sepi.workflow.config import load_settings
from sepi.workflow.rendered_scenes import RenderedScene, rendered_scene

MODULE = "sepi.extensions.rendered.exposure"
TWO = {"scenes": ["sticks", "room"], "noise": [False, "low"], "seeds": 2, "size": 64, "views": 3, "variants": ["best"]}


def test_scenes_are_named_by_noise_and_seed() -> None:
    """YAML reads a bare ``off`` as false; without noise every seed would give the same light field."""
    settings = load_settings({"rendered": TWO, "disparity_range": {"rendered/room_low_2": [-1, 2]}})
    names = ["sticks", "room", "sticks_low", "sticks_low_2", "room_low", "room_low_2"]
    assert settings.scenes_of("rendered") == names
    assert settings.scene("rendered", "room_low_2").disparity_range == (-1, 2)
    assert settings.scene("rendered", "room_low_2").samples == 9 * 64**2
    assert len(load_settings({}).scenes_of("rendered")) == 3 * len(RENDERED)
    for name in (RenderedScene("a_b"), RenderedScene("low", "high"), RenderedScene("c", "low", 12)):
        assert rendered_scene(name.name) == name


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"scenes": ["stick"]}, "config.rendered.scenes: unknown 'stick'; did you mean 'sticks'"),
        ({"noise": ["lots"]}, "config.rendered.noise: unknown 'lots'"),
        ({"variants": ["bestt"]}, "config.rendered.variants: unknown 'bestt'; did you mean 'best'"),
        ({"size": 10}, "config.rendered.size"),
    ],
)
def test_a_wrong_value_is_named(values: dict[str, Any], message: str) -> None:
    with pytest.raises(SepiError, match=f"^{message}"):
        load_settings({"rendered": values})


@pytest.mark.workflow
class TestJobs:
    @pytest.fixture
    def workflow(self, tmp_path: Path) -> Workflow:
        for name in TWO["scenes"]:
            write_drawn(tmp_path / f"run/results/renders/{name}.h5", name)
        return Workflow(REPOSITORY, tmp_path / "run", TINY | {"rendered": TWO})

    def test_one_target_makes_all_of_them_and_no_other_has_any(self, workflow: Workflow) -> None:
        """One render serves all levels of noise; pictures are of one seed."""
        jobs = workflow.jobs("rendered")
        counts = {rule: sum(job.rule.name == rule for job in jobs) for rule in ("ingest", "truth", "evaluate", "maps")}
        assert counts == {"ingest": 6, "truth": 6, "evaluate": 6, "maps": 4}
        made = {str(file) for job in jobs for file in job.output}
        assert {"reports/rendered/index.html", "reports/rendered/properties_mse.tex"} <= made
        assert {job.wildcards.dataset for job in jobs if hasattr(job.wildcards, "dataset")} == {"rendered"}
        (words,) = (job.params.source for job in jobs if "results/rendered/room_low_2/lightfield.h5" in job.output)
        assert words == ["results/renders/room.h5", "--module", MODULE, "--set", "noise=low", "--set", "seed=2"]
        assert not any("render" in file for file in workflow.read().globals["all_files"]())

    def test_a_missing_renderer_is_told_before_any_job(self, workflow: Workflow) -> None:
        (workflow.folder / "results/renders/room.h5").unlink()
        known = importlib.util.find_spec

        def found(name: str, *more: Any) -> Any:
            return None if name == "mitsuba" else known(name, *more)

        with mock.patch("importlib.util.find_spec", found), pytest.raises(SystemExit) as ended:
            workflow.jobs("rendered")
        assert ended.value.code == "sepi: rendered scenes need the package mitsuba: pip install 'sepi[render]'"


def test_a_render_becomes_a_light_field_and_apart_from_it_its_truth(tmp_path: Path) -> None:
    """No stage may find ground truth in its input; every mask is a region that is scored."""
    file, field, apart = (tmp_path / name for name in ("render.h5", "lightfield.h5", "truth.h5"))
    write_drawn(file, "sticks")
    words = [str(file), "--module", MODULE, "--set", "noise=high", "--set", "seed=2", "--output", str(field)]
    assert CliRunner().invoke(ingest.main, words, catch_exceptions=False).exit_code == 0
    words = [str(file), "--module", MODULE, "--output", str(apart)]
    assert CliRunner().invoke(truth.main, words, catch_exceptions=False).exit_code == 0
    alone, whole = read_light_field(field), read_with_truth(field, apart)
    assert (alone.name, alone.ground_truth, alone.masks) == ("sticks_high_2", None, {})
    np.testing.assert_array_equal(alone.views, read_scene(file, "high", 2).views)
    scores = score_regions(whole.ground_truth, whole.ground_truth, region_masks(whole))["paper"]
    assert list(scores)[:4] == ["all", "occluded", "textureless", "discontinuities"]
    assert scores["glossy"]["pixels"] == 16 * 64


def test_a_scene_is_rendered_again_for_the_renderer_and_itself_alone() -> None:
    """It takes minutes: neither another scene, nor what is told of scenes, nor noise may ask for that."""
    found = imported_modules("sepi.extensions.rendered.rendering", "sepi.extensions.rendered.worlds.sticks")
    assert {f"sepi.extensions.rendered.{name}" for name in ("rendering", "tracing", "worlds.sticks")} <= found
    others = {f"sepi.extensions.rendered.{name}" for name in ("worlds.room", "worlds", "exposure")}
    assert not found & {*others, "sepi.process.command"}
    assert not any("rendered" in name for name in imported_modules("sepi.ingest", "sepi.scenes"))
