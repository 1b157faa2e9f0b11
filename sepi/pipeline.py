"""The stages in order, the built-in variants, and the whole way from a light field to a depth map."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from sepi import initial, occlusion, optimize, textureless
from sepi.lightfield import LightField
from sepi.matching.base_detail import forget_layers
from sepi.stage import Choice, Parameters, Progress, StageMaps, no_progress
from sepi.validation import require_known, unknown, validated

STAGES: dict[str, dict[str, Choice]] = {
    "initial": initial.CHOICES,
    "occlusion": occlusion.CHOICES,
    "textureless": textureless.CHOICES,
    "optimize": optimize.CHOICES,
}
"""Stage to its choices, in the order in which the stages run."""

HANDED_ON = "none"
"""The choice of a stage that hands on the maps of the stage before: it is no job and has no file."""

# rough part of the running time, for the progress bar only
_SHARE = {"initial": 0.25, "occlusion": 0.35, "textureless": 0.1, "optimize": 0.3}


@dataclass(frozen=True)
class Variant:
    """One choice for each stage.

    Raises
    ------
    SepiError
        If a word is not one of the stage's choices.
    """

    initial: str
    occlusion: str
    textureless: str
    optimize: str

    def __post_init__(self) -> None:
        for stage, choice in self.choices.items():
            require_known(f"variant, stage {stage}", [choice], STAGES[stage])

    @property
    def choices(self) -> dict[str, str]:
        """Stage to choice, in the order of the stages."""
        return {stage: getattr(self, stage) for stage in STAGES}


def key_of(choices: Mapping[str, str], stage: str) -> str:
    """What names the maps after a stage: the choices up to the stage that made them, ``"sepi/half_sepi/lti"``.

    Variants that begin alike share it, and a stage that hands maps on has that of the stage before. It is the folder of
    the stage file.

    Parameters
    ----------
    choices : mapping of str to str
        Stage to choice, in the order of the stages.
    stage : str
    """
    words = list(choices.values())[: list(choices).index(stage) + 1]
    while words[-1] == HANDED_ON:
        words.pop()
    return "/".join(words)


def stage_of(choices: Mapping[str, str], key: str) -> str:
    """The stage that made the maps which :func:`key_of` names."""
    return list(choices)[key.count("/")]


VARIANTS: dict[str, Variant] = {
    "paper": Variant("sepi", "half_sepi", "lti", "wls"),
    "no_sepi": Variant("structure_tensor", "half_sepi", "lti", "wls"),
    "no_occlusion": Variant("sepi", "none", "lti", "wls"),
    "no_textureless": Variant("sepi", "half_sepi", "none", "wls"),
    "no_occlusion_no_textureless": Variant("sepi", "none", "none", "wls"),
    "wang": Variant("sepi", "wang", "lti", "wls"),
    "best": Variant("semi_global", "visibility", "uniform_planes", "second_order"),
    "best_paper_initial": Variant("sepi", "visibility", "uniform_planes", "second_order"),
    "best_no_detail": Variant("semi_global_colours", "visibility_colours", "uniform_planes", "second_order_colours"),
    "best_half_sepi": Variant("semi_global", "half_sepi", "uniform_planes", "second_order"),
    "best_no_mixture": Variant("semi_global", "visibility_unmixed", "uniform_planes", "second_order"),
    "best_no_planes": Variant("semi_global", "visibility", "none", "second_order"),
    "best_no_smoothing": Variant("semi_global", "visibility", "uniform_planes", "gauss_newton"),
    "best_wls": Variant("semi_global", "visibility", "uniform_planes", "wls"),
}
"""The paper's method, the other four columns of its table 4 in their order, and the text's other occlusion stage; then
the most accurate variant, and the same with one part switched off or put back to the paper's."""

DEFAULT_VARIANT = "best"
"""Variant of ``sepi depth``."""

PARTS_OF_BEST: dict[str, str] = {
    "best": "all parts",
    "best_paper_initial": "the paper's initial depth",
    "best_no_detail": "colours alone, no detail layer",
    "best_half_sepi": "half-SEPIs, no visibility",
    "best_no_mixture": "no colour mixture at steps",
    "best_no_planes": "no planes in uniform regions",
    "best_no_smoothing": "Gauss-Newton, no smoothing",
    "best_wls": "the paper's global optimisation",
}
"""Rows of the ablation of ``best``, and what they leave out or put back."""


def variant_named(name: str) -> Variant:
    """A built-in variant.

    Raises
    ------
    SepiError
        If there is none of this name.
    """
    if name not in VARIANTS:
        raise unknown("variant", name, VARIANTS)
    return VARIANTS[name]


def stage_parameters(
    variant: Variant, parameters: Mapping[str, Mapping[str, Any]] | None = None
) -> dict[str, Parameters]:
    """Parameters of each stage of ``variant``: the defaults, but for what ``parameters`` sets.

    Raises
    ------
    SepiError
        If a stage or a field is unknown or a value is not allowed; the message names it.
    """
    given = parameters or {}
    require_known("parameters", given, STAGES)
    return {
        stage: validated(STAGES[stage][choice].parameters, given.get(stage, {}), f"{stage}.{choice}")
        for stage, choice in variant.choices.items()
    }


def estimate_depth(
    light_field: LightField,
    variant: str | Variant = DEFAULT_VARIANT,
    parameters: Mapping[str, Mapping[str, Any]] | None = None,
    progress: Progress = no_progress,
) -> StageMaps:
    """Disparity, confidence and masks of a light field's reference view.

    Parameters
    ----------
    light_field : LightField
        Where its disparity range is unknown, it is estimated from the views.
    variant : str or Variant
        Name of a built-in variant, or a choice for each stage.
    parameters : mapping, optional
        Stage to field to value, where the defaults do not suit: ``{"initial": {"num_disparities": 91}}``.
    progress : callable
        Called with the fraction done, 0..1.

    Returns
    -------
    StageMaps
        ``disparity`` (H, W) float32 in pixels per view step, ``confidence`` (H, W) float32 in 0..1, ``extra`` maps of
        the stages.

    Raises
    ------
    SepiError
        If the variant, a stage or a field is unknown, or a value is not allowed.
    """
    chosen = variant_named(variant) if isinstance(variant, str) else variant
    settings = stage_parameters(chosen, parameters)
    if light_field.disparity_range is None:
        from sepi.inspection.disparity_range import estimate_range

        light_field = light_field.with_range(estimate_range(light_field))
    maps: StageMaps | None = None
    done = 0.0
    try:
        for stage, choice in chosen.choices.items():
            maps = STAGES[stage][choice].run(light_field, maps, settings[stage], _part(progress, done, _SHARE[stage]))
            done += _SHARE[stage]
            progress(done)
    finally:
        forget_layers()
    assert maps is not None  # there are stages
    return maps


def _part(progress: Progress, start: float, share: float) -> Progress:
    return lambda fraction: progress(start + share * fraction)
