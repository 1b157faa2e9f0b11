"""Real benchmark scenes, read and computed once for every test that looks at them.

Maps are kept by their stages' labels, so variants share what they have in common. Tests of real scenes run in one
process (``conftest.py`` sees to it), so nothing is computed twice where tests run side by side.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np

from sepi.inspection.disparity_range import settle_range
from sepi.lightfield import LightField
from sepi.reading import read_light_field
from sepi.scoring.scores import score
from sepi.stage import StageMaps, no_progress
from sepi.variants import STAGES, VARIANTS, choice_of
from sepi.workflow.settings import stage_settings

SETTINGS = stage_settings({}, VARIANTS)
# first row and column
_CORNERS = {"cotton": (60, 120), "antinous": (60, 100)}


@cache
def views_of(folder: Path) -> LightField:
    """A scene as its files are, without a look at the order of its views."""
    return read_light_field(folder, check_order=False)


@cache
def scene(folder: Path) -> LightField:
    """A scene with its own disparity range, or one estimated from the views; a warning of its order is an error."""
    return settle_range(read_light_field(folder))


@cache
def part(folder: Path, size: int = 192, corner: tuple[int, int] | None = None) -> LightField:
    """A part of a scene, with the range of the whole: for what compares one map with another."""
    whole, (y, x) = scene(folder), corner or _CORNERS[folder.name]
    inside = np.s_[y : y + size, x : x + size]
    views = np.ascontiguousarray(whole.views[:, :, *inside])
    return replace(whole, views=views, ground_truth=whole.ground_truth[inside].copy(), masks={})


Read = Callable[[Path], LightField]


@cache
def maps_after(folder: Path, labels: tuple[str, ...], read: Read) -> StageMaps:
    """Maps after the stages whose choices are labelled so; variants share what they have in common."""
    before = maps_after(folder, labels[:-1], read) if len(labels) > 1 else None
    stage, label = list(STAGES)[len(labels) - 1], labels[-1]
    return STAGES[stage][choice_of(label)].run(read(folder), before, SETTINGS[stage][label], no_progress)


def final_maps(folder: Path, variant: str, read: Read = scene) -> StageMaps:
    """Maps after the last stage of a variant."""
    return maps_after(folder, tuple(VARIANTS[variant].labels.values()), read)


def final_scores(folder: Path, variant: str, read: Read = scene) -> dict[str, float]:
    """Scores of a variant on the whole map."""
    return score(final_maps(folder, variant, read).disparity, read(folder).ground_truth)
