"""The sparsification curve of a map as a figure; :mod:`sepi.scoring.error_bars` computes it."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from sepi.lightfield import FloatMap
from sepi.report.plots.saving import new_figure, save
from sepi.scoring.error_bars import STEPS, oracle, sparsification


def write_curves(folder: Path, confidence: FloatMap, error: FloatMap) -> None:
    """Write the sparsification curve of a map beside the oracle's, as ``sparsification.png`` and ``.pdf``."""
    # fixed margins, since a layout engine takes longer than the rest
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
