"""The commands as a user calls them: what they print and write, and one clear line when something is wrong."""

import json
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import click
import cv2
import h5py
import numpy as np
import pytest
from click.testing import CliRunner
from error_lines import call, done, error_of, everything_in
from several_threads import SEVERAL, threads

import sepi
from sepi import ingest, initial
from sepi.cli.main import main
from sepi.io.disparity_maps import read_pfm, write_pfm
from sepi.io.hdf5 import read_attributes, read_stage, write_light_field
from sepi.io.result_files import RESULT_FILES
from sepi.lightfield import LightField
from sepi.process.command import stage_command
from sepi.process.threads import threads_used
from sepi.reading import read_light_field
from sepi.scenes import render, write_hci
from sepi.stage import StageMaps

# few candidates: these tests are about the commands, not about depth
FAST = ("--threads", "2", "--set", "initial.semi_global.num_disparities=21")


@pytest.fixture(scope="session")
def pyramids(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("scenes") / "pyramids"
    write_hci(render("pyramids", size=64, views=3), folder)
    return folder


@pytest.fixture
def scene(pyramids: Path, here: Path) -> Path:
    """A copy of a small scene, to spoil, in the current folder."""
    return Path(shutil.copytree(pyramids, here / "pyramids"))


@pytest.fixture(scope="session")
def result(pyramids: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("results") / "maps"
    assert call("depth", pyramids, "-o", folder, *FAST).exit_code == 0
    return folder


@pytest.fixture
def flat(monkeypatch: pytest.MonkeyPatch) -> None:
    """No depth is computed: these tests are about what is written beside it."""
    monkeypatch.setattr(
        "sepi.pipeline.estimate_depth",
        lambda light_field, *_: StageMaps(*np.zeros((2, *light_field.shape), np.float32)),
    )


# --- depth


def test_depth_writes_the_maps_and_says_so(scene: Path) -> None:
    called = done("depth", "pyramids", *FAST)
    assert called.stderr == ""  # no progress bar where nobody watches
    assert "pyramids: 3x3 views (rows x columns) of 64x64 pixels" in called.stdout
    known = read_light_field(scene).require_disparity_range()
    assert f"disparity range: {known.minimum} to {known.maximum} pixels per view step (from the" in called.stdout
    # as set for the first stage, and by the rule for the second
    assert "scene's parameters), 21 and 91 candidates\n" in called.stdout
    assert "unknown" not in called.stdout.split("written to")[0]
    masks = {"mask_occluded.png", "mask_textureless.png", "mask_unknown.png"}
    bars = {"sigma.pfm", "sigma.png", "interval.npz", "depth_sigma.pfm"}
    assert set(os.listdir("pyramids-depth")) == {*RESULT_FILES, *masks, "depth.pfm", *bars}
    assert f"written to pyramids-depth/: {' '.join(RESULT_FILES[:-1])}" in called.stdout
    with np.load("pyramids-depth/interval.npz") as interval:
        assert set(interval.files) == {"low", "high", "nearest", "farthest"}
        half = np.median(interval["high"] - interval["low"]) / 2
    assert f"90 % interval: median half width {half:.2g} pixels per view step\n" in called.stdout
    maps = read_stage(Path("pyramids-depth/result.h5"))
    doubtful = (maps.confidence < 0.5) & ~maps.mask("unknown")
    whole, plain = (100 * of.mean() for of in (doubtful, doubtful & maps.mask("textureless")))
    assert f"ambiguous: {whole:.2g} % of the pixels (confidence below 0.5), {plain:.2g} %" in called.stdout
    disparity = read_pfm(Path("pyramids-depth/disparity.pfm"))
    assert disparity.shape == (64, 64)
    assert np.isfinite(disparity).all()
    np.testing.assert_array_equal(maps.disparity, disparity)


@pytest.mark.extension("methods")
@pytest.mark.usefixtures("flat")
def test_a_method_without_a_model_of_its_error_says_so(scene: Path) -> None:
    """Silence would be taken for certainty."""
    called = done("depth", scene, "-o", "out", "--variant", "oavc")
    assert "no interval: oavc " in called.stdout
    assert set(os.listdir("out")) == {*RESULT_FILES, "depth.pfm"}


def test_no_ground_truth_reaches_the_estimate(scene: Path) -> None:
    """A depth map that changes with the ground truth beside the views is not an estimate."""
    call("depth", scene, "-o", "with", *FAST)
    for name in ("gt_disp_lowres.pfm", "mask_occluded.png", "mask_textureless.png"):
        (scene / name).unlink()
    call("depth", scene, "-o", "without", *FAST)
    assert everything_in(Path("with")) == everything_in(Path("without"))


@pytest.mark.usefixtures("flat")
def test_depth_writes_over_nothing_of_others(scene: Path) -> None:
    """Two folders 'views' of two scenes have one name for the result; told before that is computed."""
    for folder in ("a", "b"):
        write_hci(render("dots" if folder == "a" else "pyramids", size=64, views=3), Path(folder, "views"))
        Path(folder, "views", "parameters.cfg").unlink()
    assert call("depth", "a/views", *FAST).exit_code == 0
    before = everything_in(Path("views-depth"))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("sepi.pipeline.estimate_depth", None)
        line = error_of(call("depth", "b/views", *FAST))
        assert "views-depth: holds the result of another light field (a/views); choose another folder" in line
        Path("own").mkdir()
        Path("own/depth.pfm").write_text("mine")
        assert "own: holds files that no earlier result wrote (depth.pfm)" in error_of(
            call("depth", "a/views", "-o", "own", *FAST)
        )
    assert everything_in(Path("views-depth")) == before
    assert everything_in(Path("own")) == {"depth.pfm": b"mine"}
    assert call("depth", "b/views", "--force", *FAST).exit_code == 0
    assert read_attributes(Path("views-depth/result.h5"))["source"] == "b/views"


def test_depth_again_replaces_its_own_files_with_equal_ones(pyramids: Path, result: Path, tmp_path: Path) -> None:
    out = Path(shutil.copytree(result, tmp_path / "out"))
    for path in out.iterdir():
        os.utime(path, (0, 0))
    assert call("depth", pyramids, "-o", out, *FAST).exit_code == 0
    assert everything_in(out) == everything_in(result)
    assert all(path.stat().st_mtime > 0 for path in out.iterdir())


def test_depth_from_the_file_that_ingest_wrote(pyramids: Path, result: Path, tmp_path: Path) -> None:
    CliRunner().invoke(ingest.main, [str(pyramids), "--output", str(tmp_path / "lf.h5")])
    call("depth", tmp_path / "lf.h5", "-o", tmp_path / "from-file", *FAST)
    assert everything_in(tmp_path / "from-file") == everything_in(result)


def test_depth_of_another_view_within_a_range_that_is_estimated(scene: Path) -> None:
    (scene / "parameters.cfg").unlink()
    called = done("depth", scene, "-o", "out", "--view", "0,2", *FAST)
    assert "estimated from the views" in called.stdout
    attributes = read_attributes(Path("out/result.h5"))
    assert attributes["disparity_range_source"] == "estimated"
    assert attributes["view_position"].tolist() == [0, 2]
    with h5py.File("out/result.h5") as file:
        np.testing.assert_array_equal(file["view"], read_light_field(scene).views[0, 2])


def test_depth_in_metres_with_the_cameras_geometry(scene: Path) -> None:
    flags = ("--focal-length", 100, "--baseline", 50, "--focus-distance", 8, "--sensor-size", 36)
    called = call("depth", scene, "-o", "out", *flags, *FAST)
    assert "depth.pfm" in called.stdout
    disparity = read_pfm(Path("out/disparity.pfm")).astype(np.float64)
    focal = 100 / 36 * 64
    inverse = disparity / (0.05 * focal) + 1 / 8
    # beyond infinity, as noise may have it, there is no depth
    expected = np.where(inverse > 0, 1 / inverse, np.inf)
    np.testing.assert_allclose(read_pfm(Path("out/depth.pfm")), expected, rtol=1e-5)
    assert "missing: --sensor-size" in call("depth", scene, *flags[:-2]).stderr


@pytest.mark.extension("formats")
@pytest.mark.usefixtures("flat")
def test_a_crop_is_remembered_by_its_result(scene: Path) -> None:
    """Flags of a camera that come later are those of the whole picture, too."""
    flags = ("--focal-length", 100, "--baseline", 50, "--focus-distance", 8, "--sensor-size", 36)
    part = ("--crop-of", "128x96+10+20")
    (scene / "parameters.cfg").unlink()
    assert call("depth", scene, "-o", "now", *flags, *part, *FAST).exit_code == 0
    assert call("depth", scene, "-o", "later", *part, *FAST).exit_code == 0
    assert call("points", "later", "-o", "later.ply", *flags).exit_code == 0
    assert Path("later.ply").read_bytes() == Path("now/points.ply").read_bytes()
    assert call("convert", "later", "later.pfm", "--map", "depth", *flags).exit_code == 0
    np.testing.assert_array_equal(read_pfm(Path("later.pfm")), read_pfm(Path("now/depth.pfm")))


@pytest.mark.extension("formats")
def test_a_camera_that_contradicts_the_disparities_is_told(pyramids: Path, result: Path, tmp_path: Path) -> None:
    """Metres for millimetres, or focus at infinity, put most of a scene beyond infinity."""
    for baseline, focus, told in ((0.05, 8, True), (50, "inf", True), (50, 1.5, False)):
        flags = ("--focal-length", 100, "--baseline", baseline, "--focus-distance", focus, "--sensor-size", 36)
        called = call("points", result, "-o", tmp_path / "p.ply", *flags)
        assert ("beyond infinity" in called.stderr and "--baseline" in called.stderr) == told
        assert ("beyond infinity" in call("info", pyramids, *flags).stdout) == told


@pytest.mark.usefixtures("flat")
def test_a_file_name_that_is_no_text(scene: Path) -> None:
    """Old archives hold names in other encodings."""
    name = os.fsdecode(b"caf\xe9.npy")
    np.save(name, read_light_field(scene).views)
    assert call("depth", name, "-o", "out", *FAST).exit_code == 0
    assert read_attributes(Path("out/result.h5"))["scene"] == "caf?"


def test_depth_within_a_limit_of_memory(scene: Path, result: Path) -> None:
    """The same maps; a limit that cannot be kept is told before anything is written."""
    assert call("depth", scene, "-o", "within", "--memory", 400, *FAST).exit_code == 0
    assert Path("within/disparity.pfm").read_bytes() == (result / "disparity.pfm").read_bytes()
    called = call("depth", scene, "-o", "none", "--memory", 10, *FAST)
    assert called.exit_code == 1
    assert "at least" in called.stderr
    assert "10 MB" in called.stderr
    assert not Path("none").exists()


@pytest.fixture
def many_threads() -> Iterator[None]:
    """More threads than one, which a command has to lower."""
    before = cv2.getNumThreads()
    cv2.setNumThreads(3)
    with threads(SEVERAL):
        yield
    cv2.setNumThreads(before)


@pytest.mark.usefixtures("many_threads")
@pytest.mark.parametrize(
    ("command", "words"),
    [
        (main, "depth pyramids --variant no_occlusion_no_textureless --set initial.sepi.num_disparities=5"),
        (main, "refocus pyramids --disparity 0"),
        (ingest.main, "pyramids --output again.h5"),
        (stage_command("initial", initial.CHOICES), "--light-field lf.h5 --choice structure_tensor --output stage.h5"),
    ],
    ids=["depth", "refocus", "ingest", "stage"],
)
def test_a_command_keeps_to_its_threads(scene: Path, command: click.Command, words: str) -> None:
    """On a machine that others use too, or that a scheduler divides among jobs."""
    write_light_field(Path("lf.h5"), read_light_field(scene))
    done(*words.split(), "--threads", "1", of=command)
    assert (threads_used(), cv2.getNumThreads()) == (1, 1)


@pytest.mark.usefixtures("flat")
def test_a_warning_does_not_stop_the_depth(scene: Path) -> None:
    """Views in the wrong order give a map that looks like one; the user must hear of it, and of the way out."""
    views = render("curved_occluders", size=96, views=5).views
    np.save("turned.npy", views.transpose(1, 0, 2, 3, 4))
    called = done("depth", "turned.npy", "-o", "out", *FAST)
    # nothing matches in this order, wherever it is looked for
    line, other = called.stderr.splitlines()
    assert line.startswith("sepi: warning: turned.npy: ")
    assert "--order transpose" in line
    assert "--disparity-range" in other
    assert call("depth", "turned.npy", "-o", "right", "--order", "transpose", *FAST).stderr == ""


@pytest.mark.usefixtures("flat")
def test_sixteen_bit_files_with_fewer_bits_are_told(scene: Path) -> None:
    """Raw pictures of 12 bit are black to thresholds that count in parts of the full scale."""
    views = read_light_field(scene).views.astype(np.uint16) << 4
    np.save("raw.npy", views)
    called = done("depth", "raw.npy", "-o", "out", *FAST)
    assert "12 bits, give --white 4095" in called.stderr
    assert call("depth", "raw.npy", "-o", "full", "--white", "4095", *FAST).stderr == ""


def test_check_names_the_flag_that_sets_the_order_right(scene: Path) -> None:
    views = render("curved_occluders", size=96, views=5).views
    np.save("views.npy", views[:, ::-1])
    called = call("check", "views.npy")
    assert called.exit_code == 1
    assert len([line for line in called.stdout.splitlines() if line.startswith("  ")]) == 8
    assert "--order flip-columns" in called.stdout.splitlines()[-1]
    # a script may ask either, and gets the same code
    asked = call("check", "--json", "views.npy")
    assert asked.exit_code == 1
    found = json.loads(asked.stdout)
    assert len(found["costs"]) == 8
    assert found["best"] == "flip-columns" == min(found["costs"], key=found["costs"].get)
    assert (found["clear"], found["read_in"], found["grid"]) == (True, "as-given", [5, 5])
    assert found["warning"] == found["verdict"]
    right = done("check", "--json", "views.npy", "--order", "flip-columns")
    assert json.loads(right.stdout)["warning"] is None
    assert "--order" not in json.loads(right.stdout)["verdict"]


@pytest.mark.usefixtures("flat")
def test_depth_and_check_tell_that_near_and_far_are_open(scene: Path) -> None:
    """Inside out, the map looks as good."""
    np.save("plane.npy", render("slanted_plane", size=96, views=5).views)
    said = "near and far cannot be told apart here; if depth comes out inside out, read it with --order flip-both"
    assert call("check", "plane.npy").stdout.splitlines()[-1].endswith(said)
    assert f"note: {said}\n" in call("depth", "plane.npy", "-o", "out", *FAST).stdout


def test_check_fails_where_a_view_is_of_another_scene(scene: Path) -> None:
    views = render("curved_occluders", size=96, views=5).views
    views[0, 1] = render("dots", size=96, views=5).views[0, 1]
    np.save("views.npy", views)
    called = call("check", "--json", "views.npy")
    assert called.exit_code == 1
    (line,) = json.loads(called.stdout)["odd_views"]
    assert line.endswith("--exclude 0,1")
    assert call("check", "views.npy", "--exclude", "0,1").exit_code == 0


# --- wrong usage


@pytest.mark.parametrize(
    "words",
    [("depth",), ("depht", "x"), ("depth", "x", "--threads", "0"), ("depth", "x", "--disparity-range", "1"), ("--no",)],
)
def test_wrong_usage_is_exit_code_two(words: tuple[str, ...]) -> None:
    called = call(*words)
    assert called.exit_code == 2
    assert called.stderr.splitlines()[-1].startswith("Error: ")


# --- evaluate


@pytest.mark.usefixtures("flat")
def test_evaluate_knows_which_view_a_result_belongs_to(scene: Path, pyramids: Path) -> None:
    """The truth is that of the centre view; another view's map has other numbers and would seem to be bad."""
    assert call("depth", scene, "-o", "side", "--view", "0,1", *FAST).exit_code == 0
    assert "no ground truth for view 0,1" in error_of(call("evaluate", "side", scene))
    assert call("depth", scene, "-o", "centre", *FAST).exit_code == 0
    assert "side: depth of another view than centre" in error_of(call("evaluate", "centre", "side"))
    views, ground_truth = read_light_field(pyramids).views, read_light_field(pyramids).ground_truth
    write_light_field(Path("cut.h5"), LightField(views[1:], "cut", ground_truth=ground_truth, view=(0, 1)))
    assert call("depth", "cut.h5", "-o", "own", *FAST).exit_code == 0
    assert call("evaluate", "own", "cut.h5").exit_code == 0
    assert call("depth", "cut.h5", "-o", "turned", "--order", "flip-columns", *FAST).exit_code == 0
    assert "0,1 of 3x3" in error_of(call("evaluate", "side", "cut.h5", "--view", "0,1"))


def test_evaluate_gives_numbers_to_programs(tmp_path: Path) -> None:
    ground_truth = np.zeros((40, 50), np.float32)
    estimate = ground_truth.copy()
    estimate[:, :10] = 1
    estimate[20, 30] = np.nan
    write_pfm(tmp_path / "truth.pfm", ground_truth)
    np.save(tmp_path / "estimate.npy", estimate)
    scores = json.loads(call("evaluate", tmp_path / "estimate.npy", tmp_path / "truth.pfm", "--json").stdout)
    assert scores["paper"]["all"]["pixels"] == 2000
    assert scores["paper"]["all"]["non_finite"] == 1
    assert scores["paper"]["all"]["mse100"] == pytest.approx(100 * 400 / 1999)
    assert scores["paper"]["all"]["badpix007"] == pytest.approx(100 * 401 / 2000)
    # the benchmark leaves the wrong columns out
    assert scores["benchmark"]["all"]["mse100"] == 0


def test_evaluate_with_another_border(tmp_path: Path) -> None:
    write_pfm(tmp_path / "map.pfm", np.zeros((40, 50), np.float32))
    words = ("evaluate", tmp_path / "map.pfm", tmp_path / "map.pfm")
    scores = json.loads(call(*words, "--border", 4, "--json").stdout)
    assert list(scores) == ["border 4"]
    assert scores["border 4"]["all"]["pixels"] == 32 * 42
    # nothing is left: no number, and no NaN, which is not JSON
    assert json.loads(call(*words, "--border", 30, "--json").stdout)["border 30"]["all"]["mse100"] is None
    assert call(*words, "--border", 30).stdout.splitlines()[1].split()[3] == "-"


# --- points


# --- info and scenes


def test_info_says_which_view_of_an_even_grid_is_meant(tmp_path: Path) -> None:
    """In a 4x4 grid no view is in the middle; a map of another view than expected is shifted everywhere."""
    write_light_field(tmp_path / "even.h5", render("pyramids", size=64, views=4))
    assert re.search(r"depth made for: +view 2,2\n", call("info", tmp_path / "even.h5").stdout)
    assert re.search(r"depth made for: +view 1,2\n", call("info", tmp_path / "even.h5", "--view", "1,2").stdout)


def test_info_as_json_has_what_its_text_has(pyramids: Path) -> None:
    """Programs that choose among light fields need numbers, not words."""
    known = json.loads(call("info", "--json", pyramids, "--row-spacing", 0.5).stdout)
    assert (known["name"], known["format"], known["grid"]) == ("pyramids", "hci", [3, 3])
    assert (known["views"], known["height"], known["width"], known["channels"]) == (9, 64, 64, 3)
    assert (known["dtype"], known["row_spacing"], known["positions"]) == ("uint8", 0.5, None)
    assert (known["reference_view"], known["missing_views"]) == ([1, 1], [])
    assert known["disparity_range"]["source"] == "parameters"
    assert (known["ground_truth"], known["masks"]) == (True, ["occluded", "textureless"])


def test_scenes_are_written_and_read_back(tmp_path: Path) -> None:
    words = ("--size", 64, "--views", 3, "-o", tmp_path / "made")
    done("scenes", "dots", "stripes", *words)
    assert sorted(os.listdir(tmp_path / "made")) == ["dots", "stripes"]
    np.testing.assert_array_equal(
        read_light_field(tmp_path / "made/dots").views, render("dots", size=64, views=3).views
    )
    before = everything_in(tmp_path)
    assert "made/stripes: exists already" in error_of(call("scenes", "wall", "stripes", *words))
    assert everything_in(tmp_path) == before


# --- the program


def run(*words: str, cwd: Path) -> subprocess.CompletedProcess[str]:
    source = Path(__file__).parents[2]
    return subprocess.run(
        [sys.executable, "-m", "sepi", *words],
        cwd=cwd,
        env={**os.environ, "PYTHONPATH": str(source)},
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )


def test_program_runs_and_fails_without_traceback(pyramids: Path, tmp_path: Path) -> None:
    good = run("depth", str(pyramids), *FAST, "--variant", "fast", cwd=tmp_path)
    assert (good.returncode, good.stderr) == (0, "")
    assert set(RESULT_FILES) < set(os.listdir(tmp_path / "pyramids-depth"))
    bad = run("depth", "absent", cwd=tmp_path)
    assert (bad.returncode, bad.stdout) == (1, "")
    assert bad.stderr == "sepi: absent: no such file or folder\n"
    assert run("--version", cwd=tmp_path).stdout == f"sepi {sepi.__version__}\n"


def test_check_tells_a_wrong_order_from_what_cannot_be_read(tmp_path: Path) -> None:
    """A script that goes through a folder asks its exit code."""
    called = call("check", tmp_path / "absent")
    assert called.exit_code == 2
    assert "no such file or folder" in called.output


@pytest.mark.parametrize("variant", ["best", "no_occlusion_no_textureless"])
def test_python_writes_what_the_command_writes(scene: Path, variant: str) -> None:
    """The same bytes, of views whose positions matter and whose range is not known."""
    light_field = read_light_field(scene)
    positions = np.moveaxis(np.indices((3, 3)), 0, 2) * (0.9, 1)
    write_light_field(
        Path("lf.h5"), replace(light_field, positions=positions, disparity_range=None, ground_truth=None, masks={})
    )
    fewer = () if variant == "best" else ("--set", "initial.sepi.num_disparities=21")
    words = ("depth", "lf.h5", "-o", "by command", "--exclude", "0,0", "--variant", variant)
    assert call(*words, *(FAST if variant == "best" else fewer)).exit_code == 0
    read = sepi.read_light_field("lf.h5", options=sepi.ReadOptions(exclude=("0,0",)))
    maps = sepi.estimate_depth(read, variant, {"initial": {"num_disparities": 21}})
    sepi.write_result("out", read, maps)
    assert everything_in(Path("out")) == everything_in(Path("by command"))


# --- ingest


def test_ingest_writes_the_scene_with_a_range(scene: Path) -> None:
    (scene / "parameters.cfg").unlink()
    done(scene, "--threads", 2, "--output", "deep/lf.h5", of=ingest.main)
    light_field = read_light_field("deep/lf.h5")
    assert light_field.require_disparity_range().source == "estimated"
    np.testing.assert_array_equal(light_field.views, read_light_field(scene).views)


def test_ingest_renders_a_built_in_scene(tmp_path: Path) -> None:
    output = tmp_path / "lf.h5"
    words = ("dots", "--module", "sepi.scenes.light_field", "--set", "size=64", "--set", "views=3")
    words += ("--disparity-range", -2, 2, "--output", output)
    assert call(*words, of=ingest.main).exit_code == 0
    light_field = read_light_field(output)
    assert light_field.views.shape == (3, 3, 64, 64, 3)
    assert (light_field.require_disparity_range().minimum, light_field.require_disparity_range().source) == (
        -2,
        "given",
    )
    # a file of its own has that, or a new one would ask for new maps
    assert light_field.ground_truth is None
