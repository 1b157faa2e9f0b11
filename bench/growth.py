"""Cases of growth: time and memory over size, views, candidates and threads, and one light field that is large."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from bench import stages
from bench.measure import Case
from sepi.pipeline import Variant, stage_parameters

SIZE, VIEWS = 256, 9
"""Where the others stand while one of them grows."""

SIZE_FOR_THREADS = 512
"""Threads are for large pictures."""

LARGE = (1024, 17)
"""Size and views a side of the large light field."""

Growth = dict[str, list[int]]

FULL: Growth = {"size": [128, 256, 512, 1024], "views": [3, 5, 7, 9, 13, 17], "num_disparities": [46, 91, 181, 362]}
SMALL: Growth = {"size": [64, 128], "views": [3], "num_disparities": [11, 21]}


def sizes(growth: Growth, large: bool) -> dict[str, tuple[int, int]]:
    """Name of each light field that the cases need, to its size and views a side."""
    pairs = [LARGE] if large else []
    if growth["size"]:
        pairs += [(size, _views(growth)) for size in growth["size"]]
        pairs += [(_size(growth), views) for views in [*growth["views"], _views(growth)]]
    return {f"{size}x{views}": (size, views) for size, views in pairs}


def cases(folder: Path, growth: Growth, candidates: int, threads: int, variant: Variant, large: bool) -> list[Case]:
    """Initial stage and all stages, one axis growing at a time."""
    found = []
    with_threads = {**growth, "threads": _powers(threads)} if growth["size"] else {}
    for axis, values in with_threads.items():
        for value in values:
            at = {"size": _size(growth), "views": _views(growth), "num_disparities": candidates, "threads": threads}
            if axis == "threads":
                at["size"] = min(SIZE_FOR_THREADS, max(growth["size"]))
            at[axis] = value
            path = folder / f"{at['size']}x{at['views']}.h5"
            found += _both(f"{axis} {value}", path, at, variant)
    if large:
        size, views = LARGE
        at = {"size": size, "views": views, "num_disparities": candidates, "threads": threads}
        found.append(_all_stages("large", f"{views}x{views} views of {size}x{size}", folder, at, variant, once=True))
    return found


def _both(name: str, path: Path, at: dict[str, int], variant: Variant) -> list[Case]:
    settings = stage_parameters(variant, _candidates(at))["initial"]
    figures = {key: float(value) for key, value in at.items()}
    return [
        Case("growth, initial", name, stages.initial, (path, settings), figures, threads=at["threads"]),
        _all_stages("growth, all stages", name, path.parent, at, variant),
    ]


def _all_stages(group: str, name: str, folder: Path, at: dict[str, int], variant: Variant, once: bool = False) -> Case:
    path = folder / f"{at['size']}x{at['views']}.h5"
    figures = {key: float(value) for key, value in at.items()}
    return Case(group, name, stages.whole, (path, variant, _candidates(at)), figures, threads=at["threads"], once=once)


def _candidates(at: dict[str, int]) -> dict[str, dict[str, Any]]:
    """Parameters of the stages that sweep."""
    return {stage: {"num_disparities": at["num_disparities"]} for stage in ("initial", "occlusion")}


def _size(growth: Growth) -> int:
    return min(SIZE, max(growth["size"]))


def _views(growth: Growth) -> int:
    return min(VIEWS, max(growth["views"]))


def _powers(threads: int) -> list[int]:
    """1, 2, 4 and so on, and the number itself."""
    return sorted({2**n for n in range(threads.bit_length())} | {threads})
