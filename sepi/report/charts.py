"""The report's charts as figures for a paper (PNG and PDF): the ablation, time and memory of the stages, error bars."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.patches import Patch

from sepi.report import published
from sepi.report.comparison import mean_by_region
from sepi.report.drawing import new_figure, save, save_sentence
from sepi.report.properties import variants_with_bars
from sepi.report.runs import Runs, count_note, datasets_of, own_key
from sepi.report.table import shown
from sepi.scoring.scores import REGIONS, WHOLE_MAP

INTERVAL = 90
"""Percentage of the pixels whose truth an interval should hold."""

# Okabe and Ito's colours, which colour-blind people can distinguish
_COLOURS = ("#0072b2", "#e69f00", "#009e73")
_MARKERS = ("o", "s", "^")


def write_error_bars(folder: Path, name: str, runs: Runs) -> None:
    """Write the reliability diagram, and coverage and width by scene; without truth and error bars, a sentence."""
    variants, pairs = variants_with_bars(runs), runs.scored_pairs
    if not variants:
        save_sentence(folder, name, "no scene with ground truth and error bars")
        return
    figure = new_figure(11, max(3.6, 1.4 + 0.24 * len(pairs)))
    diagram, held, wide = figure.subplots(1, 3, width_ratios=(1.2, 1, 1))
    held.sharey(wide)
    diagram.plot([0, 1], [0, 1], color="0.6", linestyle="--", linewidth=1)
    held.axvline(INTERVAL, color="0.6", linestyle="--", linewidth=1)
    rows = np.arange(len(pairs))
    for number, (variant, colour, marker) in enumerate(zip(variants, _COLOURS, _MARKERS, strict=False)):
        right = runs.reliability(variant, pairs)
        enough = right.enough
        label = f"{variant}, largest gap {right.gap:.1f} %"
        diagram.plot(right.said[enough], right.found[enough], color=colour, marker=marker, markersize=5, label=label)
        shifted = rows + 0.22 * (number - (len(variants) - 1) / 2)
        for axis, score in ((held, "coverage"), (wide, "width")):
            values = [runs.of(score, dataset).at[scene, own_key(variant)] for dataset, scene in pairs]
            axis.plot(values, shifted, color=colour, marker=marker, markersize=5, linestyle="")
    diagram.set(xlim=(0, 1), ylim=(0, 1), aspect="equal")
    diagram.set_xlabel("confidence: said probability of an error of at most 0.07", fontsize=8)
    diagram.set_ylabel("found share of such errors", fontsize=8)
    diagram.legend(fontsize=7, loc="lower right")
    held.set_yticks(rows, list(map("/".join, pairs)), fontsize=7, parse_math=False)
    held.set_ylim(len(pairs) - 0.5, -0.5)
    wide.tick_params(labelleft=False)
    held.set_xlabel(f"truth within the interval of {INTERVAL} % / %", fontsize=8)
    wide.set_xlabel("median width of the interval / px per view step", fontsize=8)
    wide.set_xscale("log")
    for axis in (diagram, held, wide):
        axis.tick_params(labelsize=7)
        axis.grid(color="0.9")
    save(figure, folder, name)


_OURS, _PUBLISHED = "#4a7fae", "#b9bfc5"
_STAGES = ("#3b5b92", "#2a8c8c", "#7ab648", "#d9b430", "#b25d2c", "#7d4f9e")


def ablation_bars(runs: Runs) -> dict[str, pd.DataFrame]:
    """Average MSE x100 of each listed variant beside the published one, by the name of a dataset and a region.

    Returns
    -------
    dict of str to DataFrame
        Rows variants; ``ours`` and ``published``, NaN if not available, and a ``note`` if ours is over fewer scenes
        than the others.
    """
    groups = {}
    variants = list(runs.plan.variants)
    for dataset, region in itertools.product(datasets_of(runs.plan), REGIONS):
        means, counts = (found.loc[region] for found in mean_by_region(runs, dataset, variants))
        theirs = published.table4()[region].reindex([(dataset, variant) for variant in variants]).to_numpy()
        most, available = int(counts.max()), len(runs.scored(dataset))
        over = f"{most} scenes" if most == available else f"{most} of {available} scenes"
        average = f", average of {over}" if most > 1 else f", {over}" if most and available > 1 else ""
        title = f"{dataset}, {'whole map' if region == WHOLE_MAP else region}{average if most else ', published only'}"
        notes = [count_note([int(count)], most) for count in counts]
        groups[title] = pd.DataFrame({"ours": means, "published": theirs, "note": notes}, variants)
    return {title: bars for title, bars in groups.items() if bars[["ours", "published"]].notna().any(axis=None)}


def part_bars(parts: Runs) -> dict[str, pd.DataFrame]:
    """MSE x100 of the variants in the ablation of ``best``, by scene, as :func:`ablation_bars`."""
    variants, groups = list(parts.plan.variants), {}
    for dataset, scene in parts.scored_pairs:
        errors = parts.of("mse100", dataset).loc[scene, [*map(own_key, variants)]].to_numpy()
        bars = pd.DataFrame({"ours": errors, "published": np.nan, "note": ""}, variants)
        groups[f"{dataset}/{scene}, whole map"] = bars
    return groups


def stage_times(runs: Runs) -> pd.DataFrame:
    """Seconds and peak memory, MB, of the compared variants' stages, 0 of those that are switched off.

    Returns
    -------
    DataFrame
        Rows ``(scene, variant)``, columns ``(score, stage)``.
    """
    rows = [(*pair, variant) for pair in runs.plan.pairs for variant in runs.plan.compared]
    columns = pd.MultiIndex.from_product([runs.times.columns, runs.plan.stages])
    found = runs.times.unstack("stage").reindex(index=rows, columns=columns).fillna(0.0)
    scenes, variants = ["/".join(pair) for *pair, _ in rows], [variant for *_, variant in rows]
    return found.set_axis(pd.MultiIndex.from_arrays([scenes, variants]))


def write_bars(folder: Path, name: str, groups: Mapping[str, pd.DataFrame]) -> None:
    """Write bars for each group of :func:`ablation_bars`; without groups, a sentence."""
    if not groups:
        save_sentence(folder, name, "no scene with ground truth")
        return
    columns = min(3, len(groups))
    lines = -(-len(groups) // columns)
    height = 0.9 + 0.32 * max(map(len, groups.values()))
    figure = new_figure(4.2 * columns, height * lines)
    axes = figure.subplots(lines, columns, squeeze=False).ravel()
    for axis in axes[len(groups) :]:
        axis.set_axis_off()
    for axis, (title, group) in zip(axes, groups.items(), strict=False):
        names = [f"{variant} ({note})" if note else variant for variant, note in group["note"].items()]
        figures = group[["ours", "published"]].set_axis(names)
        figures.plot.barh(ax=axis, color=[_OURS, _PUBLISHED], width=0.78, legend=False, ylabel="")
        for bars, texts in zip(axis.containers, shown(figures).T.to_numpy(), strict=True):
            axis.bar_label(bars, texts, fontsize=6)
        axis.invert_yaxis()
        axis.margins(x=0.15)
        axis.set_title(title, fontsize=8, parse_math=False)
        axis.tick_params(labelsize=7)
        axis.set_xlabel("MSE x100", fontsize=7)
    labels = {"this code, scenes available": _OURS, "the paper, all its scenes": _PUBLISHED}
    handles = [Patch(color=colour, label=label) for label, colour in labels.items()]
    figure.legend(handles=handles, fontsize=7, loc="outside upper center", ncols=2)
    save(figure, folder, name)


def write_times(folder: Path, name: str, rows: pd.DataFrame) -> None:
    """Write stacked seconds of the stages beside their peak memory, a bar per scene and variant."""
    figure = new_figure(9, 1.2 + 0.3 * len(rows))
    time, memory = figure.subplots(1, 2, sharey=True)
    named = rows.set_axis(list(map(", ".join, rows.index)))
    named["seconds"].plot.barh(ax=time, stacked=True, color=_STAGES, width=0.7, fontsize=7, ylabel="")
    named["peak_memory_mb"].plot.barh(ax=memory, color=_STAGES, width=0.7, fontsize=7, legend=False, ylabel="")
    time.invert_yaxis()
    time.set_xlabel("seconds", fontsize=8)
    memory.set_xlabel("peak memory / MB", fontsize=8)
    time.legend(fontsize=7)
    save(figure, folder, name)


CHARTS: dict[str, Callable[[Path, str, Runs], None]] = {
    "ablation": lambda folder, name, runs: write_bars(folder, name, ablation_bars(runs)),
    "time_and_memory": lambda folder, name, runs: write_times(folder, name, stage_times(runs)),
    "error_bars": write_error_bars,
    "ablation_best": lambda folder, name, runs: write_bars(folder, name, part_bars(runs)),
}
"""Name of each chart to the function that writes it."""
