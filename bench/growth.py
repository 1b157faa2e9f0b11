"""Cases of growth: time and memory over size, views, candidates and threads, and one light field that is large."""

from __future__ import annotations

from pathlib import Path

from bench import stages
from bench.measure import Case
from sepi.pipeline import Variant, stage_parameters

SIZE, VIEWS = 256, 9
"""Where the others stand while one of them grows."""

SIZE_FOR_THREADS = 512
"""Threads are for large pictures."""

LARGE = (1024, 17)
"""Size and views a side of the large light field."""

PROGRAMS = ("initial", "all stages")
"""What is measured at each point."""

Growth = dict[str, list[int]]

FULL: Growth = {"size": [128, 256, 512, 1024], "views": [3, 5, 7, 9, 13, 17], "num_disparities": [46, 91, 181, 362]}
SMALL: Growth = {"size": [64, 128], "views": [3], "num_disparities": [11, 21]}


def sizes(growth: Growth, large: bool) -> dict[str, tuple[int, int]]:
    """Name of each light field that the cases need, to its size and views a side."""
    pairs = [LARGE] if large else []
    if growth["size"]:
        size, views = _start(growth)
        pairs += [(one, views) for one in growth["size"]] + [(size, one) for one in [*growth["views"], views]]
    return {f"{size}x{views}": (size, views) for size, views in pairs}


def cases(
    folder: Path, growth: Growth, num_disparities: int, threads: int, variant: Variant, large: bool
) -> list[Case]:
    """Initial stage and all stages, one axis growing at a time."""
    found = []
    for axis, values in ({**growth, "threads": _powers(threads)} if growth["size"] else {}).items():
        for value in values:
            size, views = _start(growth)
            if axis == "threads":
                size = min(SIZE_FOR_THREADS, max(growth["size"]))
            at = {"size": size, "views": views, "num_disparities": num_disparities, "threads": threads, axis: value}
            found += [_case(f"growth, {what}", f"{axis} {value}", folder, at, variant) for what in PROGRAMS]
    if large:
        size, views = LARGE
        at = {"size": size, "views": views, "num_disparities": num_disparities, "threads": threads}
        found.append(_case("large", f"{views}x{views} views of {size}x{size}", folder, at, variant))
    return found


def _case(group: str, name: str, folder: Path, at: dict[str, int], variant: Variant) -> Case:
    path = folder / f"{at['size']}x{at['views']}.h5"
    # parameters of the stages that sweep
    values = {stage: {"num_disparities": at["num_disparities"]} for stage in ("initial", "occlusion")}
    figures = {key: float(value) for key, value in at.items()}
    if group == "growth, initial":
        settings = stage_parameters(variant, values)["initial"]
        return Case(group, name, stages.initial, (path, settings), figures, at["threads"])
    return Case(group, name, stages.whole, (path, variant, values), figures, at["threads"], once=group == "large")


def _start(growth: Growth) -> tuple[int, int]:
    """Size and views while something else grows."""
    return min(SIZE, max(growth["size"])), min(VIEWS, max(growth["views"]))


def _powers(threads: int) -> list[int]:
    """1, 2, 4 and so on, and the number itself."""
    return sorted({2**n for n in range(threads.bit_length())} | {threads})
