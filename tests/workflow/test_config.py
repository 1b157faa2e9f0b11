"""The workflow's configuration: a typing error must be named, not ignored, and config.yaml must tell the truth."""

import json
import re
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
import yaml

from sepi.errors import SepiError
from sepi.io.disparity_maps import TruthFile
from sepi.io.images import write_png
from sepi.scenes import render
from sepi.workflow.config import load_settings
from sepi.workflow.config_file import default_yaml
from sepi.workflow.result_paths import key_of
from sepi.workflow.settings import Settings

REPOSITORY = Path(__file__).parents[2]


def message_of(values: dict[str, Any]) -> str:
    with pytest.raises(SepiError) as caught:
        load_settings(values)
    assert "\n" not in str(caught.value)
    return str(caught.value)


def make_scene(folder: Path, views: int = 9, width: int = 40, height: int = 30) -> Path:
    """A folder that looks like a scene."""
    folder.mkdir(parents=True)
    for number in range(views):
        write_png(folder / f"input_Cam{number:03}.png", np.zeros((height, width, 3), np.uint8))
    return folder


@pytest.mark.parametrize("file", ["config.yaml", "config/config.yaml"])
def test_config_yaml_is_what_the_code_has(file: str) -> None:
    """Else it would tell of defaults that are none; the second is what Snakedeploy copies, link or not as Git likes."""
    path = REPOSITORY / file
    assert not path.is_symlink()
    assert path.read_text() == default_yaml(), f"run: python -m sepi.workflow.config_file > {file}"


def test_a_kept_copy_of_config_yaml_follows_the_defaults() -> None:
    """It must not freeze those of its version: a built-in variant that is changed later would even stop it."""
    text = default_yaml()
    assert not any(yaml.safe_load(text).values())
    assert load_settings(yaml.safe_load(text)) == load_settings({})
    # what is said of them is true, and may be set by taking the # away
    said = load_settings(yaml.safe_load(re.sub(r"^( *)#(?! )", r"\1", text, flags=re.MULTILINE)))
    assert said == load_settings({})


@pytest.mark.parametrize(
    ("values", "expected"),
    [
        ({"hci_rot": "x"}, "config: unknown 'hci_rot'; did you mean 'hci_root'?"),
        (
            {"builtin": {"scenes": []}},
            "config: no scenes; list some in builtin.scenes or light_fields",
        ),
        ({"hci_root": "/nowhere"}, "config.hci_root: no folder '/nowhere'"),
        (
            {"variants": {"mine": {"initial": "sepi"}}},
            "config.variants.mine: no choice for stage 'occlusion' (one of half_sepi, wang, visibility, ",
        ),
        ({"variants": {"paper": {"base": "best"}}}, "config.variants.paper: a built-in variant cannot be redefined"),
        # its folder would lie where the file does that says that the scene is complete
        (
            {"stages": {"initial": {"sepi": {"canny_low": 0.1}}}},
            "config.stages.initial.sepi: unknown 'canny_low'; known: num_disparities, scale",
        ),
        (
            {"disparity_range": {"builtin/dotz": [0, 1]}},
            "config.disparity_range: unknown 'builtin/dotz'; did you mean 'builtin/dots'?",
        ),
    ],
)
def test_a_wrong_key_or_value_is_named(values: dict[str, Any], expected: str) -> None:
    assert expected in message_of(values)


@pytest.mark.parametrize("key", ["light_fields", "variants", "stages", "report"])
def test_a_key_that_holds_itself_is_told(key: str) -> None:
    """A slip with YAML's & and * used to be a traceback of a thousand lines."""
    assert "config: a key contains itself" in message_of(yaml.safe_load(f"{key}: &a {{x: *a}}"))


def test_numbers_left_as_text_are_numbers() -> None:
    """Snakemake hands over ``--config 'builtin={size: 96}'`` as text, and YAML reads 1e-1 as text."""
    settings = load_settings({"builtin": {"size": "96"}, "disparity_range": {"builtin/dots": ["-2", "1e-1"]}})
    assert settings.scene("builtin", "dots").height == 96
    assert settings.scene("builtin", "dots").disparity_range == (-2, 0.1)


