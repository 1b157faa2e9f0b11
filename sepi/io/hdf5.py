"""HDF5 files of this package: light fields, ground truth, and stage files.

Each file begins with a digest of all bytes that follow. It lies in the user block of HDF5, which other programs skip.
From a damaged file HDF5 may read wrong numbers, crash, or hang, so the digest is checked first.

A truth file holds ``ground_truth (H, W) float32`` in pixels per view step and ``masks/NAME (H, W)`` of the reference
view, if the scene has them. It is a file apart: only scores use it, no stage reads it.

A stage file holds ``disparity (H, W) float32`` in pixels per view step, ``confidence (H, W) float32`` in 0..1, the
stage's own maps, and attributes that say what made them. If a later stage chooses among candidates, it also holds
``cost_volume (K, H, W) float16`` and ``candidates (K,) float32``. Equal content gives equal bytes.
"""

from __future__ import annotations

import hashlib
import io
import json
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import numpy.typing as npt
from pydantic import BaseModel

from sepi.camera import Camera
from sepi.camera.rig import Rig
from sepi.errors import SepiError, printable
from sepi.io.files import DEFLATE_RATIO, PatientFile, atomic_path, reading
from sepi.lightfield import DisparityRange, LightField, Truth, require_light_field
from sepi.process.interrupts import no_interrupt_lost
from sepi.stage import ERROR_BARS, LIGHT_DEVIATION, CostVolume, StageMaps
from sepi.validation import require_path
from sepi.validation.models import validated

BLOCK = 512
"""Bytes of the user block; HDF5 wants a power of two, at least 512."""

_MARK = b"sepi sha256 "
# seconds after which a file's time stamp shows a later change; some disks keep times no finer
_SETTLED = 2

# whether files are sound, by device, inode, size and time
_sound: dict[tuple[int, int, int, int], bool] = {}


def members(group: h5py.Group | Mapping[str, Any]) -> list[tuple[str, Any]]:
    """Names and entries of a group, all at once.

    The iterator of h5py holds a lock until it is exhausted. If an error ends a loop early, the lock stays as long as
    the error object lives, and other threads that use HDF5 wait for ever.
    """
    return list(group.items())


def require_sound(path: Path) -> None:
    """Raise if a file of this package has changed since it was written; each process checks a file once."""
    status = path.stat()
    now = (status.st_dev, status.st_ino, status.st_size, status.st_mtime_ns)
    sound = _sound.get(now)
    if sound is None:
        # files of other programs have no digest
        with path.open("rb") as file:
            block = file.read(BLOCK)
            sound = not block.startswith(_MARK) or block == digest_block(file)
        if status.st_mtime < time.time() - _SETTLED:
            _sound[now] = sound
    if not sound:
        raise SepiError(f"{path}: damaged, or changed by another program; remove it and make it again")


def is_own(entry: h5py.Group | h5py.Dataset | None) -> bool:
    """Whether a group or dataset lies in a file that this package wrote; other programs may use the same names."""
    if entry is None:
        return False
    with Path(entry.file.filename).open("rb") as file:
        return file.read(len(_MARK)) == _MARK


def digest_block(file: io.BufferedReader | io.BufferedRandom) -> bytes:
    """User block with the digest of what follows in a file."""
    file.seek(BLOCK)
    return (_MARK + hashlib.file_digest(file, "sha256").hexdigest().encode()).ljust(BLOCK, b"\0")


def fixed_text(text: str) -> np.bytes_:
    """Text of fixed length to store; HDF5 may hang on damaged files with text of variable length."""
    return np.bytes_(text.encode() or b"\0")


Attribute = str | float | int | tuple[float, ...]

RIG = "rig"
"""Attribute of a result: poses of the calibrated cameras, as JSON."""

# datasets of a light field: its arrays, and the rest as JSON
_ARRAYS, _PROPERTIES = ("views", "present", "missing", "positions"), "properties"
# datasets of a cost volume
_COSTS, _CANDIDATES = "cost_volume", "candidates"

