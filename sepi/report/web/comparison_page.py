"""A small page about two disparity maps: the report's viewer, and their scores where there is ground truth."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from sepi.evaluate import PROTOCOLS, REGIONS, WHOLE_MAP, region_masks, score
from sepi.io.scores import Scores
from sepi.lightfield import FloatMap, LightField
from sepi.report.page import SCRIPTS, colour_scales, embedded_scenes, environment
from sepi.report.panels import Panel
from sepi.report.web.viewer import viewer_json

# part of the pixels beyond each end of the colour scale, so that a few wrong ones do not use it up
_BEYOND = 0.005

_SHOWN = {"mse100": "MSE x100", "q25": "Q25 x100", "badpix007": "BadPix 0.07 %", "non_finite": "not finite"}

AllScores = dict[str, dict[str, Scores]]
"""Protocol to region to scores."""


@dataclass(frozen=True)
class Comparison:
    """Two maps of one view, and what is known about it.

    Attributes
    ----------
    names : (str, str)
    maps : (ndarray, ndarray), shape (H, W), float32
        Pixels per view step.
    ground_truth : ndarray, shape (H, W), float32, or None
    light_field : LightField or None
        Gives the reference view and the regions.
    """

    names: tuple[str, str]
    maps: tuple[FloatMap, FloatMap]
    ground_truth: FloatMap | None = None
    light_field: LightField | None = None

    @cached_property
    def scores(self) -> tuple[AllScores, ...]:
        """Scores of both maps; nothing without ground truth."""
        ground_truth, scene = self.ground_truth, self.light_field
        if ground_truth is None:
            return ()
        masks = region_masks(scene) if scene is not None and scene.ground_truth is not None else {}
        regions = REGIONS if masks else (WHOLE_MAP,)
        return tuple(
            {
                protocol: {region: score(values, ground_truth, border, masks.get(region)) for region in regions}
                for protocol, border in PROTOCOLS.items()
            }
            for values in self.maps
        )


def comparison_page(found: Comparison) -> str:
    """The page, HTML."""
    scene = {
        "dataset": found.names[0],
        "scene": found.names[1],
        "grid": [1, 1],
        "first": {"a": "a", "b": "b"},
        **viewer_json(list(_panels(found)), _limits(found), found.light_field),
        "probes": [],
    }
    return (
        environment()
        .get_template("compare.html.j2")
        .render(
            title=f"{found.names[0]} beside {found.names[1]}",
            names=found.names,
            section=_score_section(found),
            scenes=embedded_scenes([scene]),
            first=scene,
            scales=colour_scales(),
            scripts=[name for name in SCRIPTS if name != "pixel.js"],
        )
    )


def _panels(found: Comparison) -> Iterator[Panel]:
    (a, b), maps, ground_truth = found.names, found.maps, found.ground_truth
    if found.light_field is not None:
        yield Panel("reference_view", "reference view", "Scene", "picture")
    if ground_truth is not None:
        yield Panel("ground_truth", "ground truth", "Scene", "disparity", ground_truth, precise=True)
    for key, name, values in zip("ab", found.names, maps, strict=True):
        yield Panel(key, name, "Maps", "disparity", values, precise=True)
    yield Panel("difference", f"{a} minus {b}", "Maps", "error", maps[0], minus=maps[1])
    if ground_truth is not None:
        for key, name, values in zip("ab", found.names, maps, strict=True):
            yield Panel(f"{key}/error", f"{name}: error", "Errors", "error", values, minus=ground_truth)
        title = f"{a} beside {b}: which is more accurate"
        yield Panel(
            "change",
            title,
            "Errors",
            "change",
            maps[1],
            minus=maps[0],
            ground_truth=ground_truth,
            ends=("less accurate", "more accurate"),
        )


def _limits(found: Comparison) -> tuple[float, float]:
    """Ends of the scale of disparity: those of the ground truth, else what nearly all pixels of both maps span."""
    shown = found.maps if found.ground_truth is None else (found.ground_truth,)
    known = np.concatenate([values[np.isfinite(values)] for values in shown])
    if known.size == 0:
        return 0.0, 1.0
    low, high = (float(end) for end in np.quantile(known, (_BEYOND, 1 - _BEYOND)))
    return (low, high) if low < high else (low - 0.5, high + 0.5)


def _score_section(found: Comparison) -> dict[str, Any] | None:
    """A table for the page: a row per protocol and region, each score of both maps, the better one marked."""
    if not found.scores:
        return None
    columns = [{"head": head, "kind": "text"} for head in ("protocol", "region")]
    columns += [{"head": f"{head}, {name}", "kind": "ours"} for head in _SHOWN.values() for name in found.names]
    rows = []
    for protocol, regions in found.scores[0].items():
        for region in regions:
            cells = [{"text": text, "value": None, "kind": "text", "mark": None} for text in (protocol, region)]
            for name in _SHOWN:
                pair = [scores[protocol][region][name] for scores in found.scores]
                cells += [_cell(value, pair) for value in pair]
            rows.append({"kind": "", "at_hand": True, "cells": cells})
    return {"heading": "", "columns": columns, "rows": rows}


def _cell(value: float, pair: list[float]) -> dict[str, Any]:
    known = not np.isnan(value)
    text = "n/a" if not known else str(value) if isinstance(value, int) else f"{value:.3f}"
    better = known and value == min(pair) and pair[0] != pair[1]
    return {"text": text, "value": value if known else None, "kind": "ours", "mark": "best" if better else None}


def printed_scores(found: Comparison) -> Mapping[str, AllScores]:
    """Name of each map to its scores; empty without ground truth."""
    return dict(zip(found.names, found.scores, strict=False))
