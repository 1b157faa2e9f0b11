"""The stages' parameters in the configuration: ``STAGE.CHOICE.NAME`` below ``stages``."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from sepi.stage import Parameters
from sepi.validation import require_known
from sepi.validation.models import validated
from sepi.variants import STAGES, Variant

Values = Mapping[str, Mapping[str, Mapping[str, Any] | None] | None]
"""Stage to choice to field to value."""


def stage_settings(values: Values, variants: Mapping[str, Variant]) -> dict[str, dict[str, Parameters]]:
    """Stage to label to parameters, for every choice and for every choice with a variant's overrides.

    Parameters
    ----------
    values : mapping
        The configuration's ``stages``.
    variants : mapping of str to Variant
        By name.

    Raises
    ------
    SepiError
        At the first wrong stage, choice, field or value; the one-line message names it.
    """
    where = "config.stages"
    require_known(where, values, STAGES)
    found: dict[str, dict[str, Parameters]] = {}
    for stage, choices in STAGES.items():
        own = values.get(stage) or {}
        require_known(f"{where}.{stage}", own, choices)
        found[stage] = {
            name: validated(choice.parameters, own.get(name) or {}, f"{where}.{stage}.{name}")
            for name, choice in choices.items()
        }
        for variant_name, variant in variants.items():
            choice = variant.choices[stage]
            found[stage][variant.labels[stage]] = validated(
                choices[choice].parameters,
                {**(own.get(choice) or {}), **variant.overrides.get(stage, {})},
                f"config.variants.{variant_name}.{stage}",
            )
    return found
