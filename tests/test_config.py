"""The workflow's configuration: a typing error must be named, not ignored, and config.yaml must tell the truth."""

import struct
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
import yaml

from sepi.config import Settings, load_settings
from sepi.config_file import default_yaml
from sepi.errors import SepiError
from sepi.pipeline import STAGES, VARIANTS
from sepi.scenes import SCENES

CONFIG = Path(__file__).parents[1] / "config.yaml"


def message_of(values: dict[str, Any]) -> str:
    with pytest.raises(SepiError) as caught:
        load_settings(values)
    assert "\n" not in str(caught.value)
    return str(caught.value)


def make_scene(folder: Path, views: int = 9, width: int = 40, height: int = 30) -> Path:
    """A folder that looks like a scene: a PNG header is all that the configuration reads."""
    folder.mkdir(parents=True)
    header = b"\x89PNG\r\n\x1a\n" + struct.pack(">I4sII", 13, b"IHDR", width, height)
    for number in range(views):
        (folder / f"input_Cam{number:03}.png").write_bytes(header)
    return folder


def test_config_yaml_is_what_the_code_has() -> None:
    """A default changed in the code but not in config.yaml would be overridden by the stale one."""
    assert CONFIG.read_text() == default_yaml(), "run: python -m sepi.config_file > config.yaml"


def test_config_yaml_sets_the_defaults() -> None:
    assert load_settings(yaml.safe_load(CONFIG.read_text())) == load_settings({})


def test_config_yaml_names_every_parameter_with_its_meaning() -> None:
    lines = [line.strip() for line in CONFIG.read_text().splitlines()]
    for choices in STAGES.values():
        for choice in choices.values():
            for name, field in choice.parameters.model_fields.items():
                assert field.description, f"{name} has no description"
                found = [number for number, line in enumerate(lines) if line.startswith(f"{name}: ")]
                assert any(lines[number - 1].startswith("# ") for number in found), f"{name} has no comment"


def test_defaults_run_every_builtin_scene_and_variant() -> None:
    settings = load_settings({})
    assert settings.scenes_of("builtin") == list(SCENES)
    assert list(settings.variants) == list(VARIANTS)
    assert settings.datasets == ["builtin"]
    assert settings.own_variants == []


@pytest.mark.parametrize(
    ("values", "expected"),
    [
        ({"hci_rot": "x"}, "config: unknown 'hci_rot'; did you mean 'hci_root'?"),
        ({"builtin": {"sizes": 96}}, "config.builtin: unknown 'sizes'; did you mean 'size'?"),
        ({"builtin": {"size": "big"}}, "config.builtin.size: input should be a valid integer, got 'big'"),
        ({"builtin": {"size": 3}}, "config.builtin.size: input should be greater than or equal to 64, got 3"),
        ({"builtin": {"scenes": ["dotz"]}}, "config.builtin.scenes: unknown 'dotz'; did you mean 'dots'?"),
        ({"builtin": {"scenes": []}}, "config: no scene to run on; name some in builtin.scenes or light_fields"),
        ({"builtin": None}, "config.builtin: input should be an object, got None"),
        ({"hci_root": "/nowhere"}, "config.hci_root: no folder '/nowhere'"),
        ({"stages": {"initail": {}}}, "config.stages: unknown 'initail'; did you mean 'initial'?"),
        ({"stages": {"initial": {"sapi": {}}}}, "config.stages.initial: unknown 'sapi'; did you mean 'sepi'?"),
        (
            {"stages": {"initial": {"sepi": {"candidats": 3}}}},
            "config.stages.initial.sepi: unknown 'candidats'; did you mean 'candidates'?",
        ),
        (
            {"stages": {"initial": {"sepi": {"candidates": 20.5}}}},
            "config.stages.initial.sepi.candidates: input should be a valid integer, got 20.5",
        ),
        (
            {"variants": {"mine": {"initial": "sepi"}}},
            "config.variants.mine: no choice for stage 'occlusion' (one of half_sepi, wang, visibility, "
            "visibility_unmixed, visibility_colours, none)",
        ),
        (
            {"variants": {"mine": VARIANTS["paper"].choices | {"occlusion": "halfsepi"}}},
            "config.variants.mine.occlusion: unknown 'halfsepi'; did you mean 'half_sepi'?",
        ),
        (
            {"variants": {"paper": VARIANTS["wang"].choices}},
            "config.variants.paper: a built-in variant has a fixed meaning",
        ),
        ({"variants": {"a/b": VARIANTS["wang"].choices}}, "config.variants.a/b: a variant's name must be letters"),
        (
            {"disparity_range": {"builtin/dotz": [0, 1]}},
            "config.disparity_range: unknown 'builtin/dotz'; did you mean 'builtin/dots'?",
        ),
        ({"disparity_range": {"builtin/dots": [2, 1]}}, "config.disparity_range of builtin/dots"),
        ({"disparity_range": {"builtin/dots": [2]}}, "config.disparity_range.builtin/dots.1: field required"),
    ],
)
def test_a_wrong_key_or_value_is_named(values: dict[str, Any], expected: str) -> None:
    assert expected in message_of(values)


