"""Names of rendered scenes in the workflow and in reports: scene, noise level and noise seed."""

from __future__ import annotations

import re
from typing import Literal, NamedTuple, get_args

DATASET = "rendered"
"""Name of the dataset of rendered scenes and of its report."""


NoiseLevel = Literal["off", "low", "high"]

NOISE_LEVELS: tuple[NoiseLevel, ...] = get_args(NoiseLevel)
"""Levels of sensor noise: none, that of a quiet camera, and that of a dim evening."""

WITHOUT_NOISE: NoiseLevel = "off"
"""The level without noise; it is not part of a scene's name, and has one seed only."""


class RenderedScene(NamedTuple):
    """A rendered scene with noise.

    Attributes
    ----------
    world : str
        Name of the scene without noise.
    noise : str
        One of :data:`NOISE_LEVELS`.
    seed : int
        Seed of the noise, from 1.
    """

    world: str
    noise: str = WITHOUT_NOISE
    seed: int = 1

    @property
    def name(self) -> str:
        """The scene's name: ``sticks``, ``sticks_low`` at a level of noise, or with another seed ``sticks_low_2``."""
        exposure = [] if self.noise == WITHOUT_NOISE else [self.noise, *([str(self.seed)] if self.seed != 1 else [])]
        return "_".join([self.world, *exposure])


def rendered_scene(name: str) -> RenderedScene:
    """Parse a scene's name."""
    levels = "|".join(level for level in NOISE_LEVELS if level != WITHOUT_NOISE)
    found = re.fullmatch(rf"(.+?)(?:_({levels})(?:_(\d+))?)?", name)
    assert found is not None
    return RenderedScene(found[1], found[2] or WITHOUT_NOISE, int(found[3] or 1))
