"""Chart of the error bars: reliability of the confidence, coverage and width of the intervals."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from sepi.report.plots.saving import new_figure, save, save_sentence
from sepi.report.runs import Runs
from sepi.report.tabular.error_bars import variants_with_bars
from sepi.report.tabular.methods import own_key

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
    for number, variant in enumerate(variants):
        colour, marker = _COLOURS[number % len(_COLOURS)], _MARKERS[number % len(_MARKERS)]
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
