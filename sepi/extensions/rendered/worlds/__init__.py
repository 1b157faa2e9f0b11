"""Catalogue of the path-traced scenes: their difficulty, and whether parameters may be chosen on them."""

import importlib
from typing import NamedTuple

from sepi.extensions.rendered.world import World
from sepi.validation import require_known


class Entry(NamedTuple):
    """A path-traced scene.

    Attributes
    ----------
    description : str
        Content of the scene.
    tests : str
        Difficulty that it poses.
    for_choosing : bool
        Whether parameters may be chosen on it; other scenes are held out to evaluate the choice.
    fine : bool
        Whether it is meant to have regular texture of more than 0.4 cycles per pixel at 512 pixels.
    """

    description: str
    tests: str
    for_choosing: bool
    fine: bool = False


RENDERED: dict[str, Entry] = {
    "sticks": Entry("sticks, boxes and books in a heap", "many depths in a small window, thin occluders", True),
    "foliage": Entry("shrubs and a bough before a plastered wall", "hundreds of small outlines, all alike", False),
    "wires": Entry("a wire fence and cables before a yard", "structures of one to three pixels", True),
    "room": Entry("furniture in a room with painted walls", "large surfaces without texture, at a slant", False),
    "floor": Entry("chairs and pots on a polished floor", "reflections that move against the surface", True),
    "chrome": Entry("a plane mirror, chrome and brass", "surfaces that show nothing but others", False),
    "glass": Entry("panes, a bottle and tumblers before posters", "two depths in each pixel", False),
    "cloth": Entry("curtains and a table cloth", "folds, faint texture, soft shading", True, fine=True),
    "bust": Entry("a stone head and vases", "strong curvature, outlines that turn away", True),
    "windows": Entry("house fronts with rows of windows and awnings", "repetition by whole periods", False, fine=True),
    "landscape": Entry("hills, houses and trees far away", "disparities within a pixel", True, fine=True),
    "dim": Entry("a workshop by the light of one lamp", "a tenth of the light: noise in the shadows", False),
    "houses": Entry("houses and wires before a bare sky", "stripes and checks of 3 to 12 pixels", True),
}
"""The path-traced scenes in their order."""


def world_of(name: str) -> World:
    """The world of a scene: things, lights and depths.

    Raises
    ------
    SepiError
        If there is no such scene.
    """
    require_known("path-traced scenes", [name], RENDERED)
    found: World = importlib.import_module(f"sepi.extensions.rendered.worlds.{name}").world()
    return found
