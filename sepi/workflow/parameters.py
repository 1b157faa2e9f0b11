"""The parameters of the stages in the configuration: a value stands at ``STAGE.CHOICE.NAME`` below ``stages``."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from sepi.models import validated
from sepi.stage import Parameters
from sepi.validation import require_known
from sepi.variants import STAGES, Variant

Values = Mapping[str, Mapping[str, Mapping[str, Any] | None] | None]
"""Stage to choice to field to value."""


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
        One line that names the first stage, choice, field or value that is wrong.
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