_STEPS, _METRES = "pixels per view step", "metres"
UNITS = {
    **dict.fromkeys(("disparity", *ERROR_BARS, LIGHT_DEVIATION, _CANDIDATES, "ground_truth", "error"), _STEPS),
    **dict.fromkeys(("positions", "baselines"), "view steps"),
    "confidence": "0..1",
    **dict.fromkeys(("depth", "depth_sigma", "nearest", "farthest"), _METRES),
}
"""Units of arrays, by their names."""

PACKED = {"compression": "gzip", "compression_opts": 1}
"""Arguments for h5py to compress arrays that shrink to almost nothing."""


def write_stage(path: Path, maps: StageMaps, attributes: Mapping[str, Attribute]) -> None:
    """Write a stage's maps and the attributes that say what made them."""
    with create_hdf5(path) as file:
        put_maps(file, maps)
        file.attrs.update(attributes)


def put(group: h5py.Group, name: str, values: npt.NDArray[Any], **attributes: Any) -> h5py.Dataset:
    """Write an array with its units; only small integers and masks are compressed, since float maps hardly shrink."""
    dataset = group.create_dataset(name, data=values, **(PACKED if values.dtype.itemsize < 4 else {}))
    dataset.attrs.update(({"units": UNITS[name]} if name in UNITS else {}) | attributes)
    return dataset


def put_maps(file: h5py.File, maps: StageMaps) -> None:
    """Write a stage's maps."""
    # sorted, as they are read back, so that a copy has the same bytes
    for name, values in sorted(maps.all().items()):
        dataset = put(file, name, values)
        if name == "view_subset":
            dataset.attrs["names"] = [fixed_text(subset) for subset in maps.subset_names]
    if maps.cost_volume is not None:
        # half precision hardly compresses
        file.create_dataset(_COSTS, data=maps.cost_volume.costs)
        put(file, _CANDIDATES, maps.cost_volume.disparities)


def read_stage(path: Path) -> StageMaps:
    """Read the maps that ``write_stage`` wrote."""
    with open_hdf5(path, "stage file") as file:
        maps = {name: read_dataset(path, file[name]) for name in file}
        subset = file.get("view_subset")
        names = () if subset is None else tuple(name.decode() for name in attribute(subset, "names"))
        volume = CostVolume(maps.pop(_CANDIDATES), maps.pop(_COSTS)) if _COSTS in maps else None
        return StageMaps(maps.pop("disparity"), maps.pop("confidence"), maps, names, volume)


def read_attributes(path: Path, check: bool = True) -> dict[str, Any]:
    """Attributes of an HDF5 file; ``check=False`` does not read the whole file for its digest."""
    with open_hdf5(path, check=check) as file:
        return {name: attribute(file, name) for name in file.attrs}


COMPARABLE = "comparable"
"""Attribute of a light field: whether stages compare its views as they are (:mod:`sepi.inspection.coded_views`)."""


class Properties(BaseModel, defer_build=True):
    """What a light field has beside its arrays, as its files keep it."""

    name: str
    source: str = ""
    reading: str = ""
    view: tuple[int, int] | None = None
    row_spacing: float = 1.0
    disparity_range: DisparityRange | None = None
    camera: Camera | None = None
    notes: tuple[str, ...] = ()
    rig: str | None = None

    @staticmethod
    def of(light_field: LightField) -> dict[str, Any]:
        """The properties of a light field, by name."""
        own = {key: getattr(light_field, key) for key in Properties.model_fields}
        return own | {"rig": light_field.rig and light_field.rig.to_text()}

    def fields(self) -> dict[str, Any]:
        """The fields of a light field with these properties."""
        own = {key: getattr(self, key) for key in Properties.model_fields}
        return own | {"rig": None if self.rig is None else Rig.from_text(self.rig), "settled": True}


