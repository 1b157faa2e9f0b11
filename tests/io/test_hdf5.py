"""The package's own HDF5 files: all that is known comes back, and a damaged one is one clear error."""

import dataclasses
import json
import threading
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pytest
from error_lines import reading_error
from geometries import GEOMETRIES, standing
from hdf5_edits import changed

from sepi.errors import SepiError
from sepi.io.hdf5 import read_stage, write_light_field, write_stage
from sepi.io.scores import read_evaluations
from sepi.lightfield import DisparityRange, LightField
from sepi.reading import read_light_field
from sepi.stage import CostVolume, StageMaps


def cut(path: Path) -> None:
    data = path.read_bytes()
    path.write_bytes(data[: len(data) // 2])


@pytest.fixture
def light_field() -> LightField:
    present = np.ones((2, 3), bool)
    present[0, 0] = False
    return LightField(
        np.random.default_rng(0).integers(0, 256, (2, 3, 12, 16, 3), np.uint8),
        "toy",
        "somewhere",
        present,
        DisparityRange(-1, 2, "given"),
        np.linspace(-1, 2, 192, dtype=np.float32).reshape(12, 16),
        {"occluded": np.eye(12, 16, dtype=bool)},
    )


def test_light_field_file_gives_back_all_that_is_known(tmp_path: Path, light_field: LightField) -> None:
    write_light_field(tmp_path / "lf.h5", light_field)
    back = read_light_field(tmp_path / "lf.h5")
    np.testing.assert_array_equal(back.views, light_field.views)
    np.testing.assert_array_equal(back.present, light_field.present)
    np.testing.assert_array_equal(back.ground_truth, light_field.ground_truth)
    np.testing.assert_array_equal(back.masks["occluded"], light_field.masks["occluded"])
    assert (back.name, back.source) == ("toy", "somewhere")
    assert back.disparity_range == light_field.disparity_range


@pytest.mark.parametrize("geometry", GEOMETRIES)
def test_where_the_views_stand_comes_back(tmp_path: Path, light_field: LightField, geometry: str) -> None:
    """The stages of the workflow read it from this file: forgotten there, it would be as if nobody knew it."""
    written = dataclasses.replace(light_field, **standing(geometry, light_field.grid))
    write_light_field(tmp_path / "lf.h5", written)
    back = read_light_field(tmp_path / "lf.h5")
    assert back.row_spacing == written.row_spacing
    assert (back.positions is None) == (written.positions is None)
    np.testing.assert_array_equal(back.baselines, written.baselines)


def spoiled(change: Callable[[h5py.File], object]) -> Callable[[Path], None]:
    def spoil(path: Path) -> None:
        with changed(path) as file:
            change(file)

    return spoil


def replace(file: h5py.File, name: str, values: np.ndarray) -> None:
    del file[name]
    file[name] = values


def tell(file: h5py.File, **properties: object) -> None:
    told = json.loads(file["properties"][()].tobytes()) | properties
    replace(file, "properties", np.frombuffer(json.dumps(told).encode(), np.uint8))


BAD_FILES: dict[str, tuple[Callable[[Path], None], str]] = {
    "cut off": (cut, "damaged, or changed by another program"),
    "no name": (spoiled(lambda f: tell(f, name=None)), "name"),
    "views of four axes": (spoiled(lambda f: replace(f, "views", np.zeros((3, 4, 4, 3), np.uint8))), "(T, S, H, W, C)"),
    "rows at no distance": (spoiled(lambda f: tell(f, row_spacing=0)), "row_spacing must be a positive"),
    "NaN pixels": (
        spoiled(lambda f: replace(f, "views", np.full((2, 3, 12, 16, 3), np.nan, np.float32))),
        "finite and within 0..1",
    ),
    "views are a group": (spoiled(lambda f: (f.pop("views"), f.create_group("views"))), "damaged"),
}


@pytest.mark.parametrize("case", BAD_FILES)
def test_bad_file_is_one_line_that_names_it(tmp_path: Path, light_field: LightField, case: str) -> None:
    spoil, word = BAD_FILES[case]
    write_light_field(tmp_path / "lf.h5", light_field)
    spoil(tmp_path / "lf.h5")
    message = reading_error(tmp_path / "lf.h5")
    assert "lf.h5" in message
    assert word in message


def hanging(path: Path) -> Path:
    """A file of another program with text of a length of its own, and damage where HDF5 keeps that."""
    with h5py.File(path, "w") as file:
        file["LF"] = np.ones((2, 2, 4, 5, 3), np.uint8)
        file.attrs["dH"] = "0.05"
        file.attrs["focalLength"], file.attrs["shift"] = 300.0, 1.25
    content = path.read_bytes()
    # the heap of such texts: its objects follow a head of 16 bytes
    at = content.index(b"GCOL") + 16
    path.write_bytes(content[:at] + bytes(48) + content[at + 48 :])
    return path


def test_text_on_which_hdf5_hangs_is_refused(tmp_path: Path) -> None:
    """The command would not end, and could not be interrupted either."""
    assert "attribute 'dH': expected numbers, or text of fixed length" in reading_error(hanging(tmp_path / "a.h5"))


@pytest.mark.parametrize("read", [read_light_field, read_evaluations])
def test_an_error_that_is_kept_does_not_keep_others_from_hdf5(tmp_path: Path, read: Callable[[Path], object]) -> None:
    """A session that goes on after a bad file would hang for ever at the next one that it reads in a thread."""
    with h5py.File(hanging(tmp_path / "a.h5"), "r+") as file:
        file["views"], file["present"] = file["LF"], np.ones((2, 2), bool)
        file["properties"] = np.frombuffer(b'{"name": "a"}', np.uint8)
        for name in ("masks", "maps/one"):
            file.create_group(name).attrs.update({"digest": 1, "source": 1, "problem": 1, "sha256": 1})
        for name in ("masks", "maps/one/regions"):
            # no array, and one that is not reached
            file.create_group(f"{name}/a")
            file[f"{name}/b"] = np.ones((4, 5), bool)
        del file["LF"]
    with pytest.raises(SepiError) as kept:
        read(tmp_path / "a.h5")
    other = threading.Thread(target=lambda: h5py.File(tmp_path / "b.h5", "w").close(), daemon=True)
    other.start()
    other.join(10)
    assert not other.is_alive(), f"waits because of: {kept.value}"


def test_a_cost_volume_comes_back(tmp_path: Path) -> None:
    """The next job chooses among these candidates; another precision or order would give another map."""
    random = np.random.default_rng(3)
    costs = CostVolume(np.linspace(-1, 2, 7, dtype=np.float32), random.random((7, 5, 6)).astype(np.float16))
    disparity, confidence = random.random((2, 5, 6), np.float32)
    attributes = {"stage": "initial", "choice": "spo", "parameters": "{}", "made_from": "[]"}
    write_stage(tmp_path / "initial.h5", StageMaps(disparity, confidence, cost_volume=costs), attributes)
    back = read_stage(tmp_path / "initial.h5")
    np.testing.assert_array_equal(back.cost_volume.costs, costs.costs)
    np.testing.assert_array_equal(back.cost_volume.disparities, costs.disparities)
    assert (back.cost_volume.costs.dtype, set(back.all())) == (np.float16, {"disparity", "confidence"})
    assert back.without_costs().cost_volume is None
