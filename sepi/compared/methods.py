"""The compared methods: their variants, and the modules of their choices.

A method's module defines ``CHOICES``: for each stage, the choices that it adds. It is imported when one of them is
requested, so that a job loads only the method that it runs.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, MutableMapping
from importlib import import_module
from typing import Any

from sepi.stage import Choice

_COSTS_ALONE = {"occlusion": "none", "textureless": "none"}

METHODS: dict[str, dict[str, Any]] = {
    "oavc": {
        "initial": "oavc",
        **_COSTS_ALONE,
        "optimize": {"choice": "guided_median", "radius": 7, "epsilon": 1e-5},
    },
    "cae": {
        "initial": "cae",
        **_COSTS_ALONE,
        "optimize": {"choice": "markov_field", "smoothness": 0.005, "truncation": 0.2},
    },
    "pobr": {"initial": "pobr", "occlusion": "pobr", "textureless": "none", "optimize": "pobr"},
    "spo": {"initial": "spo", **_COSTS_ALONE, "optimize": {"choice": "guided_costs", "radius": 9}},
    "mishiba": {"initial": "mishiba", **_COSTS_ALONE, "optimize": "median_descent"},
    "acc": {"initial": "acc", **_COSTS_ALONE, "optimize": "confident_labels"},
    "occ": {"initial": "occ", "occlusion": "occ", "textureless": "none", "optimize": "occ"},
}
"""Variant to its choices, in the format of :func:`sepi.variants.variant_from` and the order of the paper's tables."""

LEARNED: dict[str, dict[str, Any]] = {"onnx": {"initial": "onnx", **_COSTS_ALONE, "optimize": "none"}}
"""Variants that need files which are not part of the package; reports include them only on request."""

MODULES: dict[str, dict[str, str]] = {
    "initial": {
        **{name: name for name in ("oavc", "cae", "pobr", "spo", "mishiba", "acc", "occ")},
        "onnx": "onnx_network",
    },
    "occlusion": {"pobr": "pobr", "occ": "occ"},
    "textureless": {},
    "optimize": {
        "guided_median": "oavc",
        "pobr": "pobr",
        "median_descent": "mishiba",
        "confident_labels": "acc",
        "occ": "occ",
        "guided_costs": "guided_costs",
        "markov_field": "markov_field",
    },
}
"""Stage to choice to its module in this folder."""


class StageChoices(MutableMapping[str, Choice]):
    """The choices of a stage by name: its own and the compared methods', whose modules are imported on access.

    Parameters
    ----------
    stage : str
        Name of the stage.
    own : mapping of str to Choice
        The stage's own choices; one that passes maps on unchanged is listed last.
    """

    def __init__(self, stage: str, own: Mapping[str, Choice]) -> None:
        self._stage = stage
        names = sorted([*own, *MODULES.get(stage, ())], key=lambda name: name == "none")
        self._found: dict[str, Choice | None] = {name: own.get(name) for name in names}

    def __getitem__(self, name: str) -> Choice:
        found = self._found[name]
        if found is None:
            module = import_module(f"{__package__}.{MODULES[self._stage][name]}")
            found = self._found[name] = module.CHOICES[self._stage][name]
        return found

    def __setitem__(self, name: str, choice: Choice) -> None:
        self._found[name] = choice

    def __delitem__(self, name: str) -> None:
        del self._found[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._found)

    def __len__(self) -> int:
        return len(self._found)
