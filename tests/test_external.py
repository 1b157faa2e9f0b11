"""Maps of external methods: scored like ours, and whatever is wrong with one is told and stops nothing."""

import json
import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result

from sepi.errors import SepiWarning
from sepi.evaluate import evaluation_of
from sepi.external import ExternalSource, command, external_maps
from sepi.io.disparity_maps import write_pfm
from sepi.io.hdf5 import write_light_field
from sepi.io.scores import Evaluation, read_evaluations, without_nan, write_scores
from sepi.lightfield import LightField
from sepi.reading import read_light_field

SHAPE = (40, 44)


@pytest.fixture
def light_field() -> LightField:
    random = np.random.default_rng(1)
    views = random.integers(0, 256, (3, 3, *SHAPE, 3), np.uint8)
    ground_truth = random.normal(size=SHAPE).astype(np.float32)
    return LightField(views, "noise", ground_truth=ground_truth, masks={"textureless": ground_truth > 1})


@pytest.fixture
def estimate(light_field: LightField) -> np.ndarray:
    return light_field.ground_truth + np.random.default_rng(2).normal(scale=0.05, size=SHAPE).astype(np.float32)


def saved(path: Path, values: np.ndarray) -> ExternalSource:
    write_pfm(path, values)
    return ExternalSource(path=str(path))


def call(folder: Path, light_field: LightField, maps: str) -> Result:
    write_light_field(folder / "lightfield.h5", light_field)
    files = {"--light-field": folder / "lightfield.h5", "--maps": maps, "--output": folder / "external.h5"}
    return CliRunner().invoke(command, [str(part) for pair in files.items() for part in pair], catch_exceptions=False)


@pytest.mark.parametrize("kept", ["Cotton.pfm", "COTTON.PFM", "cotton.npy"])
def test_a_map_is_found_by_the_name_of_its_scene(tmp_path: Path, kept: str) -> None:
    """Authors write scenes' names with capitals, as papers do; exactly the scene's name comes first."""
    source = ExternalSource(path=str(tmp_path))
    (tmp_path / kept).touch()
    assert source.file("hci", "cotton") == tmp_path / kept
    (tmp_path / "cotton.pfm").touch()
    assert source.file("hci", "cotton") == tmp_path / "cotton.pfm"


class TestImport:
    def test_scores_equal_our_own_maps(self, tmp_path: Path, light_field: LightField, estimate: np.ndarray) -> None:
        external = external_maps(light_field, {"SPO": saved(tmp_path / "noise.pfm", estimate)})["SPO"]
        expected = evaluation_of(light_field, estimate)
        assert external.problem == ""
        assert external.source == str(tmp_path / "noise.pfm")
        np.testing.assert_array_equal(external.disparity, estimate)
        assert without_nan(external.scores) == without_nan(expected.scores)
        assert external.region_sources == expected.region_sources
        sources = {"occluded": "computed", "textureless": "scene", "discontinuities": "computed"}
        assert expected.region_sources == sources
        np.testing.assert_array_equal(external.error, expected.error)
        for name, mask in expected.regions.items():
            np.testing.assert_array_equal(external.regions[name], mask)

    def test_scale_and_offset_are_used(self, tmp_path: Path, light_field: LightField, estimate: np.ndarray) -> None:
        file = saved(tmp_path / "noise.pfm", -2 * estimate + 3)
        external = external_maps(light_field, {"SPO": file.model_copy(update={"scale": -0.5, "offset": 1.5})})["SPO"]
        np.testing.assert_allclose(external.disparity, estimate, atol=1e-5)

    def test_without_truth_there_are_maps_but_no_scores(self, tmp_path: Path, light_field: LightField) -> None:
        bare = replace(light_field, ground_truth=None, masks={})
        external = external_maps(bare, {"SPO": saved(tmp_path / "noise.pfm", np.ones(SHAPE, np.float32))})["SPO"]
        assert external.problem == ""
        assert external.disparity is not None
        assert external.scores == {}

    def test_unknown_pixels_count_as_bad(self, tmp_path: Path, light_field: LightField, estimate: np.ndarray) -> None:
        estimate[20, 20:23] = [np.nan, np.inf, -np.inf]
        file = saved(tmp_path / "noise.pfm", estimate)
        with pytest.warns(SepiWarning, match=r"external SPO, scene noise: .*noise\.pfm: 3 of 1760 values"):
            external = external_maps(light_field, {"SPO": file})["SPO"]
        assert external.problem == ""
        np.testing.assert_array_equal(external.disparity, estimate)
        whole = external.scores["paper"]["all"]
        assert whole["non_finite"] == 3
        assert whole["badpix007"] >= 100 * 3 / 1760

    @pytest.mark.parametrize(
        ("values", "problem", "reason"),
        [
            (None, "no file", "no such file"),
            (b"", "not readable", "not a one-channel PFM"),
            (b"Pf\n44 40\n-1\n1234", "not readable", "expected 7040 bytes"),
            (np.zeros((44, 40)), "40x44 instead of 44x40", "40x44 pixels, but the views have 44x40"),
            (np.full(SHAPE, np.nan), "no finite value", "none of its values is finite"),
            (np.full(SHAPE, np.inf), "no finite value", "none of its values is finite"),
        ],
    )
    def test_a_problem_is_told_and_the_others_still_come(
        self, tmp_path: Path, light_field: LightField, estimate: np.ndarray, values: object, problem: str, reason: str
    ) -> None:
        path = tmp_path / "bad.pfm"
        if isinstance(values, bytes):
            path.write_bytes(values)
        elif isinstance(values, np.ndarray):
            write_pfm(path, values.astype(np.float32))
        files = {"bad": ExternalSource(path=str(path)), "good": saved(tmp_path / "good.pfm", estimate)}
        with pytest.warns(SepiWarning) as caught:
            found = external_maps(light_field, files)
        (line,) = (str(warning.message) for warning in caught)
        assert line.startswith(f"external bad, scene noise: {path}: ")
        assert reason in line
        assert found["bad"].problem == problem
        assert found["bad"].disparity is None
        assert found["bad"].scores == {}
        assert (found["bad"].sha256 == "") == (values is None)
        assert found["good"].problem == ""
        assert found["good"].scores["paper"]["all"]["mse100"] > 0


