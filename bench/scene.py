"""Inputs of the cases: a scene as files, and light fields of other sizes made from it."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from sepi.inspection.disparity_range import settle_range
from sepi.io.hdf5 import read_light_field, read_stage, write_light_field, write_stage
from sepi.io.provenance import stage_attributes
from sepi.lightfield import LightField
from sepi.reading import read_light_field as read_any
from sepi.scenes import SCENES, render
from sepi.scenes.folder import write_hci
from sepi.stage import Parameters, StageMaps, entry, no_progress
from sepi.variants import STAGES, stage_parameters, variant_named

VARIANT = "paper"
"""Variant whose steps are measured."""

GROWING_SCENE = "curved_occluders"


@dataclass(frozen=True)
class Scene:
    """A scene, and the folder of the files that its cases share.

    Attributes
    ----------
    name : str
        Name of a built-in scene, or the path of a light field.
    folder : Path
        Holds the light field ``scene.h5``, its range settled, and the maps after each stage, such as ``initial.h5``.
    num_disparities : int
        Candidates of the stages that sweep.
    threads : int
        Threads of the run.
    small : bool
        Whether to measure on a tiny scene.
    """

    name: str
    folder: Path
    num_disparities: int
    threads: int
    small: bool

    @property
    def source(self) -> Path:
        """The light field's source: a folder of PNG files, or the path given."""
        return self.folder / self.name if self.name in SCENES else Path(self.name).absolute()

    @property
    def path(self) -> Path:
        """The light field as HDF5."""
        return self.folder / "scene.h5"

    @cached_property
    def parameters(self) -> dict[str, Parameters]:
        """Parameters of each stage."""
        return stage_parameters(variant_named(VARIANT), sweep_values(self.num_disparities))

    def write_files(self) -> LightField:
        """Write the light field and the maps after each stage; returns the light field."""
        if self.name in SCENES:
            size, views = (64, 5) if self.small else (512, 9)
            light_field = render(self.name, size=size, views=views)
            write_hci(light_field, self.source)
        else:
            light_field = settle_range(read_any(self.source))
        write_light_field(self.path, light_field)
        maps: StageMaps | None = None
        entries = []
        for stage, choice in variant_named(VARIANT).choices.items():
            maps = STAGES[stage][choice].run(light_field, maps, self.parameters[stage], no_progress)
            entries.append(entry(stage, choice, self.parameters[stage], light_field))
            write_stage(self.folder / f"{stage}.h5", maps, stage_attributes(light_field, entries))
        return light_field

    def grown(self, size: int, views: int) -> Path:
        """File of a light field of this size and this many views a side."""
        return self.folder / f"{size}x{views}.h5"

    def write_grown(self, needed: Collection[tuple[int, int]]) -> None:
        """Write the files of :meth:`grown`, each of a size and a number of views a side.

        The picture is cropped or tiled, which keeps its texture; outer views are left out.
        """
        whole = render(GROWING_SCENE, size=64 if self.small else 192, views=max(views for _, views in needed))
        for size, views in set(needed):
            t, s = whole.reference_position[0] - views // 2, whole.reference_position[1] - views // 2
            some = whole.views[t : t + views, s : s + views]
            copies = [-(-size // length) for length in whole.shape]
            some = np.tile(some, (1, 1, *copies, 1))[:, :, :size, :size]
            path = self.grown(size, views)
            write_light_field(path, LightField(some, path.stem, disparity_range=whole.disparity_range))


def sweep_values(num_disparities: int) -> dict[str, dict[str, int]]:
    """Parameters of the stages that sweep."""
    return {stage: {"num_disparities": num_disparities} for stage in ("initial", "occlusion")}


def inputs(path: Path, stage: str) -> tuple[LightField, StageMaps | None]:
    """A light field and the maps of the stage before; None for the first stage."""
    names = list(STAGES)
    number = names.index(stage)
    return read_light_field(path), read_stage(path.with_name(f"{names[number - 1]}.h5")) if number else None