def test_numbers_left_as_text_are_numbers() -> None:
    """Snakemake hands over ``--config 'builtin={size: 96}'`` as text, and YAML reads 1e-1 as text."""
    settings = load_settings({"builtin": {"size": "96"}, "disparity_range": {"builtin/dots": ["-2", "1e-1"]}})
    assert settings.scene("builtin", "dots").height == 96
    assert settings.scene("builtin", "dots").disparity_range == (-2, 0.1)


def test_an_empty_choice_keeps_its_defaults() -> None:
    """``half_sepi:`` with nothing below it is null in YAML."""
    assert load_settings({"stages": {"occlusion": {"half_sepi": None}}}) == load_settings({})


def test_own_variants_come_beside_the_builtin_ones() -> None:
    mine = VARIANTS["paper"].choices | {"optimize": "none"}
    settings = load_settings({"variants": {"mine": mine}})
    assert settings.own_variants == ["mine"]
    assert settings.variants["mine"].path("textureless") == settings.variants["paper"].path("textureless")
    assert settings.variants["mine"].path("optimize") != settings.variants["paper"].path("optimize")


class TestFolderOfScenes:
    def settings(self, root: Path) -> Settings:
        return load_settings({"hci_root": str(root)})

    def test_scenes_are_found_below_categories(self, tmp_path: Path) -> None:
        make_scene(tmp_path / "training" / "sideboard")
        make_scene(tmp_path / "additional" / "antinous")
        make_scene(tmp_path / "cotton")
        (tmp_path / "notes").mkdir()
        assert self.settings(tmp_path).scenes_of("hci") == ["antinous", "cotton", "sideboard"]

    def test_the_folder_may_be_a_scene_itself(self, tmp_path: Path) -> None:
        assert self.settings(make_scene(tmp_path / "cotton")).scenes_of("hci") == ["cotton"]

    def test_size_and_number_of_views_are_read(self, tmp_path: Path) -> None:
        """Threads and memory of every job follow from them."""
        make_scene(tmp_path / "cotton", views=25, width=64, height=48)
        scene = self.settings(tmp_path).scene("hci", "cotton")
        assert (scene.views, scene.height, scene.width) == (25, 48, 64)

    def test_everything_that_ingest_reads_is_an_input(self, tmp_path: Path) -> None:
        folder = make_scene(tmp_path / "cotton", views=3)
        for name in ("parameters.cfg", "gt_disp_lowres.pfm", "mask_planes_lowres.png", "license.txt"):
            (folder / name).touch()
        names = {path.name for path in self.settings(tmp_path).scene("hci", "cotton").files}
        assert {"input_Cam000.png", "input_Cam002.png", "parameters.cfg", "gt_disp_lowres.pfm"} <= names
        assert "license.txt" not in names

    def test_two_scenes_of_one_name_are_refused(self, tmp_path: Path) -> None:
        make_scene(tmp_path / "a" / "cotton")
        make_scene(tmp_path / "b" / "cotton")
        assert "two scenes are called 'cotton'" in message_of({"hci_root": str(tmp_path)})

    def test_a_name_that_is_no_plain_word_is_refused(self, tmp_path: Path) -> None:
        make_scene(tmp_path / "my {scene}")
        assert "'my {scene}'" in message_of({"hci_root": str(tmp_path)})

    def test_a_folder_without_scenes_is_refused(self, tmp_path: Path) -> None:
        assert f"no scene in '{tmp_path}'" in message_of({"hci_root": str(tmp_path)})

    def test_a_damaged_picture_is_left_to_ingest(self, tmp_path: Path) -> None:
        """One bad scene must not keep the others from running."""
        folder = make_scene(tmp_path / "cotton")
        (folder / "input_Cam000.png").write_bytes(b"")
        assert self.settings(tmp_path).scene("hci", "cotton").samples > 0

    def test_an_unknown_scene_is_named(self, tmp_path: Path) -> None:
        make_scene(tmp_path / "cotton")
        with pytest.raises(SepiError, match="scene of dataset 'hci': unknown 'coton'; did you mean 'cotton'"):
            self.settings(tmp_path).scene("hci", "coton")

    @pytest.mark.real
    def test_the_benchmark_folder_as_it_is_handed_out(self, hci: Path) -> None:
        settings = self.settings(hci)
        assert settings.scenes_of("hci") == ["antinous", "cotton"]
        assert settings.scene("hci", "antinous").samples == 81 * 512 * 512


