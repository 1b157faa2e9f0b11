"""What the cases measure on: a scene as files, and light fields of other sizes made of one."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bench.measure import Prepared
from sepi.inspection.disparity_range import settle_range
from sepi.io.hdf5 import read_light_field, read_stage, write_light_field, write_stage
from sepi.io.provenance import entry, stage_attributes
from sepi.lightfield import LightField
from sepi.pipeline import STAGES, Variant
from sepi.reading import read_light_field as read_any
from sepi.scenes import SCENES, render
from sepi.scenes.folder import write_hci
from sepi.stage import Parameters, StageMaps, no_progress

VARIANT = "paper"
"""Variant whose steps are measured."""


@dataclass(frozen=True)
class Scene:
    """A scene and the files that its cases share.

    Attributes
    ----------
    name : str
        Of a built-in scene, or the path of a light field.
    size, views : int
        Of a built-in scene.
    folder : Path
        Holds the files.
    """

    name: str
    size: int
    views: int
    folder: Path

    @property
    def source(self) -> Path:
        """The light field as a user has it: a folder of PNG files, or the path given."""
        return self.folder / self.name if self.name in SCENES else Path(self.name)

    @property
    def light_field(self) -> Path:
        """The light field as HDF5, its range settled."""
        return self.folder / "scene.h5"

    def maps(self, stage: str) -> Path:
        """Maps after a stage."""
        return self.folder / f"{stage}.h5"


def prepare_files(scene: Scene, variant: Variant, settings: dict[str, Parameters]) -> Prepared:
    """Write the light field and the maps after each stage of a variant."""

    def call() -> None:
        if scene.name in SCENES:
            light_field = render(scene.name, size=scene.size, views=scene.views)
            write_hci(light_field, scene.source)
        else:
            light_field = settle_range(read_any(scene.source))
        write_light_field(scene.light_field, light_field)
        maps: StageMaps | None = None
        steps = []
        for stage, choice in variant.choices.items():
            maps = STAGES[stage][choice].run(light_field, maps, settings[stage], no_progress)
            steps.append(entry(stage, choice, settings[stage]))
            write_stage(scene.maps(stage), maps, stage_attributes(light_field, steps))

    return Prepared(call)


def prepare_grown(source: Path, growth: dict[str, tuple[int, int]], folder: Path) -> Prepared:
    """Write ``NAME.h5`` for each name, of the size and views a side that stand with it.

    The picture is cut off or laid side by side with itself, which keeps its texture; the outer views are left out.
    """

    def call() -> None:
        whole = read_light_field(source)
        for name, (size, views) in growth.items():
            t, s = whole.reference_position[0] - views // 2, whole.reference_position[1] - views // 2
            some = whole.views[t : t + views, s : s + views]
            copies = [-(-size // length) for length in whole.shape]
            some = np.tile(some, (1, 1, *copies, 1))[:, :, :size, :size]
            light_field = LightField(some, name, disparity_range=whole.disparity_range)
            write_light_field(folder / f"{name}.h5", light_field)

    return Prepared(call)


def prepare_render(name: str, size: int, views: int, path: Path) -> Prepared:
    """Write a built-in scene as HDF5."""
    return Prepared(lambda: write_light_field(path, render(name, size=size, views=views)))


def maps_before(scene: Scene, stage: str) -> StageMaps | None:
    """Maps that a stage builds on."""
    names = list(STAGES)
    number = names.index(stage)
    return read_stage(scene.maps(names[number - 1])) if number else None
