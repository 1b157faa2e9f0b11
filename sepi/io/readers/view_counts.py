"""Which of the numbers in the names of views count the views."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from itertools import combinations

Values = tuple[int, ...]
"""The value of one number in each name."""

# Least part of the positions between the first and the last that must be taken: of a running number (the others are
# missing views, not a measure such as the time), and of a grid whose row and column are two of several numbers
_COUNTED = 2 / 3
_FILLED = 0.5
# how many times better two numbers must fill their grid than any other two
_CLEARLY = 1.5


class Kind(Enum):
    """What numbers say about the views."""

    GRID = "row and column"
    COUNT = "a running number"
    SORT = "an order, and no more"


@dataclass(frozen=True)
class Counting:
    """How the names count the views.

    Attributes
    ----------
    kind : Kind
    columns : tuple of int
        Which of the numbers: row and column, or the running number; those by which names are sorted.
    """

    kind: Kind
    columns: tuple[int, ...]


def counting(numbers: Sequence[Values]) -> Counting | None:
    """How names count views by the numbers in them.

    Parameters
    ----------
    numbers : sequence of tuple of int
        For each number in the names its value in each name.

    Returns
    -------
    Counting or None
        None where the numbers leave it open. No columns where none differs from name to name.
    """
    columns = {at: numbers[at] for at in _independent(numbers)}
    varying = tuple(columns)
    if len(varying) < 2:
        return Counting(Kind.COUNT if all(map(is_count, columns.values())) else Kind.SORT, varying)
    # numbers of which each picture has another: they count or date the pictures
    single = [at for at in varying if len(set(columns[at])) == len(columns[at])]
    others = [at for at in varying if at not in single]
    pair = (others[0], others[1]) if len(varying) == len(others) == 2 else _filling_pair(numbers, others)
    if pair is not None:
        return Counting(Kind.GRID, pair)
    running = [at for at in single if is_count(columns[at])]
    if running:
        return Counting(Kind.COUNT, (running[0],)) if len(running) == 1 else None
    return Counting(Kind.SORT, varying) if single else None


def is_count(values: Sequence[int]) -> bool:
    """Whether numbers, if some of them are missing, count something one by one."""
    lowest, step = origin(values)
    return len(values) >= _COUNTED * ((max(values) - lowest) // step + 1)


def origin(values: Sequence[int]) -> tuple[int, int]:
    """Least of some numbers, and the largest step in which all others follow; 1 where there is none."""
    lowest = min(values)
    return lowest, math.gcd(*(value - lowest for value in values)) or 1


def _independent(numbers: Sequence[Values]) -> list[int]:
    """Which numbers differ from name to name; of those that count the same, in other steps or backwards, the first."""
    first: dict[Values, int] = {}
    for at, values in enumerate(numbers):
        if len(set(values)) > 1:
            lowest, step = origin(values)
            counted = tuple((value - lowest) // step for value in values)
            highest = max(counted)
            first.setdefault(min(counted, tuple(highest - value for value in counted)), at)
    return sorted(first.values())


def _filling_pair(numbers: Sequence[Values], among: Sequence[int]) -> tuple[int, int] | None:
    """The two of some numbers that fill a grid, and clearly better than any other two."""
    fills = {pair: fill(numbers[pair[0]], numbers[pair[1]]) for pair in combinations(among, 2)}
    ranked = sorted(fills, key=lambda pair: fills[pair], reverse=True)
    if not ranked or fills[ranked[0]] < _FILLED:
        return None
    clear = len(ranked) == 1 or fills[ranked[0]] >= _CLEARLY * fills[ranked[1]]
    return ranked[0] if clear else None


def fill(rows: Values, columns: Values) -> float:
    """How much of its grid two numbers fill; 0 where two names share a place."""
    places = set(zip(rows, columns, strict=True))
    if len(places) < len(rows):
        return 0.0
    step = math.gcd(origin(rows)[1], origin(columns)[1])
    height, width = ((max(values) - min(values)) // step + 1 for values in (rows, columns))
    return len(places) / (height * width)
