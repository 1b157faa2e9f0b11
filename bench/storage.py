"""What HDF5's own compression costs and saves, for the views and for the maps of a stage."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import h5py

from bench.measure import Case, Figures, Prepared
from bench.scene import Scene
from sepi.io.hdf5 import read_light_field, read_stage

OPTIONS: dict[str, dict[str, Any]] = {
    "none": {},
    "lzf": {"compression": "lzf"},
    "gzip 1": {"compression": "gzip", "compression_opts": 1},
    "gzip 1, shuffled": {"compression": "gzip", "compression_opts": 1, "shuffle": True},
    "gzip 4, shuffled": {"compression": "gzip", "compression_opts": 4, "shuffle": True},
}
"""Name to arguments of h5py; filters that plain h5py cannot read are left out."""


def _contents(scene: Scene) -> dict[str, dict[str, Any]]:
    """What is stored: all views; the maps of 32 bits and the masks of 8 of the last stage."""
    maps = read_stage(scene.maps("optimize")).all()
    return {
        "views": {"views": read_light_field(scene.light_field).views},
        "maps": {name: values for name, values in maps.items() if values.dtype.itemsize >= 4},
        "masks": {name: values for name, values in maps.items() if values.dtype.itemsize < 4},
    }


def write(scene: Scene, content: str, option: str) -> Prepared:
    """Write a file; says its size."""
    arrays = _contents(scene)[content]
    path = scene.folder / f"{content} {option}.h5"

    def call() -> None:
        with h5py.File(path, "w") as file:
            for name, values in arrays.items():
                file.create_dataset(name, data=values, **OPTIONS[option])

    return Prepared(call, lambda _: _size(path))


def read(scene: Scene, content: str, option: str) -> Prepared:
    """Read the file that :func:`write` left."""
    path = scene.folder / f"{content} {option}.h5"

    def call() -> None:
        with h5py.File(path) as file:
            for name in file:
                file[name][...]

    return Prepared(call, lambda _: _size(path))


def _size(path: Path) -> Figures:
    return {"megabytes": path.stat().st_size / 1e6}


def cases(scene: Scene, threads: int, options: Sequence[str] = tuple(OPTIONS)) -> list[Case]:
    """Writing, then reading, of each content with each option."""
    return [
        Case(f"storage, {way.__name__}", f"{content}: {option}", way, (scene, content, option), threads=threads)
        for content in ("views", "maps", "masks")
        for option in options
        for way in (write, read)
    ]