def test_a_key_with_nothing_below_keeps_its_defaults() -> None:
    """``half_sepi:`` with nothing below it is null in YAML."""
    stages = {"initial": None, "occlusion": {"half_sepi": None}}
    assert load_settings({"builtin": None, "report": None, "stages": stages}) == load_settings({})


def test_own_variants_come_beside_the_builtin_ones() -> None:
    """Variants that begin alike share files; an override is part of the path, however its number is written."""
    entries = {
        "mine": {"base": "paper", "optimize": "none"},
        "other": {"base": "best_no_gaps", "occlusion": {"passes": "2"}, "optimize": {"choice": "wls", "alpha": 0.0}},
    }
    settings = load_settings({"variants": entries})
    assert settings.own_variants == ["mine", "other"]
    mine, paper, other = (settings.variants[name].labels for name in ("mine", "paper", "other"))
    assert key_of(mine, "textureless") == key_of(mine, "optimize") == key_of(paper, "textureless")
    assert key_of(other, "optimize") == "semi_global/visibility+gaps=False+passes=2/uniform_planes/wls+alpha=0"
    assert settings.parameters["occlusion"]["visibility+gaps=False+passes=2"].model_dump() == {
        **settings.parameters["occlusion"]["visibility"].model_dump(),
        "gaps": False,
        "passes": 2,
    }


class TestFolderOfScenes:
    def settings(self, root: Path) -> Settings:
        return load_settings({"hci_root": str(root)})

    def test_scenes_are_found_below_categories(self, tmp_path: Path) -> None:
        make_scene(tmp_path / "training" / "sideboard")
        make_scene(tmp_path / "additional" / "antinous")
        make_scene(tmp_path / "cotton")
        (tmp_path / "notes").mkdir()
        assert self.settings(tmp_path).scenes_of("hci") == ["antinous", "cotton", "sideboard"]

    def test_size_and_number_of_views_are_read(self, tmp_path: Path) -> None:
        """Threads and memory of every job follow from them."""
        make_scene(tmp_path / "cotton", views=25, width=64, height=48)
        scene = self.settings(tmp_path).scene("hci", "cotton")
        assert (scene.views, scene.height, scene.width) == (25, 48, 64)
        corner = {"hci_root": str(tmp_path), "report": {"pixels": {"hci/cotton": [[47, 63]]}}}
        assert load_settings(corner).report.pixels == {"hci/cotton": [(47, 63)]}
        corner["report"] = {"pixels": {"hci/cotton": [[63, 47]]}}
        assert "report.pixels.hci/cotton: row 63, column 47 lies outside" in message_of(corner)

    @pytest.mark.parametrize("dataset", ["hci", "own"])
    def test_ground_truth_is_no_input_of_the_maps(self, tmp_path: Path, dataset: str) -> None:
        """Adding it would compute them all anew; a file that is read and no input would leave stale ones."""
        folder = make_scene(tmp_path / "cotton", views=3)
        truth = ["gt_disp_lowres.pfm", "mask_planes_lowres.png"]
        for name in ("parameters.cfg", *truth, "license.txt"):
            (folder / name).touch()
        root = {"hci_root": str(tmp_path)} if dataset == "hci" else {"light_fields": {"cotton": {"path": str(folder)}}}
        scene = load_settings(root).scene(dataset, "cotton")
        views = [f"input_Cam00{number}.png" for number in range(3)]
        assert [path.name for path in scene.files] == [*views, "parameters.cfg"]
        assert [path.name for path in scene.truth] == truth

    @pytest.mark.extension("formats")
    def test_ground_truth_of_an_exported_folder_is_what_its_file_names(self, tmp_path: Path) -> None:
        """Its pictures may have any names: a changed mask would compute all maps anew, a changed truth no score."""
        from sepi.extensions.formats.exported import write_exported

        light_field = render("dots", size=64, views=3)
        write_exported(tmp_path / "dots", light_field)
        scene = load_settings({"light_fields": {"dots": {"path": str(tmp_path / "dots")}}}).scene("own", "dots")
        views = [f"row_{t:02}_col_{s:02}.png" for t, s in np.ndindex(3, 3)]
        assert [path.name for path in scene.files] == [*views, "light_field.json"]
        masks = [f"mask_{name}.png" for name in sorted(light_field.masks)]
        assert [path.name for path in scene.truth] == ["light_field.json", "gt_disp_lowres.pfm", *masks]

    def test_two_scenes_of_one_name_are_refused(self, tmp_path: Path) -> None:
        make_scene(tmp_path / "a" / "cotton")
        make_scene(tmp_path / "b" / "cotton")
        assert "two scenes are called 'cotton'" in message_of({"hci_root": str(tmp_path)})

    def test_scenes_are_taken_and_left_out_by_patterns(self, tmp_path: Path) -> None:
        """One damaged scene of a folder that others share must not stop every table."""
        for name in ("cotton", "boxes", "001"):
            make_scene(tmp_path / name)

        def root(**patterns: list[str]) -> dict[str, Any]:
            return {"hci_root": {"path": str(tmp_path), **patterns}}

        assert load_settings(root(exclude=["c*"])).scenes_of("hci") == ["001", "boxes"]
        assert load_settings(root(include=["b*", "001"], exclude=["boxes"])).scenes_of("hci") == ["001"]
        wrong = message_of(root(exclude=["coton"]))
        assert wrong == f"config.hci_root.exclude: no scene in '{tmp_path}' is called 'coton'"
        assert "include and exclude leave no scene" in message_of(root(exclude=["*"]))

    def test_a_damaged_picture_is_left_to_ingest(self, tmp_path: Path) -> None:
        """One bad scene must not keep the others from running."""
        folder = make_scene(tmp_path / "cotton")
        (folder / "input_Cam000.png").write_bytes(b"")
        assert self.settings(tmp_path).scene("hci", "cotton").samples > 0