class TestFile:
    def external(self, light_field: LightField, estimate: np.ndarray) -> Evaluation:
        found = evaluation_of(light_field, estimate)
        return replace(found, source="maps/noise.pfm", sha256="ab" * 32, disparity=estimate)

    def test_comes_back_unchanged(self, tmp_path: Path, light_field: LightField, estimate: np.ndarray) -> None:
        external = self.external(light_field, estimate)
        maps = {"SPO": external, "lost": Evaluation(source="maps/ü.pfm", problem="no file")}
        write_scores(tmp_path / "a.h5", maps, {})
        back = read_evaluations(tmp_path / "a.h5")
        assert list(back) == ["SPO", "lost"]
        assert back["lost"] == maps["lost"]
        assert (back["SPO"].source, back["SPO"].sha256) == (external.source, external.sha256)
        assert without_nan(back["SPO"].scores) == without_nan(external.scores)
        np.testing.assert_array_equal(back["SPO"].disparity, estimate)
        np.testing.assert_array_equal(back["SPO"].error, external.error)
        assert set(back["SPO"].regions) == {"occluded", "textureless", "discontinuities"}
        write_scores(tmp_path / "b.h5", maps, {})
        assert (tmp_path / "a.h5").read_bytes() == (tmp_path / "b.h5").read_bytes()


class TestCommand:
    def test_writes_maps_and_tells_faults(self, tmp_path: Path, light_field: LightField, estimate: np.ndarray) -> None:
        write_pfm(tmp_path / "noise.pfm", estimate)
        maps = {
            "SPO": {"path": str(tmp_path / "noise.pfm"), "scale": None, "offset": 0.0},
            "AMNorm": {"path": str(tmp_path / "absent.pfm"), "scale": 2, "offset": 0},
        }
        result = call(tmp_path, light_field, json.dumps(maps))
        assert result.exit_code == 0, result.output
        assert result.stdout == ""
        assert result.stderr.splitlines() == [
            f"sepi: warning: external AMNorm, scene noise: {tmp_path / 'absent.pfm'}: no such file"
        ]
        back = read_evaluations(tmp_path / "external.h5")
        assert [external.problem for external in back.values()] == ["", "no file"]
        assert without_nan(back["SPO"].scores) == without_nan(evaluation_of(light_field, estimate).scores)
        written = (tmp_path / "external.h5").read_bytes()
        assert call(tmp_path, light_field, json.dumps(maps)).exit_code == 0
        assert (tmp_path / "external.h5").read_bytes() == written

    @pytest.mark.parametrize(
        ("maps", "message"),
        [
            ("SPO", "--maps: Invalid JSON"),
            ('{"SPO": {"path": 5}}', "--maps.SPO.path: "),
            ('{"SPO": {"path": "a", "scale": "5"}}', "--maps.SPO.scale: "),
        ],
    )
    def test_wrong_json_is_one_line(self, tmp_path: Path, light_field: LightField, maps: str, message: str) -> None:
        result = call(tmp_path, light_field, maps)
        assert result.exit_code == 1
        assert len(result.stderr.splitlines()) == 1
        assert message in result.stderr
        assert not (tmp_path / "external.h5").exists()


def test_published_maps_score_as_an_independent_program_scores_them(hci: Path, real_data: Path) -> None:
    """SPO on cotton: a slip in orientation, sign or border would put every external method in a wrong light."""
    folder = real_data / "published_maps"
    if not folder.is_dir():
        pytest.skip(f"no published maps at {folder}")
    scene = read_light_field(hci / "cotton")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        external = external_maps(scene, {"SPO": ExternalSource(path=str(folder / "SPO" / "cotton.pfm"))})["SPO"]
    scores = external.scores
    assert scores["paper"]["all"]["mse100"] == pytest.approx(1.7786, abs=5e-5)
    assert scores["benchmark"]["all"]["mse100"] == pytest.approx(1.3130, abs=5e-5)
    assert scores["paper"]["all"]["non_finite"] == 0
