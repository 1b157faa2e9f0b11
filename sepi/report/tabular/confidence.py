"""The table of the confidence evaluation, and its curves; :mod:`sepi.scoring.confidence` computes them."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from sepi.lightfield import FloatMap
from sepi.report.runs import Runs
from sepi.report.tabular.layout import Column, Kind, Record, Report, line, section
from sepi.report.tabular.methods import PROTOCOL_NOTE
from sepi.scoring.confidence import DECILES, STEPS, oracle, sparsification


def confidence_table(runs: Runs) -> Report:
    """Mean errors by decile of confidence and the area under the sparsification curve, beside the oracle's."""
    tenths = [f"decile {i}" for i in range(1, DECILES + 1)]
    heads = [*tenths, "area", "oracle", "random"]
    columns = {name: Column(name, Kind.TEXT) for name in ("scene", "variant")}
    columns |= {head: Column(head, Kind.OURS) for head in heads}
    records: list[Record] = []
    lines = []
    for dataset, scene in runs.scored_pairs():
        for variant in runs.plan.compared:
            found = runs.confidence(dataset, scene, variant)
            areas = [float(np.mean(found["curve"])), float(np.mean(found["oracle"])), found["curve"][0]]
            for error, name in (("mse100", "squared"), ("mae100", "absolute")):
                figures = dict(zip(heads, [*found[name], *areas], strict=True))
                records.append({"dataset": dataset, "scene": scene, "variant": variant, "error": error, **figures})
            lines.append(line(columns, {**records[-1], "scene": f"{dataset}/{scene}"}))
    return Report(
        "Confidence evaluation",
        f"{PROTOCOL_NOTE} Mean absolute error x100 of each tenth of the pixels, from the most confident (1) to the "
        "least (10); mean squared errors are in the CSV file. Area: mean of the sparsification curve, which is the "
        "mean absolute error x100 of the pixels left when the least confident are taken away, from none to 99 %; "
        "oracle: the same when the pixels with the largest errors go first, which nothing can beat; random: the error "
        "of all pixels, which is what a confidence that says nothing reaches. Curves: "
        "`maps/DATASET/SCENE/VARIANT/sparsification.png`.",
        ["dataset", "scene", "variant", "error", *heads],
        records,
        [section("", columns, lines)],
    )


def write_curves(folder: Path, confidence: FloatMap, error: FloatMap) -> None:
    """Plot the sparsification curve of a map beside the oracle's as ``sparsification.png`` and ``.pdf``."""
    # slow to import, and not needed for the tables
    from sepi.report.plots.saving import new_figure, save

    # margins by hand: a layout engine takes longer than the rest
    figure = new_figure(5, 3.5, layout=None)
    axis = figure.add_axes((0.14, 0.14, 0.83, 0.83))
    taken = np.arange(STEPS)
    for name, curve, style in (
        ("by confidence", sparsification(confidence, error), "-"),
        ("oracle", oracle(error), "--"),
    ):
        axis.plot(taken, curve, style, label=f"{name}, area {curve.mean():.3f}")
    axis.set_xlabel("pixels taken away / %")
    axis.set_ylabel("mean absolute error x100 / px")
    axis.set_ylim(bottom=0)
    axis.legend()
    save(figure, folder, "sparsification")
