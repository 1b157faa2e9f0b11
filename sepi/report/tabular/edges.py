"""Table of scores beside depth discontinuities and away from them, and of the shift of a map's edges."""

from __future__ import annotations

import math

from sepi.io.scores import Scores
from sepi.report.runs import Runs
from sepi.report.tabular.layout import Column, Kind, Record, Report, line, section
from sepi.report.tabular.methods import PROTOCOL_NOTE, has_column
from sepi.scoring.edges import LEAST_DISCONTINUITY, REACH
from sepi.scoring.scores import DISCONTINUITIES, EDGE_SCORES, SCORES, WHOLE_MAP

_BESIDE = ("mse100", "badpix007")

_COLUMNS = {
    "scene": Column("scene", Kind.TEXT),
    "variant": Column("variant", Kind.TEXT),
    "area": Column("area / %"),
    "squared_error": Column("squared error there / %"),
    **{f"{name}_{where}": Column(f"{SCORES[name]}, {where}") for name in _BESIDE for where in ("there", "away")},
    **{name: Column(head) for name, head in EDGE_SCORES.items()},
}


def edge_table(runs: Runs) -> Report:
    """Scores beside depth discontinuities and away from them, of the compared variants and external methods' maps."""
    records: list[Record] = []
    lines = []
    for dataset, scene in runs.scored_pairs():
        maps = {variant: (runs.scores(dataset, scene, variant), Kind.OURS) for variant in runs.plan.compared}
        for name in runs.plan.external:
            if has_column(runs, dataset, name) and (scores := runs.external_scores(dataset, scene, name)):
                maps[name] = (scores, Kind.EXTERNAL)
        for name, (scores, kind) in maps.items():
            found = edge_budget(scores["paper"][WHOLE_MAP], scores["paper"][DISCONTINUITIES])
            records.append({"dataset": dataset, "scene": scene, "variant": name, **found})
            lines.append(line(_COLUMNS, {**records[-1], "scene": f"{dataset}/{scene}"}, kind))
    return Report(
        "Depth discontinuities",
        f"{PROTOCOL_NOTE} There: up to {REACH} pixels beside a depth discontinuity of the ground truth, where "
        f"neighbours differ by more than {LEAST_DISCONTINUITY} pixels per view step; away: everywhere else. Area and "
        "squared error: the part of the pixels, and of the sum of squared errors, that lies there. Fattening: of the "
        "background's pixels there, those whose estimate is nearer than the middle between both surfaces; thinning: of "
        "the foreground's, those whose estimate is more distant.",
        ["dataset", *_COLUMNS],
        records,
        [section("", _COLUMNS, lines)],
    )


def edge_budget(whole: Scores, there: Scores) -> dict[str, float]:
    """Share of a map's errors beside depth discontinuities.

    Parameters
    ----------
    whole, there : mapping
        Scores of the whole map, and of the region beside depth discontinuities.

    Returns
    -------
    dict
        Keys of the table's columns to figures; NaN over no pixels.
    """
    finite = {name: scores["pixels"] - scores["non_finite"] for name, scores in (("whole", whole), ("there", there))}
    # a score over no pixels adds nothing
    squared_whole = finite["whole"] * whole["mse100"] if finite["whole"] else 0.0
    squared_there = finite["there"] * there["mse100"] if finite["there"] else 0.0
    bad_whole = whole["pixels"] * whole["badpix007"] if whole["pixels"] else 0.0
    bad_there = there["pixels"] * there["badpix007"] if there["pixels"] else 0.0
    return {
        "area": _ratio(100 * there["pixels"], whole["pixels"]),
        "squared_error": _ratio(100 * squared_there, squared_whole),
        "mse100_there": there["mse100"],
        "mse100_away": _ratio(squared_whole - squared_there, finite["whole"] - finite["there"]),
        "badpix007_there": there["badpix007"],
        "badpix007_away": _ratio(bad_whole - bad_there, whole["pixels"] - there["pixels"]),
        **{name: there[name] for name in EDGE_SCORES},
    }


def _ratio(part: float, of: float) -> float:
    # rounding may make a mean of squares negative
    return max(part, 0.0) / of if of else math.nan
