"""The compared methods' choices of the stages, and their variants: the one list of them.

A method's module defines ``CHOICES``, for each stage the choices that it adds, and ``VARIANT``, the entry that
:func:`sepi.variants.variant_from` reads. The workflow runs a job again when the module of its choice changes, or one
that this imports, not when another method does.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import ModuleType
from typing import Any

from sepi.compared import acc, cae, guided_costs, markov_field, mishiba, oavc, occ, onnx_network, pobr, spo
from sepi.stage import Choice

METHODS: dict[str, ModuleType] = {
    "oavc": oavc,
    "cae": cae,
    "pobr": pobr,
    "spo": spo,
    "mishiba": mishiba,
    "acc": acc,
    "occ": occ,
}
"""Variant to the method's module, in the order of the paper's tables."""

LEARNED: dict[str, ModuleType] = {"onnx": onnx_network}
"""Variant to the module of methods that need what the package does not bring: no report has them unless asked to."""

_SHARED = (guided_costs, markov_field)

VARIANT_ENTRIES: dict[str, dict[str, Any]] = {name: one.VARIANT for name, one in (METHODS | LEARNED).items()}
"""The variants, as the pipeline has its own."""


def choices_of(stage: str) -> Mapping[str, Choice]:
    """What the methods add to the choices of a stage."""
    return {
        name: choice
        for module in (*METHODS.values(), *LEARNED.values(), *_SHARED)
        for name, choice in module.CHOICES.get(stage, {}).items()
    }
