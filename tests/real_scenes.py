"""Real benchmark scenes, read and computed once for every test that looks at them.

Maps are kept by their stages' choices, so variants share what they have in common. Tests of real scenes run in one
process (``conftest.py`` sees to it), so nothing is computed twice where tests run side by side.
"""

from functools import cache
from pathlib import Path

from sepi.evaluate import score
from sepi.inspection.disparity_range import settle_range
from sepi.lightfield import LightField
from sepi.pipeline import STAGES, VARIANTS
from sepi.reading import read_light_field
from sepi.stage import StageMaps, no_progress


@cache
def scene(folder: Path) -> LightField:
    """A scene with its own disparity range, or one estimated from the views; a warning of its order is an error."""
    return settle_range(read_light_field(folder))


@cache
def maps_after(folder: Path, choices: tuple[str, ...]) -> StageMaps:
    """Maps after the stages named; variants share what they have in common."""
    before = maps_after(folder, choices[:-1]) if len(choices) > 1 else None
    choice = STAGES[list(STAGES)[len(choices) - 1]][choices[-1]]
    return choice.run(scene(folder), before, choice.parameters(), no_progress)


def final_maps(folder: Path, variant: str) -> StageMaps:
    """Maps after the last stage of a variant."""
    return maps_after(folder, tuple(VARIANTS[variant].choices.values()))


def final_scores(folder: Path, variant: str) -> dict[str, float]:
    """Scores of a variant on the whole map."""
    return score(final_maps(folder, variant).disparity, scene(folder).ground_truth)