class TestOwnLightFields:
    """Light fields of any format go through the workflow, too."""

    def test_flags_reach_ingest(self, tmp_path: Path) -> None:
        (tmp_path / "lego.mat").write_bytes(bytes(3 * 81 * 100))
        entry = {
            "path": str(tmp_path / "lego.mat"),
            "format": "matlab",
            "grid": [9, 9],
            "central": 5,
            "order": "flip-rows",
            "exclude": ["0,0", "4,4"],
            "view": [2, 3],
            "follow_links": True,
        }
        settings = load_settings({"light_fields": {"lego": entry}, "disparity_range": {"own/lego": [-1, 2]}})
        scene = settings.scene("own", "lego")
        words = "--format matlab --grid 9x9 --central 5 --order flip-rows --view 2,3 --exclude 0,0 --exclude 4,4"
        assert scene.flags == (*words.split(), "--follow-links")
        assert scene.files == (tmp_path / "lego.mat",)
        assert scene.disparity_range == (-1, 2)
        assert (scene.views, scene.height, scene.width) == (81, 10, 10)

    def test_every_picture_of_a_folder_is_an_input(self, tmp_path: Path) -> None:
        folder = make_scene(tmp_path / "flowers", views=4)
        (folder / ".hidden").touch()
        (folder / "below").mkdir()
        scene = load_settings({"light_fields": {"a": {"path": str(folder)}}}).scene("own", "a")
        assert [path.name for path in scene.files] == [f"input_Cam00{number}.png" for number in range(4)]
        assert (scene.views, scene.height, scene.width) == (4, 30, 40)

    @pytest.mark.parametrize(
        ("entry", "expected"),
        [
            ({"path": "/nowhere"}, "config.light_fields.a: no file or folder '/nowhere'"),
            ({}, "config.light_fields.a.path: field required"),
            ({"path": "/", "gird": [3, 3]}, "config.light_fields.a: unknown 'gird'; did you mean 'grid'?"),
            ({"path": "/", "grid": "3x3"}, "config.light_fields.a.grid: input should be a valid array, got '3x3'"),
            ({"path": ""}, "config.light_fields.a.path: string should have at least 1 character"),
            (
                {"path": "/", "order": "flip-row"},
                "a.order: unknown 'flip-row'; did you mean 'flip-rows'",
            ),
            ({"path": "/", "format": "nmupy"}, "config.light_fields.a.format: unknown 'nmupy'; did you mean 'numpy'"),
            ({"path": "/", "central": 0}, "config.light_fields.a.central: input should be greater than or equal to 1"),
            (
                {"path": "/", "view": [-1, 2]},
                "light_fields.a.view.0: input should be greater than or equal to 0",
            ),
            ({"path": "/", "central": "big"}, "config.light_fields.a.central: input should be a valid integer"),
            ("/data/lego", "config.light_fields.a: input should be an object, got '/data/lego'"),
        ],
    )
    def test_a_wrong_entry_is_named(self, entry: Any, expected: str) -> None:
        assert expected in message_of({"light_fields": {"a": entry}})

    def test_texts_that_look_like_numbers_stay_texts(self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.chdir(tmp_path)
        np.save("2024", np.zeros(1))
        Path("2024.npy").rename("2024")
        entry = {"path": "2024", "variable": "5", "grid": ["3", "3"]}
        assert load_settings({"light_fields": {"a": entry}}).scene("own", "a").flags[-1] == "5"

    def test_a_name_that_is_no_plain_word_is_refused(self, tmp_path: Path) -> None:
        assert "'my lego'" in message_of({"light_fields": {"my lego": {"path": str(tmp_path)}}})


def test_archive_files_are_scenes_by_their_own_or_their_folders_name(tmp_path: Path) -> None:
    for name in ("buddha.h5", "mona/lf.h5"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        with h5py.File(tmp_path / name, "w") as file:
            file["LF"] = np.zeros((3, 3, 8, 8, 3), np.uint8)
    with h5py.File(tmp_path / "other.h5", "w") as file:
        file["x"] = 1
    (tmp_path / "readme.txt").touch()
    settings = load_settings({"hci_old_root": str(tmp_path)})
    assert settings.scenes_of("hci_old") == ["buddha", "mona"]
    assert settings.scene("hci_old", "mona").files == (tmp_path / "mona/lf.h5",)
    (tmp_path / "empty").mkdir()
    assert "expected HDF5 files" in message_of({"hci_old_root": str(tmp_path / "empty")})
    assert "no folder" in message_of({"hci_old_root": str(tmp_path / "absent")})
