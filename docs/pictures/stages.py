"""The maps after each stage."""

from __future__ import annotations

from pictures.maps import Titled, map_panel, sheet_of, squared_error_panel, truth_panel, view_panel
from pictures.style import Draw
from sepi.lightfield import LightField
from sepi.pipeline import estimate_depth
from sepi.scenes import render
from sepi.stage import StageMaps
from sepi.variants import HANDED_ON, STAGES, Variant, variant_named

WORDS = {"initial": "initial", "occlusion": "occlusion", "textureless": "textureless", "optimize": "optimised"}


def after_each_stage(light_field: LightField, name: str) -> dict[str, StageMaps]:
    """Stage to the maps of variant ``name`` after it: what comes later is left out."""
    chosen = variant_named(name)
    found = {}
    for number, stage in enumerate(STAGES):
        choices = {**chosen.choices, **dict.fromkeys(list(STAGES)[number + 1 :], HANDED_ON)}
        kept = {key: value for key, value in chosen.overrides.items() if choices[key] != HANDED_ON}
        found[stage] = estimate_depth(light_field, Variant(**choices, overrides=kept))
    return found


def drawing(scene: str, variant: str, size: int) -> Draw:
    """Views to maps, and the error below each map."""
    light_field = render(scene, size=size)
    stages = after_each_stage(light_field, variant)
    above: list[Titled] = [view_panel(light_field)]
    below: list[Titled] = [truth_panel(light_field)]
    for stage, maps in stages.items():
        above.append(map_panel(light_field, maps.disparity, WORDS[stage]))
        below.append(squared_error_panel(light_field, maps.disparity))
    return sheet_of([above, below])
