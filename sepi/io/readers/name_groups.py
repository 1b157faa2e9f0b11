"""Groups of image names that differ only in their numbers, and which of these numbers count the views."""

from __future__ import annotations

import math
import re
from collections import defaultdict
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from itertools import combinations
from os.path import commonprefix
from typing import TypeVar

from sepi.errors import SepiError

Values = tuple[int, ...]
"""Value of one number in each name."""

# Least share of the positions between the first and the last that must be filled: of a running number (else it is a
# measure such as the time), and of a grid whose row and column are two of several numbers
_COUNTED = 2 / 3
_FILLED = 0.5
# factor by which two numbers must fill their grid better than any other two
_CLEARLY = 1.5


class Kind(Enum):
    """Meaning of the numbers in the names of views."""

    GRID = "row and column"
    COUNT = "a running number"
    SORT = "an order, and no more"


@dataclass(frozen=True)
class Counting:
    """Numbers by which the names count the views.

    Attributes
    ----------
    kind : Kind
    columns : tuple of int
        Indices of the numbers: row and column, the running number, or those that sort the names.
    """

    kind: Kind
    columns: tuple[int, ...]


def counting(numbers: Sequence[Values]) -> Counting | None:
    """Numbers by which names count views.

    Parameters
    ----------
    numbers : sequence of tuple of int
        For each number in the names, its value in each name.

    Returns
    -------
    Counting or None
        None if ambiguous. No columns if no number differs from name to name.
    """
    columns = {at: numbers[at] for at in _independent(numbers)}
    varying = tuple(columns)
    if len(varying) < 2:
        return Counting(Kind.COUNT if all(map(is_count, columns.values())) else Kind.SORT, varying)
    # numbers that are different in each name: they count or date the images
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
    """Whether numbers, perhaps with gaps, count one by one."""
    lowest, step = origin(values)
    return len(values) >= _COUNTED * ((max(values) - lowest) // step + 1)


def origin(values: Sequence[int]) -> tuple[int, int]:
    """Least number, and the largest step of which all others are multiples from there; 1 for a single number."""
    lowest = min(values)
    return lowest, math.gcd(*(value - lowest for value in values)) or 1


def _independent(numbers: Sequence[Values]) -> list[int]:
    """Indices of numbers that differ from name to name; of equivalent ones (other step or sign) only the first."""
    first: dict[Values, int] = {}
    for at, values in enumerate(numbers):
        if len(set(values)) > 1:
            lowest, step = origin(values)
            counted = tuple((value - lowest) // step for value in values)
            highest = max(counted)
            first.setdefault(min(counted, tuple(highest - value for value in counted)), at)
    return sorted(first.values())


def _filling_pair(numbers: Sequence[Values], among: Sequence[int]) -> tuple[int, int] | None:
    """The two numbers that fill a grid clearly better than any other two."""
    fills = {pair: fill(numbers[pair[0]], numbers[pair[1]]) for pair in combinations(among, 2)}
    ranked = sorted(fills, key=lambda pair: fills[pair], reverse=True)
    if not ranked or fills[ranked[0]] < _FILLED:
        return None
    clear = len(ranked) == 1 or fills[ranked[0]] >= _CLEARLY * fills[ranked[1]]
    return ranked[0] if clear else None


def fill(rows: Values, columns: Values) -> float:
    """Share of its grid that two numbers fill; 0 if two names share a place."""
    places = set(zip(rows, columns, strict=True))
    if len(places) < len(rows):
        return 0.0
    step = math.gcd(origin(rows)[1], origin(columns)[1])
    height, width = ((max(values) - min(values)) // step + 1 for values in (rows, columns))
    return len(places) / (height * width)


EXAMPLES = "'view_{row}_{column}.png' or 'img{number}.jpg'"

CAMERAS = ("cam", "camera")
"""Words for a camera in names of folders and images."""

MAX_DIGITS = 18
"""Most digits of a number in a name."""

DECIMAL = r"(?P<decimal>[+-]*+(?<![0-9.])[0-9]++\.[0-9]++(?![0-9.]))"
"""Regular expression of a decimal number in a name, with its signs."""

Number = TypeVar("Number", int, float)

# most decimals of a decimal number that counts views
_FINE = 6
# share of the largest group of names at which another group may also be the views
_RIVAL = 0.5
# last word before a number, words for row and column, and words for other things
_WORD = re.compile(r"([A-Z]?[a-z]+|[A-Z]+)[ _.=(\[-]*$")
_AXES = {"x": "column", "c": "column", "col": "column", "column": "column", "y": "row", "r": "row", "row": "row"}
_NO_PLACE = frozenset(["frame", "frm", "time", "t", "exp", "exposure", "ev", "iso", "focus", "ch", "channel"])
# stands for a decimal number; no name has it
_MARK = "\0"


class NameGroup:
    """The largest group of names that differ only in their numbers.

    Parameters
    ----------
    source : str
        For messages.
    names : sequence of str
    form : pattern
        Regular expression of a number.
    decimals_count : bool
        Whether decimal numbers may count views.
    """

    def __init__(self, source: str, names: Sequence[str], form: re.Pattern[str], decimals_count: bool) -> None:
        self.form, self._decimals_count = form, decimals_count
        groups: dict[tuple[str, ...], list[str]] = defaultdict(list)
        for name in names:
            texts, numbers = self._cut(name)
            if numbers or _MARK in texts[0]:
                groups[texts].append(name)
        self.names = _largest(source, groups)
        self._texts, self._first = self._cut(self.names[0])
        self._hyphens = hyphens([sign for sign, _ in self._cut(name)[1]] for name in self.names)
        self._origins = [(0, 1)] * len(self._first)
        self.columns = self._values()
        if decimals_count:
            # decimals count in their own steps
            self._origins = [origin(values) for values in self.columns]
            self.columns = self._values()
        self._words = [word[1].lower() if (word := _WORD.search(text)) else "" for text in self._texts[:-2]]
        self._beside = self._no_places()
        # numbers that count other things than places are ignored
        self.places = [(0,) * len(values) if at in self._beside else values for at, values in enumerate(self.columns)]

    def _values(self) -> list[Values]:
        columns = range(len(self._origins))
        return list(zip(*(self.numbers_of(name, columns) or () for name in self.names), strict=True))

    def _no_places(self) -> list[int]:
        """Indices of numbers that count frames, exposures and the like, if other numbers differ too.

        In ``frame_03_07`` the word belongs to all numbers, since not each has its own. Axes of a light field may be
        called t and s. Numbers of images in a camera's folder do not count places.
        """
        words = {at: self._words[at] for at, values in enumerate(self.columns) if len(set(values)) > 1}
        other = _NO_PLACE - {"t"} if "s" in words.values() else _NO_PLACE
        found = [
            at
            for at, word in words.items()
            if (word in other and (at > 0 or all(words.values())))
            or (at > 0 and "/" in self._texts[at] and self._words[0] in CAMERAS)
        ]
        return found if len(found) < len(words) else []

    def counting(self) -> Counting | None:
        """Numbers that count the views; None if ambiguous, or if views have several images."""
        several = len(set(zip(*self.places, strict=True))) < len(set(zip(*self.columns, strict=True)))
        return None if several else counting(self.places)

    def why_open(self) -> str:
        """Why :meth:`counting` is None, for the message."""
        if not self._beside:
            return "several numbers differ from name to name, and no two of them alone fill a grid"
        words = " and ".join(f"'{self._words[at] or self._texts[at]}'" for at in self._beside)
        return f"the numbers after {words} count no views; choose one value of each"

    def numbers_of(self, name: str, columns: Sequence[int]) -> tuple[int, ...] | None:
        """Numbers of a name at ``columns``; None if the name does not match the group."""
        texts, numbers = self._cut(name)
        if texts != self._texts:
            return None
        values = {at: signed(*numbers[at], self._hyphens[at], _whole) for at in columns}
        return tuple((value - self._origins[at][0]) // self._origins[at][1] for at, value in values.items())

    def row_first(self, columns: tuple[int, ...]) -> tuple[tuple[int, ...], bool]:
        """Row and column in that order, and whether words in the names say so: ``x3_y7``, ``c3r7``."""
        said = [_AXES.get(self._words[at], "") for at in columns]
        return (columns[::-1] if said == ["column", "row"] else columns), sorted(said) == ["column", "row"]

    def pattern(self, columns: Sequence[int], fixed: bool = False) -> str:
        """Pattern with these numbers; others that differ are ``*``, or ``fixed`` as in the first name."""
        fields = dict(zip(columns, ("{row}", "{column}") if len(columns) == 2 else ("{number}",), strict=True))
        parts = [self._texts[0]]
        for at, number in enumerate(self._first):
            free = not fixed and len(set(self.columns[at])) > 1
            parts.append(self._hyphens[at] + fields[at] if at in fields else "*" if free else "".join(number))
            parts.append(self._texts[at + 1])
        ending = self.names[0].rpartition(".")[2] if self._texts[-1] else ""
        return ("".join(parts) + ("." + ending if ending else "")).replace(_MARK, "*")

    def suggestion(self) -> str:
        """Pattern in quotes: of the first number that is different in each name, else of the last two places."""
        varying = [at for at, values in enumerate(self.places) if len(set(values)) > 1]
        single = [at for at in varying if len(set(self.places[at])) == len(self.names)]
        columns = single[:1] or self.row_first(tuple(varying[-2:]))[0]
        return f"'{self.pattern(columns, fixed=not single)}'"

    def _cut(self, name: str) -> tuple[tuple[str, ...], list[tuple[str, str]]]:
        """Texts between the numbers of a name, and the numbers, each with the signs before it."""
        stem, dot, suffix = name.rpartition(".")
        if not dot:
            stem, suffix = name, ""
        texts: list[str] = [""]
        numbers, at = [], 0
        for match in self.form.finditer(stem):
            texts[-1] += stem[at : match.start()]
            at, digits = match.end(), match[0].lstrip("+-")
            if match.lastgroup == "decimal" and not self._decimals_count:
                # names that differ in decimals are alike
                texts[-1] += _MARK
            elif len(digits) > MAX_DIGITS:
                texts[-1] += match[0]
            else:
                numbers.append((match[0][: -len(digits)], digits))
                texts.append("")
        texts[-1] += stem[at:]
        return (*texts, suffix.lower()), numbers


def _largest(source: str, groups: Mapping[tuple[str, ...], list[str]]) -> list[str]:
    ranked = sorted(groups.values(), key=len, reverse=True)
    if not ranked:
        raise SepiError(f"{source}: no image name has a number; expected names such as {EXAMPLES}")
    # a single stray image is not a second group; half as many as the largest group may be
    if len(ranked) > 1 and len(ranked[1]) >= min(len(ranked[0]), max(2, _RIVAL * len(ranked[0]))):
        raise SepiError(
            f"{source}: about as many images are named like {ranked[0][0]} as like {ranked[1][0]} ({len(ranked[0])} "
            f"and {len(ranked[1])}); say which are the views with --pattern, such as {EXAMPLES}"
        )
    return ranked[0]


def hyphens(signs: Iterable[Sequence[str]]) -> list[str]:
    """Signs before each number that all names share: hyphens rather than minus signs, unless a sign is a plus."""
    columns = [list(column) for column in zip(*signs, strict=True)]
    signed = any("+" in sign for column in columns for sign in column)
    # these texts are not paths
    return [commonprefix([sign[:-1] for sign in column] if signed else column) for column in columns]  # noqa: RUF071


def signed(signs: str, text: str, separator: str, convert: Callable[[str], Number]) -> Number:
    """Number, negative if a minus follows the separator."""
    return -convert(text) if "-" in signs[len(separator) :] else convert(text)


def _whole(text: str) -> int:
    # decimals that count become whole millionths
    whole, _, part = text.partition(".")
    return int(whole) * 10**_FINE + int(part.ljust(_FINE, "0")[:_FINE]) if part else int(whole)
