"""Confidence evaluation: errors by decile of confidence, and sparsification curves [1]_.

References
----------
.. [1] Ilg et al.: Uncertainty estimates and multi-hypotheses networks for optical flow. ECCV 2018.
   doi:10.1007/978-3-030-01234-2_40
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt

from sepi.lightfield import FloatMap
from sepi.report.runs import Runs
from sepi.report.tabular.layout import Column, Kind, Record, Report, line, section
from sepi.report.tabular.methods import PROTOCOL_NOTE

DECILES = 10

_STEPS = 100

FloatArray = npt.NDArray[np.float64]


def decile_errors(confidence: FloatMap, error: FloatMap) -> tuple[FloatArray, FloatArray]:
    """Errors of the tenths of the pixels, from the most confident to the least.

    Parameters
    ----------
    confidence, error : ndarray, shape (H, W), float32
        Pixels whose error is not finite are left out.

    Returns
    -------
    squared, absolute : ndarray, shape (10,), float64
        Mean squared and mean absolute error of each tenth, times 100; NaN where there is no pixel.
    """
    ordered = _by_confidence(confidence, error)
    tenths = np.array_split(ordered, DECILES)
    return (
        np.array([100 * np.mean(tenth**2) if tenth.size else np.nan for tenth in tenths]),
        np.array([100 * np.mean(np.abs(tenth)) if tenth.size else np.nan for tenth in tenths]),
    )


def sparsification(confidence: FloatMap, error: FloatMap) -> FloatArray:
    """Mean absolute error of the pixels that stay when the least confident are taken away [1]_.

    Parameters
    ----------
    confidence, error : ndarray, shape (H, W), float32
        0..1; estimate minus ground truth in pixels per view step, :attr:`sepi.io.scores.Evaluation.error`. Pixels
        whose error is not finite are left out.

    Returns
    -------
    ndarray, shape (100,), float64
        Times 100; with 0, 1, ... 99 % of the pixels taken away. NaN where no error is finite.

    References
    ----------
    .. [1] Ilg et al.: Uncertainty estimates and multi-hypotheses networks for optical flow. ECCV 2018.
       doi:10.1007/978-3-030-01234-2_40

    Examples
    --------
    A confidence is worth something if the curve falls:

    >>> import sepi
    >>> from sepi.evaluate import evaluation_of
    >>> from sepi.report.tabular.confidence import sparsification
    >>> from sepi.scenes import render
    >>> light_field = render("curved_occluders", size=96, views=5)
    >>> maps = sepi.estimate_depth(light_field)
    >>> curve = sparsification(maps.confidence, evaluation_of(light_field, maps.disparity).error)
    >>> curve.shape, bool(curve[50] < 0.2 * curve[0])
    ((100,), True)
    """
    sums = np.cumsum(np.abs(_by_confidence(confidence, error)))
    if sums.size == 0:
        return np.full(_STEPS, np.nan)
    kept = np.maximum(1, np.rint(sums.size * (1 - np.arange(_STEPS) / _STEPS))).astype(np.int64)
    return np.asarray(100 * sums[kept - 1] / kept)


def oracle(error: FloatMap) -> FloatArray:
    """The curve of :func:`sparsification` for a confidence that knows the errors: none can lie lower.

    Parameters
    ----------
    error : ndarray, shape (H, W), float32
        Estimate minus ground truth in pixels per view step.

    Returns
    -------
    ndarray, shape (100,), float64
        Times 100; with 0, 1, ... 99 % of the pixels taken away. NaN where no error is finite.

    Examples
    --------
    >>> import numpy as np
    >>> from sepi.report.tabular.confidence import oracle, sparsification
    >>> error = np.array([[0.0, 0.1], [0.2, 0.3]], np.float32)
    >>> [round(value, 3) for value in oracle(error)[[0, 25, 50, 75]].tolist()]
    [15.0, 10.0, 5.0, 0.0]
    >>> ignorant = sparsification(np.ones((2, 2), np.float32), error)  # in the order of the pixels
    >>> bool((oracle(error) <= ignorant).all())
    True
    """
    return sparsification(-np.abs(error), error)


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
    taken = np.arange(_STEPS)
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


def _by_confidence(confidence: FloatMap, error: FloatMap) -> FloatArray:
    known = np.isfinite(error)
    order = np.argsort(-confidence[known], kind="stable")
    return np.asarray(error[known][order], np.float64)
