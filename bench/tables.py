"""A benchmark's result as tables to read, and two results side by side."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from tabulate import tabulate

from bench.measure import Measurement
from bench.result import Result
from bench.stages import WINDOW_OPERATIONS

Measurements = Mapping[str, Measurement]

AXES = {"size": 2, "views": 2, "num_disparities": 1, "threads": -1}
"""What grows, and the power of it that time grows with if it is linear in pixels, views, candidates and work."""


@dataclass(frozen=True)
class Table:
    """Rows of text under a header; a cell without a figure is empty."""

    columns: Sequence[str]
    rows: Sequence[Sequence[str]]

    def markdown(self) -> str:
        """As Markdown: names to the left, figures to the right."""
        alignment = ["left", *["right"] * (len(self.columns) - 1)]
        return str(tabulate(self.rows, self.columns, tablefmt="pipe", colalign=alignment, disable_numparse=True))


def sections(result: Result) -> dict[str, Table]:
    """Every table for which there are measurements, by its heading."""
    tables = {
        "Whole": whole(result.group("whole") | result.group("large")),
        "Steps": steps(result),
        **{f"Growth with {axis}, built-in scene": growth(result, axis) for axis in AXES},
        "Initial stage beside plain ones": beside(result),
        "Solvers of the global optimisation": solvers(result.group("solvers")),
        "HDF5 compression": storage(result),
    }
    return {heading: table for heading, table in tables.items() if table.rows}


def whole(measurements: Measurements) -> Table:
    """Commands, and the large light field."""
    rows = [(name, _figure(m.median), _megabytes(m)) for name, m in measurements.items()]
    return Table(("what", "median s", "peak memory MB"), rows)


def steps(result: Result) -> Table:
    """The steps from files to maps: time, share, memory, throughput, how near the arithmetic floor, scores."""
    measurements = result.group("stages")
    total = sum(m.median for m in measurements.values())
    rows = []
    for name, m in measurements.items():
        floor = floor_seconds(result, m)
        scores = [m.figures[key] for key in ("mse100", "q25", "badpix007") if key in m.figures]
        rows.append(
            [
                name,
                _figure(m.median),
                f"{100 * m.median / total:.0f} %",
                _megabytes(m),
                _figure(m.figures["samples"] / m.median / 1e9) if "samples" in m.figures else "",
                "" if floor is None else f"{100 * floor / m.median:.0f} %",
                " / ".join(f"{value:.2f}" for value in scores),
            ]
        )
    if rows:
        largest = max(measurements.values(), key=lambda m: m.peak_memory_mb)
        rows.append(["sum", _figure(total), "100 %", _megabytes(largest), "", "", ""])
    columns = ("step", "median s", "share", "peak memory MB", "1e9 samples/s", "arithmetic floor", "MSE / Q25 / BadPix")
    return Table(columns, rows)


def floor_seconds(result: Result, measurement: Measurement) -> float | None:
    """Seconds that a sweep's operations alone would take on this machine; None for other steps and for grey views."""
    prices = {name: m.median / m.figures["operations"] for name, m in result.group("floor").items()}
    if not prices or measurement.figures.get("channels") != 3:
        return None
    return (
        measurement.figures["samples"] * prices["sample"]
        + measurement.figures[WINDOW_OPERATIONS] * prices["multiply-add of the window"]
    )


def growth(result: Result, axis: str) -> Table:
    """One axis growing: seconds, and seconds per sample (threads: speed-up over one), which stay level if linear."""
    initial, every = result.group("growth, initial"), result.group("growth, all stages")
    is_threads = axis == "threads"
    rows = []
    for name in initial:
        if name.startswith(f"{axis} "):
            row = [f"{initial[name].figures[axis]:.0f}"]
            for group in (initial, every):
                median = group[name].median
                relation = group["threads 1"].median / median if is_threads else 1e9 * median / _samples(group[name])
                row += [_figure(median), _figure(relation)]
            rows.append([*row, _megabytes(every[name])])
    relative = "speed-up" if is_threads else "ns per sample"
    return Table((axis, "initial s", relative, "all stages s", relative, "peak memory MB"), rows)


def beside(result: Result) -> Table:
    """Plain implementations of the initial stage: seconds of a candidate, and times those of this project."""
    columns = ("", "s per candidate", "times sepi's", "peak memory MB", "mean difference of the cost", "largest")
    rivals, own = result.group("beside"), result.group("stages").get("initial")
    if own is None or not rivals:
        return Table(columns, [])
    per_candidate = own.median / result.settings["num_disparities"]
    rows = [["sepi", _figure(per_candidate), "1", _megabytes(own), "", ""]]
    for name, m in rivals.items():
        seconds = m.median / m.figures["num_disparities"]
        differences = [f"{m.figures[key]:.0e}" for key in ("mean_difference", "largest_difference")]
        rows.append([name, _figure(seconds), _figure(seconds / per_candidate), _megabytes(m), *differences])
    return Table(columns, rows)


def solvers(measurements: Measurements) -> Table:
    """Solvers: time, memory, residual, and how far from the exact solution."""
    figures = ("residual", "mean_difference", "largest_difference")
    rows = [
        [name, _figure(m.median), _megabytes(m), *(f"{m.figures[key]:.0e}" for key in figures)]
        for name, m in measurements.items()
    ]
    columns = ("solver", "median s", "peak memory MB", "residual", "mean error, px per view step", "largest")
    return Table(columns, rows)


def storage(result: Result) -> Table:
    """Compressions: seconds to write and to read, and the file's size."""
    readings = result.group("storage, read")
    rows = [
        [name, *map(_figure, (m.figures["megabytes"], m.median, readings[name].median))]
        for name, m in result.group("storage, write").items()
    ]
    return Table(("what", "MB", "write s", "read s"), rows)


def comparison(before: Result, after: Result) -> Table:
    """What both measured: seconds, their ratio, memory, and scores."""
    earlier = {(m.group, m.name): m for m in before.measurements}
    pairs = [(earlier[m.group, m.name], m) for m in after.measurements if (m.group, m.name) in earlier]
    rows = [
        [
            f"{m.group}: {m.name}",
            *map(_figure, (was.median, m.median)),
            f"{m.median / was.median:.2f}",
            *map(_megabytes, (was, m)),
            *(f"{one.figures['mse100']:.2f}" if "mse100" in one.figures else "" for one in (was, m)),
        ]
        for was, m in pairs
    ]
    return Table(("what", "before s", "after s", "ratio", "before MB", "after MB", "before MSE x100", "after"), rows)


def differences(before: Result, after: Result) -> list[str]:
    """Settings and parts of the machine that differ, so that ratios may mean something else than the code."""
    return [
        f"{key}: {old.get(key)} before, {new.get(key)} after"
        for old, new in ((before.machine, after.machine), (before.settings, after.settings))
        for key in dict.fromkeys([*old, *new])
        if old.get(key) != new.get(key)
    ]


def _samples(measurement: Measurement) -> float:
    at = measurement.figures
    return at["size"] ** 2 * at["views"] ** 2 * at["num_disparities"]


def _figure(value: float) -> str:
    """Three digits."""
    return f"{value:.0f}" if value >= 100 else f"{value:#.3g}"


def _megabytes(measurement: Measurement) -> str:
    return f"{measurement.peak_memory_mb:.0f}"
