"""A benchmark's result as tables to read, and two results side by side."""

from __future__ import annotations

from collections.abc import Mapping

from bench.measure import Measurement
from bench.result import Result
from bench.stages import WINDOW_OPERATIONS
from sepi.report.tabular.layout import Cell, Section, Table

Measurements = Mapping[str, Measurement]

AXES = {"size": 2, "views": 2, "num_disparities": 1, "threads": -1}
"""What grows, and the power of it that time grows with if it is linear in pixels, views, candidates and work."""


def sections(result: Result) -> list[Section]:
    """Every table for which there are measurements."""
    found = []
    for heading, table in (
        ("Whole", whole(result.group("whole") | result.group("large"))),
        ("Steps", steps(result)),
        *((f"Growth with {axis}, built-in scene", growth(result, axis)) for axis in AXES),
        ("Initial stage beside plain ones", beside(result)),
        ("Solvers of the global optimisation", solvers(result.group("solvers"))),
        ("HDF5 compression", storage(result)),
    ):
        if table.rows:
            found.append(Section(heading, table))
    return found


def whole(measurements: Measurements) -> Table:
    """Commands, and the large light field."""
    rows = [(name, _figure(m.median), _whole(m.peak_memory_mb)) for name, m in measurements.items()]
    return Table(("what", "median s", "peak memory MB"), rows)


def steps(result: Result) -> Table:
    """The steps from files to maps: time, share, memory, throughput, how near the arithmetic floor, scores."""
    measurements = result.group("stages")
    total = sum(m.median for m in measurements.values())
    rows: list[list[Cell]] = []
    for name, m in measurements.items():
        floor = floor_seconds(result, m)
        scores = [m.figures.get(key) for key in ("mse100", "q25", "badpix007")]
        rows.append(
            [
                name,
                _figure(m.median),
                f"{100 * m.median / total:.0f} %",
                _whole(m.peak_memory_mb),
                None if "samples" not in m.figures else _figure(m.figures["samples"] / m.median / 1e9),
                None if floor is None else f"{100 * floor / m.median:.0f} %",
                None if scores[0] is None else " / ".join(f"{value:.2f}" for value in scores if value is not None),
            ]
        )
    if rows:
        rows.append(["sum", _figure(total), "100 %", max(_whole(m.peak_memory_mb) for m in measurements.values())])
        rows[-1] += [None, None, None]
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
    rows: list[list[Cell]] = []
    for name, m in initial.items():
        if not name.startswith(f"{axis} "):
            continue
        row: list[Cell] = [int(m.figures[axis])]
        for one, measurements in ((m, initial), (every[name], every)):
            if axis == "threads":
                row += [_figure(one.median), _figure(measurements["threads 1"].median / one.median)]
            else:
                row += [_figure(one.median), _figure(1e9 * one.median / _samples(one))]
        rows.append([*row, _whole(every[name].peak_memory_mb)])
    relative = "speed-up" if axis == "threads" else "ns per sample"
    return Table((axis, "initial s", relative, "all stages s", relative, "peak memory MB"), rows)


def beside(result: Result) -> Table:
    """Plain implementations of the initial stage: seconds of a candidate, and times those of this project."""
    rivals, own = result.group("beside"), result.group("stages").get("initial")
    if own is None or not rivals:
        return Table((), [])
    per_candidate = own.median / result.settings["num_disparities"]
    rows: list[list[Cell]] = [["sepi", _figure(per_candidate), "1", _whole(own.peak_memory_mb), None, None]]
    for name, m in rivals.items():
        seconds = m.median / m.figures["num_disparities"]
        differences = [f"{m.figures[key]:.0e}" for key in ("mean_difference", "largest_difference")]
        rows.append([name, _figure(seconds), _figure(seconds / per_candidate), _whole(m.peak_memory_mb), *differences])
    columns = ("", "s per candidate", "times sepi's", "peak memory MB", "mean difference of the cost", "largest")
    return Table(columns, rows)


def solvers(measurements: Measurements) -> Table:
    """Solvers: time, memory, residual, and how far from the exact solution."""
    figures = ("residual", "mean_difference", "largest_difference")
    rows: list[list[Cell]] = [
        [name, _figure(m.median), _whole(m.peak_memory_mb), *(f"{m.figures[key]:.0e}" for key in figures)]
        for name, m in measurements.items()
    ]
    columns = ("solver", "median s", "peak memory MB", "residual", "mean error, px per view step", "largest")
    return Table(columns, rows)


def storage(result: Result) -> Table:
    """Compressions: seconds to write and to read, and the file's size."""
    readings = result.group("storage, read")
    rows: list[list[Cell]] = [
        [name, *map(_figure, (m.figures["megabytes"], m.median, readings[name].median))]
        for name, m in result.group("storage, write").items()
    ]
    return Table(("what", "MB", "write s", "read s"), rows)


def comparison(before: Result, after: Result) -> Table:
    """What both results measured: seconds, their ratio, memory and its ratio, and the score of the whole map."""
    earlier = {(m.group, m.name): m for m in before.measurements}
    rows: list[list[Cell]] = []
    for m in after.measurements:
        was = earlier.get((m.group, m.name))
        if was is None:
            continue
        row: list[Cell] = [f"{m.group}: {m.name}", _figure(was.median), _figure(m.median), m.median / was.median]
        row += [_whole(was.peak_memory_mb), _whole(m.peak_memory_mb)]
        rows.append([*row, *(one.figures.get("mse100") for one in (was, m))])
    columns = ("what", "before s", "after s", "ratio", "before MB", "after MB", "before MSE x100", "after")
    return Table(columns, rows)


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


def _whole(megabytes: float) -> int:
    return round(megabytes)