class TestOwnLightFields:
    """Light fields of any format go through the workflow, too."""

    def test_flags_reach_ingest(self, tmp_path: Path) -> None:
        (tmp_path / "lego.npy").write_bytes(bytes(3 * 81 * 100))
        entry = {
            "path": str(tmp_path / "lego.npy"),
            "format": "numpy",
            "grid": "9x9",
            "central": 5,
            "order": "flip-rows",
            "exclude": ["0,0", "4,4"],
            "view": [2, 3],
            "row_spacing": 0.5,
            "white": 1023,
            "crop_of": "128x96+1+2",
            "follow_links": True,
        }
        settings = load_settings({"light_fields": {"lego": entry}, "disparity_range": {"own/lego": [-1, 2]}})
        scene = settings.scene("own", "lego")
        words = "--format numpy --grid 9x9 --central 5 --order flip-rows --view 2,3 --row-spacing 0.5 --white 1023.0"
        words += " --crop-of 128x96+1+2"
        assert scene.flags == (*words.split(), "--exclude", "0,0", "--exclude", "4,4", "--follow-links")
        assert scene.files == (tmp_path / "lego.npy",)
        assert scene.disparity_range == (-1, 2)
        assert (scene.views, scene.height, scene.width) == (81, 10, 10)

    def test_every_picture_of_a_folder_is_an_input(self, tmp_path: Path) -> None:
        folder = make_scene(tmp_path / "flowers", views=4)
        (folder / "below").mkdir()
        pictures = [f"input_Cam00{number}.png" for number in range(4)]
        # notes are no part of the light field: whoever writes them need not wait for all maps
        for beside in ("parameters.cfg", "light_field.json"):
            for name in (".hidden", "notes.txt", beside):
                (folder / name).touch()
            scene = load_settings({"light_fields": {"a": {"path": str(folder)}}}).scene("own", "a")
            assert [path.name for path in scene.files] == [*pictures, beside]
            assert (scene.views, scene.height, scene.width) == (4, 30, 40)

    @pytest.mark.parametrize(
        ("entry", "expected"),
        [
            ({"path": "/nowhere"}, "config.light_fields.a: no file or folder '/nowhere'"),
            ({"path": "/", "order": "flip-row"}, "a.order: unknown 'flip-row'; did you mean 'flip-rows'"),
            ({"path": "/", "format": "nmupy"}, "config.light_fields.a.format: unknown 'nmupy'; did you mean 'numpy'"),
            ({"path": "/", "truth": "/nowhere.pfm"}, "config.light_fields.a.truth: no file '/nowhere.pfm'"),
            ("/data/lego", "config.light_fields.a: input should be an object, got '/data/lego'"),
        ],
    )
    def test_a_wrong_entry_is_named(self, entry: Any, expected: str) -> None:
        assert expected in message_of({"light_fields": {"a": entry}})

    def test_ground_truth_beside_the_views_is_none_of_them(self, here: Path) -> None:
        """A changed one asks for scores and for no map, whatever folder it lies in and whatever the scene brings."""
        folder = make_scene(here / "flowers", views=4)
        for name in ("gt_disp_lowres.pfm", "input_truth.png", "parameters.cfg"):
            (folder / name).touch()
        entry = {"path": "flowers", "truth": "flowers/input_truth.png", "truth_scale": "0.5", "view": [0, 1]}
        for kind, brought in (("images", ()), ("hci", ("gt_disp_lowres.pfm",))):
            scene = load_settings({"light_fields": {"a": entry | {"format": kind}}}).scene("own", "a")
            assert scene.own_truth == TruthFile(folder / "input_truth.png", 0.5)
            assert [path.name for path in scene.truth] == ["input_truth.png", *brought]
            assert not set(scene.files) & set(scene.truth)
            assert scene.views == 4
            assert scene.flags == ("--format", kind, "--view", "0,1")


