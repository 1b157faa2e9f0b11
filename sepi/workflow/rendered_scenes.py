"""Names of rendered scenes in the workflow: scene of :mod:`sepi.rendered`, noise level and noise seed."""

from __future__ import annotations

import re
from typing import NamedTuple

from sepi.rendered.catalogue import NOISE_LEVELS, WITHOUT_NOISE, exposed_name

DATASET = "rendered"
"""Name of the dataset of rendered scenes and of its report."""


class RenderedScene(NamedTuple):
    """A rendered scene with noise.

    Attributes
    ----------
    world : str
        Name in :data:`sepi.rendered.RENDERED`.
    noise : str
        One of :data:`sepi.rendered.NOISE_LEVELS`.
    seed : int
        Seed of the noise, from 1.
    """

    world: str
    noise: str = WITHOUT_NOISE
    seed: int = 1

    @property
    def name(self) -> str:
        """The scene's name."""
        return exposed_name(*self)


def rendered_scene(name: str) -> RenderedScene:
    """Parse a scene's name."""
    levels = "|".join(level for level in NOISE_LEVELS if level != WITHOUT_NOISE)
    found = re.fullmatch(rf"(.+?)(?:_({levels})(?:_(\d+))?)?", name)
    assert found is not None
    return RenderedScene(found[1], found[2] or WITHOUT_NOISE, int(found[3] or 1))
