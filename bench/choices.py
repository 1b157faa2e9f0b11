"""Final scores with one implementation choice of the method changed at a time.

The paper does not specify all steps; docs/method/paper.md lists the choices made. This command prints the table that
supports them, for scenes with ground truth, given as folders, files or names of built-in scenes:
``python -m bench.choices SCENE...``
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click
from tabulate import tabulate

from sepi.errors import SepiError
from sepi.inspection.disparity_range import settle_range
from sepi.lightfield import LightField
from sepi.process.command import SepiCommand
from sepi.reading import read_light_field
from sepi.scenes import SCENES, render
from sepi.scoring.scores import score
from sepi.stage import StageMaps, no_progress
from sepi.variants import STAGES, variant_named

ALTERNATIVES: dict[str, tuple[str, dict[str, Any]]] = {
    "as chosen": ("", {}),
    "no cost window": ("initial", {"window_radius": 0}),
    "3x3 window": ("initial", {"window_radius": 1}),
    "box window (colour ignored)": ("initial", {"window_sigma": 10.0}),
    "squared differences (scale 1)": ("initial", {"scale": 1.0}),
    "scale doubled": ("initial", {"scale": 0.033}),
    "91 candidates": ("initial", {"num_disparities": 91}),
    "gains doubled": ("occlusion", {"gain_half": 0.03, "gain_quarter": 0.06}),
    "halves only, no quarters": ("occlusion", {"gain_quarter": 1.0}),
    "side not confirmed": ("occlusion", {"gain_unconfirmed": 0.0}),
    "only confirmed sides": ("occlusion", {"gain_unconfirmed": 2.0}),
    "candidates within 4 px": ("occlusion", {"candidate_reach": 4}),
    "planes overrule any depth": ("textureless", {"min_support": 1.0, "keep_confidence": 1.0}),
    "planes smooth only": ("textureless", {"min_support": 0.0}),
    "no continuity between superpixels": ("textureless", {"continuity": 0.0}),
    "data weight at discontinuities as printed": ("optimize", {"discontinuity_weight": 1e-6}),
    "no cut of the data weight at discontinuities": ("optimize", {"discontinuity_weight": 1.0}),
    "confidence itself as weight": ("optimize", {"confidence_power": 1.0}),
    "alpha a third": ("optimize", {"alpha": 1e-6}),
    "alpha threefold": ("optimize", {"alpha": 1e-5}),
}
"""Label to a stage of variant ``paper`` and its changed parameters."""


def final_maps(
    light_field: LightField, changed: str, parameters: dict[str, Any], known: dict[tuple[Any, ...], StageMaps]
) -> StageMaps:
    """Maps of variant ``paper`` with a changed stage; stages before the change are taken from ``known``."""
    maps: StageMaps | None = None
    key: tuple[Any, ...] = ()
    for stage, choice in variant_named("paper").choices.items():
        values = parameters if stage == changed else {}
        key = (*key, tuple(sorted(values.items())))
        if key not in known:
            selected = STAGES[stage][choice]
            known[key] = selected.run(light_field, maps, selected.parameters(**values), no_progress)
        maps = known[key]
    assert maps is not None
    return maps


def opened(name: str) -> LightField:
    """A built-in scene by name, or a light field by path, with a disparity range."""
    light_field = render(name) if name in SCENES else read_light_field(Path(name))
    return settle_range(light_field)


def table(scenes: list[str]) -> str:
    """Markdown: a row per alternative, a column per scene, MSE x100 / BadPix 0.07 % on the whole map.

    Cells equal to the first row's are empty.
    """
    names = []
    columns = [list(ALTERNATIVES)]
    for scene in scenes:
        light_field = opened(scene)
        if light_field.ground_truth is None:
            raise SepiError(f"{scene}: has no ground truth to score against")
        known: dict[tuple[Any, ...], StageMaps] = {}
        found = [
            score(final_maps(light_field, *alternative, known).disparity, light_field.ground_truth)
            for alternative in ALTERNATIVES.values()
        ]
        names.append(light_field.name)
        as_chosen, *others = (f"{s['mse100']:.2f} / {s['badpix007']:.1f}" for s in found)
        columns.append([as_chosen, *("" if text == as_chosen else text for text in others)])
    return str(tabulate(zip(*columns, strict=True), ["changed", *names], tablefmt="pipe"))


@click.command(name="python -m bench.choices", cls=SepiCommand)
@click.argument("scenes", nargs=-1, required=True)
def main(scenes: tuple[str, ...]) -> None:
    """Print the final score of SCENES with one choice of the method changed at a time."""
    click.echo(table(list(scenes)))


if __name__ == "__main__":
    main()
