"""A page that compares two disparity maps: the report's viewer, and with ground truth their scores."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pandas as pd

from sepi.extensions.page.page import SCRIPTS, colour_scales, embedded_scenes, environment
from sepi.extensions.page.viewer import viewer_json
from sepi.io.scores import AllScores
from sepi.lightfield import FloatMap, LightField
from sepi.report.panels import Panel
from sepi.report.tabular.table import BEST, Head, Kind, Section, section
from sepi.scoring.error_bars import ERROR_BAR_SCORES, ErrorBars
from sepi.scoring.scores import COUNTS, EDGE_SCORES, SCORES, region_masks, score_regions
from sepi.stage import StageMaps

# share of the pixels beyond each end of the colour scale, so that a few wrong ones do not widen it
_BEYOND = 0.005

_SHOWN = ("mse100", "q25", "badpix007", "fattening", "thinning", "non_finite")
# scores without a best value: intervals should be neither wide nor narrow
_WITH_BARS = ("coverage", "width")


@dataclass(frozen=True)
class Comparison:
    """Two maps of one view, with its light field and ground truth if known.

    Attributes
    ----------
    names : (str, str)
    maps : (ndarray, ndarray), shape (H, W), float32
        Pixels per view step.
    ground_truth : ndarray, shape (H, W), float32, or None
    light_field : LightField or None
        For the reference view and the regions.
    bars : (StageMaps or None, StageMaps or None)
        The maps with error bars and confidence, if they have any.
    truth_step : float
        Rounding step of the ground truth, pixels per view step; 0: not rounded.
    """

    names: tuple[str, str]
    maps: tuple[FloatMap, FloatMap]
    ground_truth: FloatMap | None = None
    light_field: LightField | None = None
    bars: tuple[StageMaps | None, StageMaps | None] = (None, None)
    truth_step: float = 0.0

    @cached_property
    def scores(self) -> dict[str, AllScores]:
        """Scores of each map by its name; empty without ground truth."""
        if self.ground_truth is None:
            return {}
        masks = None if self.light_field is None else region_masks(self.light_field)
        reach = None if self.light_field is None else self.light_field.reach
        scores = [
            score_regions(
                values,
                self.ground_truth,
                masks,
                bars=None if bars is None else ErrorBars.of(bars, reach, self.truth_step),
            )
            for values, bars in zip(self.maps, self.bars, strict=True)
        ]
        return dict(zip(self.names, scores, strict=True))


def comparison_page(found: Comparison) -> str:
    """The page as HTML."""
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
    for key, name, values, bars in zip("ab", found.names, maps, found.bars, strict=True):
        confidence = None if bars is None else bars.confidence
        yield Panel(key, name, "Maps", "disparity", values, confidence=confidence, bars=bars, precise=True)
    yield Panel("difference", f"{a} minus {b}", "Maps", "error", maps[0], minus=maps[1])
    for key, name, bars in zip("ab", found.names, found.bars, strict=True):
        if bars is not None:
            yield Panel(f"{key}/sigma", f"{name}: standard deviation", "Error bars", "sigma", bars.sigma)
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
    """Ends of the scale of disparity: those of the ground truth, else of nearly all pixels of both maps."""
    shown = found.maps if found.ground_truth is None else (found.ground_truth,)
    known = np.concatenate([values[np.isfinite(values)] for values in shown])
    if known.size == 0:
        return 0.0, 1.0
    low, high = (float(end) for end in np.quantile(known, (_BEYOND, 1 - _BEYOND)))
    return (low, high) if low < high else (low - 0.5, high + 0.5)


def _score_section(found: Comparison) -> Section | None:
    """A table for the page: for each protocol and region, the scores of both maps, with the better one marked."""
    if not found.scores:
        return None
    titles = SCORES | EDGE_SCORES | ERROR_BAR_SCORES | COUNTS
    scores = (*_SHOWN, *(_WITH_BARS if any(bars is not None for bars in found.bars) else ()))
    heads = {"protocol": Head("protocol", Kind.TEXT), "region": Head("region", Kind.TEXT)}
    heads |= {
        f"{score} {name}": Head(f"{titles[score]}, {name}", Kind.OURS) for score in scores for name in found.names
    }
    rows, marks = [], []
    for protocol, regions in next(iter(found.scores.values())).items():
        for region in regions:
            row = {"protocol": protocol, "region": region}
            better: dict[str, str] = {}
            for score in scores:
                pair = {f"{score} {name}": of[protocol][region].get(score) for name, of in found.scores.items()}
                row |= {key: _text(value) for key, value in pair.items()}
                known = [value for value in pair.values() if value is not None and score not in _WITH_BARS]
                better |= {key: BEST for key, value in pair.items() if known and value in known and value < max(known)}
            rows.append(row)
            marks.append(better)
    return section("", heads, pd.DataFrame(rows), pd.DataFrame(marks))


def _text(value: float | None) -> str:
    if value is None:
        return "no interval"
    return "n/a" if np.isnan(value) else str(value) if isinstance(value, int) else f"{value:.3f}"
