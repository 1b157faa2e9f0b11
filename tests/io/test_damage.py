"""Our own HDF5 files, damaged anywhere: a clear error or what was written; never a crash, a hang or other numbers."""

import os
from collections.abc import Callable, Iterator
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from sepi.errors import SepiError
from sepi.io.hdf5 import read_attributes, read_light_field, read_stage, write_light_field, write_stage
from sepi.io.result_folder import read_result, write_result
from sepi.io.scores import Evaluation, read_evaluations, write_scores
from sepi.lightfield import DisparityRange, LightField
from sepi.stage import StageMaps

# variants of each file; `make faults` asks for more
VARIANTS = 20 * int(os.environ.get("SEPI_FAULTS", "2"))
SHAPE = (12, 16)
VALUES = np.linspace(-1, 2, SHAPE[0] * SHAPE[1], dtype=np.float32).reshape(SHAPE)
MASK = np.eye(*SHAPE, dtype=bool)
VIEWS = np.random.default_rng(0).integers(0, 256, (2, 3, *SHAPE, 3), np.uint8)
LIGHT_FIELD = LightField(VIEWS, "toy", "somewhere", disparity_range=DisparityRange(-1, 2, "given"))
MAPS = StageMaps(VALUES, abs(VALUES) / 2, {"occluded": MASK})
SCORES = {
    name: Evaluation({"paper": {"all": {"mse": 1.5}}}, VALUES * scale, {"all": MASK}, {"all": "scene"})
    for name, scale in (("a", 1), ("b", 2))
}


def stage_file(folder: Path) -> Path:
    write_stage(folder / "file.h5", MAPS, {"choice": "sepi", "threshold": 0.25})
    return folder / "file.h5"


def light_field_file(folder: Path) -> Path:
    write_light_field(folder / "file.h5", LIGHT_FIELD)
    return folder / "file.h5"


def result_file(folder: Path) -> Path:
    write_result(folder, LIGHT_FIELD, MAPS, {})
    return folder / "result.h5"


def scores_file(folder: Path) -> Path:
    write_scores(folder / "file.h5", SCORES, {"scene": "toy"})
    return folder / "file.h5"


FILES: dict[str, tuple[Callable[[Path], Path], Callable[[Path], Any]]] = {
    "stage": (stage_file, lambda path: (read_stage(path), read_attributes(path))),
    "light field": (light_field_file, read_light_field),
    "result": (result_file, lambda path: read_result(path.parent)),
    "scores": (scores_file, read_evaluations),
}


def plain(value: Any) -> Any:
    """What can be compared, of whatever a reader gives."""
    if is_dataclass(value):
        return {field.name: plain(getattr(value, field.name)) for field in fields(value)}
    if isinstance(value, np.ndarray):
        return value.dtype.str, value.shape, value.tobytes()
    if isinstance(value, dict):
        return {key: plain(inner) for key, inner in value.items()}
    return [plain(inner) for inner in value] if isinstance(value, list | tuple) else value


def damaged(content: bytes) -> Iterator[bytes]:
    """The file with a bit flipped, some bytes zero or random, or its end cut off; over its whole length."""
    rng = np.random.default_rng(len(content))
    for number in range(VARIANTS):
        place = number * len(content) // VARIANTS
        place += int(rng.integers(max(1, len(content) // VARIANTS)))
        length = int(rng.integers(1, 64))
        kind = number % 4
        if kind == 3:
            yield content[:place]
            continue
        middle = content[place : place + length]
        if kind == 0:
            middle = bytes([middle[0] ^ 1 << int(rng.integers(8))]) + middle[1:]
        else:
            # zeros where there are none
            middle = bytes(len(middle)) if kind == 1 and any(middle) else rng.bytes(len(middle))
        yield content[:place] + middle + content[place + len(middle) :]


def entries(file: h5py.File) -> list[h5py.Group | h5py.Dataset]:
    found = [file]
    file.visititems(lambda _, entry: found.append(entry))
    return found


def earlier(path: Path) -> None:
    """Let a file be of a minute ago, so that its time tells a change."""
    os.utime(path, (path.stat().st_mtime - 60,) * 2)


@pytest.mark.parametrize("kind", FILES)
def test_damage_is_told_or_does_not_matter(tmp_path: Path, kind: str) -> None:
    """A disk that loses a bit would make maps that nobody can trust, and nobody would know."""
    write, read = FILES[kind]
    path = write(tmp_path)
    expected = plain(read(path))
    errors = []
    for variant in damaged(path.read_bytes()):
        path.write_bytes(variant)
        # what was looked at is remembered, as of any file that has been there for a while
        earlier(path)
        try:
            found = plain(read(path))
        except SepiError as error:
            errors.append(str(error))
        else:
            assert found == expected
    assert all(error.startswith(str(path)) for error in errors)
    # what stands before HDF5's own bytes is all that does not matter
    assert len(errors) > 0.9 * VARIANTS


@pytest.mark.parametrize("kind", FILES)
def test_what_another_program_changes_is_told(tmp_path: Path, kind: str) -> None:
    """One number, one attribute, one name: not what was computed, though the file is sound to HDF5."""
    write, read = FILES[kind]
    path = write(tmp_path)
    content = path.read_bytes()

    def change_value(file: h5py.File) -> None:
        array = next(entry for entry in entries(file) if isinstance(entry, h5py.Dataset))
        place = (0,) * array.ndim
        array[place] = not array[place]

    def change_attribute(file: h5py.File) -> None:
        holder, name = next((e, n) for e in entries(file)[::-1] for n in e.attrs)
        holder.attrs[name] = 7.5

    def swap(file: h5py.File) -> None:
        one, other = [entry.name for entry in entries(file) if isinstance(entry, h5py.Dataset)][:2]
        file.move(one, "aside")
        file.move(other, one)
        file.move("aside", other)

    def add(file: h5py.File) -> None:
        file["more"] = VALUES

    def add_note(file: h5py.File) -> None:
        file.attrs["note"] = "looked at"

    for change in (change_value, change_attribute, swap, add, add_note):
        path.write_bytes(content)
        earlier(path)
        read(path)
        with h5py.File(path, "r+") as file:
            change(file)
        with pytest.raises(SepiError, match=r"\.h5: damaged, or changed by another program"):
            read(path)
