"""The parameters of the stages in the configuration: those that several choices share are stated once.

Below ``stages`` a value stands at ``shared.GROUP.NAME``, for all choices that have the group, or at
``STAGE.CHOICE.NAME`` for one of them, which goes before. A choice whose own default differs from the group's is not
reached by the group.
"""

from __future__ import annotations

import inspect
from collections.abc import Mapping
from typing import Any

from sepi.compared.guided_costs import GuidedCostsParameters
from sepi.compared.occ import OccParameters
from sepi.image.edges import CannyParameters
from sepi.matching.base_detail import BaseDetailParameters
from sepi.matching.denoising import DenoisingParameters
from sepi.matching.plane_sweep import SweepParameters
from sepi.matching.semi_global import SmoothingParameters
from sepi.matching.visibility_sweep import VisibilitySweepParameters
from sepi.models import validated
from sepi.occlusion import OcclusionParameters
from sepi.stage import OcclusionMarginParameters, Parameters
from sepi.validation import require_known
from sepi.variants import STAGES, Variant

SHARED = "shared"
"""The key beside the stages."""

GROUPS: dict[str, type[Parameters]] = {
    "plane_sweep": SweepParameters,
    "canny_edges": CannyParameters,
    "view_subsets": OcclusionParameters,
    "denoising": DenoisingParameters,
    "base_detail": BaseDetailParameters,
    "base_detail_sweep": VisibilitySweepParameters,
    "semi_global_smoothing": SmoothingParameters,
    "occluders": OcclusionMarginParameters,
    "guided_costs": GuidedCostsParameters,
    "angular_patches": OccParameters,
}
"""Name of a group to the model that declares it."""

Values = Mapping[str, Mapping[str, Mapping[str, Any] | None] | None]
"""Stage to choice to field to value, and the groups beside the stages."""


def fields_of(group: str) -> list[str]:
    """The parameters of a group."""
    model = GROUPS[group]
    return [name for name in inspect.get_annotations(model) if name in model.model_fields]


def choices_with(group: str) -> list[str]:
    """The choices that have a group, as ``STAGE.CHOICE``."""
    return [
        f"{stage}.{name}"
        for stage, choices in STAGES.items()
        for name, choice in choices.items()
        if issubclass(choice.parameters, GROUPS[group])
    ]


def shared_by(model: type[Parameters]) -> dict[str, str]:
    """The fields of a choice that it takes from a group, with the group: those whose default is the group's."""
    return {
        name: group
        for group, declared in GROUPS.items()
        if issubclass(model, declared)
        for name in fields_of(group)
        if model.model_fields[name].default == declared.model_fields[name].default
    }


def default_values() -> dict[str, Any]:
    """Every default, stated once."""
    defaults = {group: model().model_dump() for group, model in GROUPS.items()}
    found = {SHARED: {group: {name: defaults[group][name] for name in fields_of(group)} for group in GROUPS}}
    for stage, choices in STAGES.items():
        found[stage] = {
            name: choice.parameters().model_dump(exclude=set(shared_by(choice.parameters)))
            for name, choice in choices.items()
        }
    return found


def stage_settings(values: Values, variants: Mapping[str, Variant]) -> dict[str, dict[str, Parameters]]:
    """Stage to label to what the stage is run with: for every choice, and for every choice that a variant overrides.

    Parameters
    ----------
    values : mapping
        What the configuration has below ``stages``.
    variants : mapping of str to Variant
        By name.

    Raises
    ------
    SepiError
        One line that names the first group, stage, choice, field or value that is wrong.
    """
    where = "config.stages"
    require_known(where, values, [SHARED, *STAGES])
    shared = values.get(SHARED) or {}
    require_known(f"{where}.{SHARED}", shared, GROUPS)
    for group, settings in shared.items():
        require_known(f"{where}.{SHARED}.{group}", settings or {}, fields_of(group))
        validated(GROUPS[group], settings or {}, f"{where}.{SHARED}.{group}")
    found: dict[str, dict[str, Parameters]] = {}
    for stage, choices in STAGES.items():
        own = values.get(stage) or {}
        require_known(f"{where}.{stage}", own, choices)
        defaults = {name: _with_shared(choice.parameters, own.get(name), shared) for name, choice in choices.items()}
        found[stage] = {
            name: validated(choice.parameters, defaults[name], f"{where}.{stage}.{name}")
            for name, choice in choices.items()
        }
        for variant_name, variant in variants.items():
            choice = variant.choices[stage]
            found[stage][variant.labels[stage]] = validated(
                choices[choice].parameters,
                {**defaults[choice], **variant.overrides.get(stage, {})},
                f"config.variants.{variant_name}.{stage}",
            )
    return found


def _with_shared(
    model: type[Parameters], own: Mapping[str, Any] | None, shared: Mapping[str, Mapping[str, Any] | None]
) -> dict[str, Any]:
    """The values of a choice: its groups', then its own."""
    groups = {name: shared.get(group) or {} for name, group in shared_by(model).items()}
    return {name: values[name] for name, values in groups.items() if name in values} | dict(own or {})
