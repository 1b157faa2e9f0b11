"""Tables of a benchmark's result, and of two results side by side."""

from __future__ import annotations

from collections.abc import Mapping

from tabulate import tabulate

from bench import floor
from bench.measure import Measurement, Result
from sepi.variants import STAGES

Row = dict[str, str]
"""Heading to text; a cell without a figure is empty."""

AXES = {"size": 2, "views": 2, "num_disparities": 1, "threads": -1}
"""Growing axis to the power with which time grows if it is linear in pixels, views, candidates and work."""

UNITS = {"size": "pixels a side", "views": "views a side", "num_disparities": "candidates"}

SCORES = {"mse100": "MSE x100", "q25": "Q25 x100", "badpix007": "BadPix %"}


def page(result: Result) -> str:
    """The result as Markdown."""
    settings, machine = (
        ", ".join(f"{key} {value}" for key, value in one.items()) for one in (result.settings, result.machine)
    )
    parts = ["# Benchmark", f"Medians. {settings}.", f"Machine: {machine}."]
    for heading, rows in sections(result).items():
        parts += [f"## {heading}", markdown(rows)]
    return "\n\n".join(parts) + "\n"


def markdown(rows: list[Row]) -> str:
    """Rows as a table: names to the left, figures to the right."""
    alignment = ["left", *["right"] * (len(rows[0]) - 1)]
    return str(tabulate(rows, headers="keys", tablefmt="pipe", colalign=alignment, disable_numparse=True))


def longer_side_down(rows: list[Row]) -> list[Row]:
    """The same table, with the side of more names as its first column."""
    first, *others = rows[0]
    if len(rows) >= len(others):
        return rows
    return [{"": name} | {row[first]: row[name] for row in rows} for name in others]


def sections(result: Result) -> dict[str, list[Row]]:
    """Heading to table, for all measurements."""
    tables = {
        "Whole": [_row(m) for m in result.group("whole").values()],
        "Variants": variants(result),
        "One core busy, times as long": [_row(m, m.figures) for m in result.group("busy").values()],
        "Steps": steps(result),
        "Growth, built-in scene": growth(result),
        "Initial stage beside plain ones": [
            {"": name, "s per candidate": f"{seconds:.2g}"} for name, seconds in per_candidate(result).items()
        ],
        "HDF5 compression": [_row(m, m.figures) for m in result.group("storage").values()],
    }
    return {heading: rows for heading, rows in tables.items() if rows}


def steps(result: Result) -> list[Row]:
    """The steps from files to maps: time, share, memory, ratio to the arithmetic floor, scores."""
    steps, prices = result.group("stages"), result.group("floor")
    total = sum(m.median for m in steps.values())
    rows = []
    for m in steps.values():
        least = floor.seconds(prices, m.figures)
        more = {"share %": 100 * m.median / total, "times its floor": None if least is None else m.median / least}
        rows.append(_row(m, {**more, **_scores(m)}))
    return rows


def variants(result: Result) -> list[Row]:
    """A row for each part of the variants: seconds, and memory if it is more than one stage."""
    rows: dict[str, Row] = {}
    for name, m in (result.group("variants") | result.group("large")).items():
        variant, _, part = name.partition(": ")
        memory = "" if part in STAGES else f" / {_figure(m.peak_memory_mb)} MB"
        rows.setdefault(part, {"": part})[f"`{variant}`"] = f"{_figure(m.median)} s{memory}"
    return list(rows.values())


def growth(result: Result) -> list[Row]:
    """Nanoseconds per sample while pixels, views or candidates grow; constant if time is linear."""
    rows = []
    for axis, unit in UNITS.items():
        points = [name for name in result.group("growth, initial") if name.startswith(f"{axis} ")]
        row = {"": f"{', '.join(name.removeprefix(f'{axis} ') for name in points)} {unit}"}
        for what in ("initial", "all stages"):
            found = [result.group(f"growth, {what}")[name] for name in points]
            row[f"{what}, ns"] = ", ".join(f"{1e9 * m.median / _samples(m):#.2g}" for m in found)
        rows += [row] if points else []
    return rows


def _samples(m: Measurement) -> float:
    return (m.figures["size"] * m.figures["views"]) ** 2 * m.figures["num_disparities"]


def per_candidate(result: Result) -> dict[str, float]:
    """Seconds per candidate of the initial stage and the plain ones, by name."""
    return {name: m.median / m.figures["num_disparities"] for name, m in result.group("beside").items()}


def comparison(before: Result, after: Result) -> list[Row]:
    """Cases of both results: seconds, their ratio, memory, and scores."""
    earlier = {(m.group, m.name): m for m in before.measurements}
    pairs = [(earlier[m.group, m.name], m) for m in after.measurements if (m.group, m.name) in earlier]
    return [
        {
            "": f"{m.group}: {m.name}",
            "before s": _figure(was.median),
            "after s": _figure(m.median),
            "ratio": f"{m.median / was.median:.2f}",
            "before MB": _figure(was.peak_memory_mb),
            "after MB": _figure(m.peak_memory_mb),
            "before MSE x100": _figure(was.figures.get("mse100")),
            "after MSE x100": _figure(m.figures.get("mse100")),
        }
        for was, m in pairs
    ]


def differences(before: Result, after: Result) -> list[str]:
    """Settings and parts of the machine that differ, and may change ratios, too."""
    return [
        f"{key}: {old.get(key)} before, {new.get(key)} after"
        for old, new in ((before.machine, after.machine), (before.settings, after.settings))
        for key in dict.fromkeys([*old, *new])
        if old.get(key) != new.get(key)
    ]


def _scores(m: Measurement) -> dict[str, float | None]:
    return {heading: m.figures.get(key) for key, heading in SCORES.items()}


def _row(m: Measurement, more: Mapping[str, float | None] = {}) -> Row:
    figures = {"median s": m.median, "peak memory MB": m.peak_memory_mb, **more}
    return {"": m.name, **{heading: _figure(value) for heading, value in figures.items()}}


def _figure(value: float | None) -> str:
    """Three digits."""
    if value is None:
        return ""
    return f"{value:.0f}" if value >= 100 else f"{value:#.3g}"