def write_light_field(path: str | Path, light_field: LightField, comparable: bool = False) -> None:
    """Write a light field with all its properties, whole or not at all; reading gives it back unchanged.

    Parameters
    ----------
    path : str or Path
        HDF5 file to write; :func:`sepi.read_light_field` reads it. Equal content gives equal bytes.
    light_field : LightField
    comparable : bool
        Whether its views are known to be comparable, for jobs on the file.

    Raises
    ------
    SepiError
        If the file cannot be written.

    Examples
    --------
    One file instead of a folder of images, with view positions that no other format holds:

    >>> from pathlib import Path
    >>> import numpy as np
    >>> import sepi
    >>> from sepi.io.hdf5 import write_light_field
    >>> from sepi.scenes import render
    >>> positions = np.array([[(0, 0), (0.25, 1)], [(1, 0), (1, 1.5)]], float)
    >>> light_field = render("dots", size=64, views=2, positions=positions)
    >>> write_light_field(Path("dots.h5"), light_field)
    >>> again = sepi.read_light_field("dots.h5")
    >>> bool((again.views == light_field.views).all()), again.baselines[0, 1].tolist()
    (True, [-0.75, -0.5])
    """
    path = require_path("light field to write", path)
    require_light_field(light_field)
    known = light_field.disparity_range
    with create_hdf5(path) as file:
        # gzip takes 1.8 s to halve the 64 MB of a benchmark scene: too slow for an intermediate file
        file.create_dataset("views", data=light_field.views).attrs["axes"] = "t s y x channel"
        for name in _ARRAYS[1:]:
            if (values := getattr(light_field, name)) is not None:
                put(file, name, values)
        text = Properties(**Properties.of(light_field)).model_dump_json()
        put(file, _PROPERTIES, np.frombuffer(text.encode(), np.uint8))
        # jobs on this file need these, and must not read the views for them
        file.attrs["reach"] = light_field.reach
        if known is not None:
            file.attrs["disparity_range"] = known.minimum, known.maximum
        if comparable:
            file.attrs[COMPARABLE] = True
        put_truth(file, (light_field.ground_truth, light_field.masks))


def float_maps(path: Path, file: h5py.File, part: Any = ...) -> dict[str, npt.NDArray[np.float32]]:
    """Those of disparity, confidence and error bars that a file has, or a part of each."""
    names = ("disparity", "confidence", *ERROR_BARS)
    return {name: read_dataset(path, file[name], part).astype(np.float32) for name in names if name in file}


def put_truth(file: h5py.File, truth: Truth) -> None:
    """Write ground truth and masks, if there are any."""
    ground_truth, masks = truth
    if ground_truth is not None:
        put(file, "ground_truth", ground_truth)
    for name, mask in sorted(masks.items()):
        put(file, f"masks/{name}", mask)


def truth_in(path: Path, file: h5py.File) -> Truth:
    """Ground truth and masks that :func:`put_truth` wrote."""
    ground_truth = read_dataset(path, file["ground_truth"]).astype(np.float32) if "ground_truth" in file else None
    return ground_truth, {name: read_dataset(path, mask).astype(bool) for name, mask in members(file.get("masks", {}))}


def has_dataset(path: Path, name: str, wanted: Callable[[Any], object] = bool, *, if_damaged: bool = False) -> bool:
    """Whether ``path`` is an HDF5 file with an entry that is ``wanted``; ``if_damaged`` if it cannot be read."""
    if not path.is_file() or not h5py.is_hdf5(path):
        return False
    try:
        require_sound(path)
        with h5py.File(path, "r") as file:
            return bool(wanted(file.get(name)))
    except (SepiError, OSError, LookupError, ValueError, RuntimeError):
        return if_damaged


def read_light_field(path: Path) -> LightField:
    """Read a light field written by ``write_light_field``."""
    with open_hdf5(path, "light field of this package") as file:
        if "render" in file.attrs:
            raise SepiError(f"{path}: light of a path-traced scene, not a light field; give the scene's folder instead")
        arrays: dict[str, Any] = {name: read_dataset(path, file[name]) for name in _ARRAYS if name in file}
        ground_truth, masks = truth_in(path, file)
        known = validated(Properties, json.loads(read_dataset(path, file[_PROPERTIES]).tobytes()), "light field")
        return LightField(**arrays, **known.fields(), ground_truth=ground_truth, masks=masks)


