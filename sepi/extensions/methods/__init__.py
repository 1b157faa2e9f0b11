"""The methods that this one is compared with, each a module: its data cost, its regularisation, and its variant.

A method's module defines ``CHOICES``: for each stage, the choices that it adds.
"""

from typing import Any

from sepi.registry import Extension

_ALONE = {"occlusion": "none", "textureless": "none"}

METHODS: dict[str, dict[str, Any]] = {
    "oavc": {"initial": "oavc", **_ALONE, "optimize": {"choice": "guided_median", "radius": 7, "epsilon": 1e-5}},
    "cae": {"initial": "cae", **_ALONE, "optimize": {"choice": "markov_field", "smoothness": 0.005, "truncation": 0.2}},
    "pobr": {"initial": "pobr", "occlusion": "pobr", "textureless": "none", "optimize": "pobr"},
    "spo": {"initial": "spo", **_ALONE, "optimize": {"choice": "guided_costs", "radius": 9}},
    "mishiba": {"initial": "mishiba", **_ALONE, "optimize": "median_descent"},
    "acc": {"initial": "acc", **_ALONE, "optimize": "confident_labels"},
    "occ": {"initial": "occ", "occlusion": "occ", "textureless": "none", "optimize": "occ"},
}
"""Variant to its choices, in the format of :func:`sepi.variants.variant_from` and the order of the paper's tables."""

LEARNED: dict[str, dict[str, Any]] = {"onnx": {"initial": "onnx", **_ALONE, "optimize": "none"}}
"""Variants that need files which are not part of the package; reports include them only on request."""

_MODULES = {
    **{f"initial.{name}": name for name in METHODS},
    **{f"{stage}.{name}": name for stage in ("occlusion", "optimize") for name in ("pobr", "occ")},
    "initial.onnx": "onnx_network",
    "optimize.guided_median": "costs",
    "optimize.median_descent": "mishiba",
    "optimize.confident_labels": "acc",
    "optimize.guided_costs": "costs",
    "optimize.markov_field": "markov_field",
}

EXTENSION = Extension(
    choices={choice: f"{__name__}.{module}" for choice, module in _MODULES.items()},
    variants=METHODS | LEARNED,
    on_request=LEARNED,
)