@pytest.mark.extension("formats")
def test_archive_files_are_scenes_by_their_own_or_their_folders_name(tmp_path: Path) -> None:
    for name in ("buddha.h5", "mona/lf.h5"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        with h5py.File(tmp_path / name, "w") as file:
            file["LF"] = np.zeros((3, 3, 8, 8, 3), np.uint8)
    with h5py.File(tmp_path / "other.h5", "w") as file:
        file["x"] = 1
    (tmp_path / "readme.txt").touch()
    settings = load_settings({"hci_2013_root": str(tmp_path)})
    assert settings.scenes_of("hci_2013") == ["buddha", "mona"]
    assert settings.scene("hci_2013", "mona").files == (tmp_path / "mona/lf.h5",)
    (tmp_path / "empty").mkdir()
    assert "expected HDF5 files" in message_of({"hci_2013_root": str(tmp_path / "empty")})
    assert "no folder" in message_of({"hci_2013_root": str(tmp_path / "absent")})


class TestExternal:
    """Maps of external methods are found where the user says, and a wrong entry is named before anything runs."""

    def file(self, path: str, dataset: str = "hci", scene: str = "cotton") -> Path:
        return load_settings({"external": {"SPO": path}}).external["SPO"].file(dataset, scene)

    def test_a_folder_means_the_file_of_the_scenes_name(self, tmp_path: Path) -> None:
        assert self.file(str(tmp_path)) == tmp_path / "cotton.pfm"
        for name in ("other.pfm", "cotton.txt", "Cotton.PFM", "cotton.h5", "cotton.png", "cotton.npy", "cotton.pfm"):
            (tmp_path / name).touch()
            if name.lower().startswith("cotton") and not name.endswith("txt"):
                # each in turn is preferred to those before it
                assert self.file(str(tmp_path)) == tmp_path / name
        (tmp_path / "below.pfm").mkdir()
        assert self.file(str(tmp_path), scene="below") == tmp_path / "below.pfm"

    def test_a_pattern_names_dataset_and_scene(self, tmp_path: Path) -> None:
        assert self.file("/maps/{dataset}/{scene}/{scene}_spo.npy") == Path("/maps/hci/cotton/cotton_spo.npy")
        (tmp_path / "hci").mkdir()
        (tmp_path / "hci" / "Cotton.npy").touch()
        assert self.file(f"{tmp_path}/{{dataset}}") == tmp_path / "hci/Cotton.npy"

    def test_a_pattern_may_name_folders_that_depth_wrote(self, tmp_path: Path) -> None:
        (tmp_path / "cotton-depth").mkdir()
        assert self.file(f"{tmp_path}/{{scene}}-depth") == tmp_path / "cotton-depth/disparity.pfm"

    def test_home_and_working_folder(self, here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setenv("HOME", str(here))
        (here / "maps").mkdir()
        (here / "maps" / "cotton.npy").touch()
        assert self.file("~/maps") == here / "maps/cotton.npy"
        assert self.file("maps") == Path("maps/cotton.npy")

    def test_what_the_command_is_told(self, tmp_path: Path) -> None:
        (tmp_path / "dots.npy").touch()
        entries = {"SPO": "/nowhere", "AMNorm": {"path": str(tmp_path), "scale": -1, "offset": 0.5}}
        settings = load_settings({"external": entries})
        assert settings.external_files("builtin", "dots") == {
            "SPO": Path("/nowhere/dots.pfm"),
            "AMNorm": tmp_path / "dots.npy",
        }
        told = json.loads(settings.external_json("builtin", "dots"))
        assert list(told) == ["SPO", "AMNorm"]
        assert told["SPO"] == {"path": "/nowhere/dots.pfm", "scale": None, "offset": 0.0}
        assert told["AMNorm"] == {"path": f"{tmp_path}/dots.npy", "scale": -1.0, "offset": 0.5}
        with pytest.raises(SepiError, match="unknown 'dotz'; did you mean 'dots'"):
            settings.external_files("builtin", "dotz")

    def test_texts_that_look_like_numbers(self) -> None:
        """A folder may be called 2024; a scale is a number also where Snakemake hands over text."""
        settings = load_settings({"external": {"a": "2024", "b": {"path": "1e-1", "scale": "-1", "offset": "1e-1"}}})
        assert settings.external["a"].file("hci", "cotton") == Path("2024/cotton.pfm")
        assert settings.external["b"].file("hci", "cotton") == Path("1e-1/cotton.pfm")
        assert (settings.external["b"].scale, settings.external["b"].offset) == (-1, 0.1)

    @pytest.mark.parametrize(
        ("entry", "expected"),
        [
            (5, "config.external.SPO: input should be an object, got 5"),
            ({"path": "/", "scale": 0}, "config.external.SPO.scale: must not be 0"),
            ({"path": "/", "offset": None}, "config.external.SPO.offset: input should be a valid number, got None"),
            ("/maps/{scen}", "config.external.SPO.path: unknown '{scen}'; did you mean '{scene}'?"),
            ("/maps/cotton.pfm", "config.external.SPO.path: '/maps/cotton.pfm' is a single file; give a folder"),
        ],
    )
    def test_a_wrong_entry_is_named(self, entry: Any, expected: str) -> None:
        assert expected in message_of({"external": {"SPO": entry}})

    def test_one_file_for_all_scenes_is_refused(self, tmp_path: Path) -> None:
        """It would be scored against every other scene's ground truth."""
        (tmp_path / "spo").touch()
        assert "is a single file; give a folder" in message_of({"external": {"SPO": str(tmp_path / "spo")}})
        (tmp_path / "maps.pfm").mkdir()
        assert self.file(str(tmp_path / "maps.pfm")) == tmp_path / "maps.pfm/cotton.pfm"