def attribute(holder: h5py.Group | h5py.Dataset, key: str) -> Any:
    """Value of an attribute; text of fixed length becomes str.

    Raises
    ------
    KeyError
        If there is none.
    SepiError
        If it is text of variable length, in a file of another program.
    """
    # on a damaged file HDF5 may hang or crash at such text; own files were checked when they were opened
    if holder.attrs.get_id(key).dtype.hasobject and not is_own(holder):
        raise SepiError(f"attribute '{printable(key)}': expected numbers, or text of fixed length")
    value = holder.attrs[key]
    return value.decode("utf-8", "replace") if isinstance(value, bytes) else value


def read_dataset(path: Path, dataset: h5py.Dataset, part: Any = ...) -> npt.NDArray[Any]:
    """Values of a dataset, or a part of them.

    Raises
    ------
    SepiError
        If ``dataset`` is not a dataset, lies in another file, or its bytes in the file cannot hold its shape; memory is
        only taken after this check.
    """
    name = printable(str(dataset.name).lstrip("/"))
    if not isinstance(dataset, h5py.Dataset) or dataset.shape is None:
        raise SepiError(f"{path}: damaged HDF5 file: '{name}' is not an array")
    if dataset.is_virtual or dataset.external or dataset.file.filename != str(path):
        raise SepiError(f"{path}: the values of '{name}' lie in another file; copy them into this one")
    if dataset.dtype.hasobject:
        # HDF5 may hang or crash, as at such attributes
        raise SepiError(f"{path}: the values of '{name}' are of variable length; expected numbers")
    held = dataset.id.get_storage_size()
    # uncompressed values take their full size, except chunks that were never written
    if held > path.stat().st_size or dataset.nbytes > held * (DEFLATE_RATIO if dataset.chunks else 1):
        raise SepiError(f"{path}: damaged HDF5 file: '{name}' of shape {dataset.shape} cannot lie in {held} bytes")
    return np.asarray(dataset[part])


@contextmanager
def open_hdf5(path: Path, kind: str = "readable HDF5 file", check: bool = True) -> Iterator[h5py.File]:
    """Open an HDF5 file for reading; messages call it ``kind``.

    Raises
    ------
    SepiError
        If it is missing, not HDF5, or has a digest that differs from that of its content.
    """
    if not path.is_file():
        raise SepiError(f"{path}: no such file")
    with reading(path, kind):
        if check:
            require_sound(path)
        with no_interrupt_lost(), h5py.File(path, "r") as file:
            yield file


@contextmanager
def create_hdf5(path: Path) -> Iterator[h5py.File]:
    """Write an HDF5 file, whole or not at all."""
    with atomic_path(path) as temporary:
        with no_interrupt_lost(), PatientFile(temporary, "w+") as disk:
            with h5py.File(disk, "w", userblock_size=BLOCK) as file:
                yield file
            if disk.failure is not None:
                raise disk.failure
        with temporary.open("r+b") as written:
            block = digest_block(written)
            written.seek(0)
            written.write(block)


def write_truth(path: Path, truth: Truth) -> None:
    """Write the ground truth and masks of a scene; equal content gives equal bytes."""
    with create_hdf5(path) as file:
        put_truth(file, truth)


def read_with_truth(light_field: Path, truth: Path | None) -> LightField:
    """Light field with the ground truth from a truth file; without that file, with its own.

    Raises
    ------
    SepiError
        If a file is missing or of another kind, or they differ in size.
    """
    found = read_light_field(light_field)
    if truth is None:
        return found
    with open_hdf5(truth, "truth file (written by python -m sepi.truth)") as file:
        ground_truth, masks = truth_in(truth, file)
        return replace(found, ground_truth=ground_truth, masks=masks)
