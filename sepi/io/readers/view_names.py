"""Row and column, or running number, of a view from the name of its file."""

from __future__ import annotations

import functools
import math
import re
from collections import defaultdict
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from os.path import commonprefix
from pathlib import Path
from typing import TypeVar

from sepi.errors import SepiError

Values = tuple[int, ...]
"""Value of one number in each name."""

Number = TypeVar("Number", int, float)

EXAMPLES = "'view_{row}_{column}.png' or 'img{number}.jpg'"

CAMERAS = ("cam", "camera")
"""Words for a camera in names of folders and images."""

# names of the two views of a stereo pair
_PAIRS = (("left", "right"), ("Left", "Right"), ("LEFT", "RIGHT"), ("l", "r"), ("L", "R"))
# most digits of a number
_MAX_DIGITS = 18
# numbers with their signs; decimals, such as a camera's position, count no views
_DECIMAL = r"(?P<decimal>[+-]*+(?<![0-9.])[0-9]++\.[0-9]++(?![0-9.]))"
_NUMBER = re.compile(rf"{_DECIMAL}|(?P<integer>[+-]*+[0-9]++)")
# stands for a decimal number; no name has it
_MARK = "\0"
# Least share of the positions between the first and the last that must be filled: of a running number (else it is a
# measure such as the time), and of a grid whose row and column are two of several numbers
_COUNTED = 2 / 3
_FILLED = 0.5
# share of the largest group of names at which another group may also be the views
_RIVAL = 0.5
# last word before a number, words for row and column, and words for other things
_WORD = re.compile(r"([A-Z]?[a-z]+|[A-Z]+)[ _.=(\[-]*$")
_AXES = {"x": "column", "c": "column", "col": "column", "column": "column", "y": "row", "r": "row", "row": "row"}
_NO_PLACE = frozenset(["frame", "frm", "time", "t", "exp", "exposure", "ev", "iso", "focus", "ch", "channel"])


@dataclass(frozen=True)
class ViewNumbers:
    """Interpretation of the names of a folder's views.

    Attributes
    ----------
    numbers : dict of str to tuple of int
        Name to ``(row, column)``, or to ``(number,)`` for a running number or a place in the order of the names.
    numbers_of : callable
        The same numbers of any name that matches those of the views; None for other names.
    unmatched : tuple of str
        Names that were left out.
    pattern : str
        Pattern that gives the same numbers; empty if the names only sort, or a pattern was given.
    said : bool
        Whether the names say which number is the row and which the column.
    counted : bool
        False: the names only sort.
    """

    numbers: dict[str, tuple[int, ...]]
    numbers_of: Callable[[str], tuple[int, ...] | None]
    unmatched: tuple[str, ...] = ()
    pattern: str = ""
    said: bool = False
    counted: bool = True

    @property
    def is_grid(self) -> bool:
        """Whether the names give row and column."""
        return all(len(values) == 2 for values in self.numbers.values())


def parse_view_numbers(source: str, names: Iterable[str], pattern: str) -> ViewNumbers:
    """Numbers of views at the places in a pattern.

    Parameters
    ----------
    source : str
        Path of the folder, for messages.
    names : iterable of str
    pattern : str
        Name of a view with ``{row}`` and ``{column}``, or ``{number}``; ``*`` matches any text.
    """
    names = sorted(names)
    form = _compiled(source, pattern)
    fields = [field for field in ("row", "column", "number") if field in form.groupindex]
    matches = {name: match for name in names if (match := form.fullmatch(name))}
    if not matches:
        found = f"; found: {', '.join(names[:3])}{', ...' if len(names) > 3 else ''}" if names else ""
        raise SepiError(f"{source}: no file has a name like '{pattern}'{found}")
    # a minus sign that all names have is a separator
    signs = [all(match[field].startswith("-") for match in matches.values()) for field in fields]

    def numbers_of(name: str) -> tuple[int, ...] | None:
        match = form.fullmatch(name)
        values = [] if match is None else [int(match[field]) for field in fields]
        return tuple(abs(n) if hyphen else n for n, hyphen in zip(values, signs, strict=False)) or None

    numbers = {name: values for name in matches if (values := numbers_of(name)) is not None}
    return ViewNumbers(numbers, numbers_of, tuple(name for name in names if name not in matches))


def infer_view_numbers(source: str, names: Iterable[str]) -> ViewNumbers:
    """Numbers that count the views, in names that differ only in numbers.

    Parameters
    ----------
    source : str
        Path of the folder, for messages.
    names : iterable of str

    Raises
    ------
    SepiError
        If the names do not tell which of them are views or which of their numbers count them.
    """
    names = sorted(names)
    group = _NameGroup(source, names)
    columns, counted = group.counting(source)
    columns, said = group.row_first(columns)
    others = tuple(sorted({*names}.difference(group.names)))
    numbers = {name: group.numbers_of(name, columns) or () for name in group.names}
    if not counted:
        return _ranked(sorted(numbers, key=numbers.__getitem__), others)
    numbers_of = functools.partial(group.numbers_of, columns=columns)
    return ViewNumbers(numbers, numbers_of, others, group.pattern(columns), said)


def sorted_view_numbers(names: Iterable[str]) -> ViewNumbers:
    """Ranks of all names in natural order, ``img9`` before ``img10``."""

    def key(name: str) -> tuple[list[int | str], str]:
        return [int(part) if at % 2 else part for at, part in enumerate(re.split(r"([0-9]+)", name))], name

    return _ranked(sorted(names, key=key))


def _ranked(names: Sequence[str], others: tuple[str, ...] = ()) -> ViewNumbers:
    # if names only sort, other names have no place among the views
    return ViewNumbers({name: (at,) for at, name in enumerate(names)}, lambda _: None, others, counted=False)


def pair_view_numbers(names: Iterable[str]) -> ViewNumbers | None:
    """A left and a right view, ``left.png`` and ``right.png``; None unless there is exactly one such pair."""
    names = sorted(names)
    swapped = [(n, re.sub(rf"(?<![A-Za-z]){left}(?![A-Za-z])", right, n)) for n in names for left, right in _PAIRS]
    pairs = [pair for pair in swapped if pair[0] != pair[1] in names]
    if len(pairs) != 1:
        return None
    others = tuple(name for name in names if name not in pairs[0])
    return ViewNumbers({name: (0, at) for at, name in enumerate(pairs[0])}, lambda _: None, others, said=True)


def require_different(folder: Path, named: ViewNumbers) -> None:
    """Raise if two views have the same numbers."""
    seen: dict[Values, str] = {}
    for name, numbers in named.numbers.items():
        if seen.setdefault(numbers, name) != name:
            where = ", ".join(map(str, numbers))
            raise SepiError(f"{folder / name}: view {where} is given twice, also as {seen[numbers]}")


def decimals_in(names: Sequence[str]) -> list[tuple[float, ...]]:
    """Decimal numbers in each name; empty if names differ in how many they have."""
    stems = (name.rpartition(".")[0] for name in names)
    found = [[re.split("(?=[0-9])", text, maxsplit=1) for text in re.findall(_DECIMAL, stem)] for stem in stems]
    if len(set(map(len, found))) != 1:
        return [()] * len(names)
    separators = _hyphens([sign for sign, _ in row] for row in found)
    every = (zip(row, separators, strict=True) for row in found)
    return [tuple(_signed(sign, text, hyphen, float) for (sign, text), hyphen in row) for row in every]


def origin(values: Sequence[int]) -> tuple[int, int]:
    """Least number, and the largest step of which all others are multiples from there; 1 for a single number."""
    lowest = min(values)
    return lowest, math.gcd(*(value - lowest for value in values)) or 1


class _NameGroup:
    """The largest group of names that differ only in their numbers."""

    def __init__(self, source: str, names: Sequence[str]) -> None:
        groups: dict[tuple[str, ...], list[str]] = defaultdict(list)
        for name in names:
            texts, numbers = _cut(name)
            if numbers or _MARK in texts[0]:
                groups[texts].append(name)
        ranked = sorted(groups.values(), key=len, reverse=True)
        if not ranked:
            raise SepiError(f"{source}: no image name has a number; expected names such as {EXAMPLES}")
        # a single stray image is not a second group; half as many as the largest group may be
        if len(ranked) > 1 and len(ranked[1]) >= min(len(ranked[0]), max(2, _RIVAL * len(ranked[0]))):
            raise SepiError(
                f"{source}: about as many images are named like {ranked[0][0]} as like {ranked[1][0]} "
                f"({len(ranked[0])} and {len(ranked[1])}); say which are the views with --pattern, such as {EXAMPLES}"
            )
        self.names = ranked[0]
        self._texts, self._first = _cut(self.names[0])
        self._hyphens = _hyphens([sign for sign, _ in _cut(name)[1]] for name in self.names)
        rows = (self.numbers_of(name, range(len(self._first))) or () for name in self.names)
        self._columns: list[Values] = list(zip(*rows, strict=True))
        self._words = [word[1].lower() if (word := _WORD.search(text)) else "" for text in self._texts[:-2]]

    def numbers_of(self, name: str, columns: Sequence[int]) -> tuple[int, ...] | None:
        """Numbers of a name at ``columns``; None if the name does not match the group."""
        texts, numbers = _cut(name)
        if texts != self._texts:
            return None
        return tuple(_signed(*numbers[at], self._hyphens[at], int) for at in columns)

    def counting(self, source: str) -> tuple[tuple[int, ...], bool]:
        """Indices of row and column, or of the running number; False: of numbers that only sort the names.

        Raises
        ------
        SepiError
            If it is unclear which these are, views have several images, or no number differs from name to name.
        """
        varying = self._varying(range(len(self._columns)))
        beside = self._no_places(varying)
        # numbers that count other things than places are ignored
        kept = [at for at in varying if at not in beside]
        # numbers that are different in each name: they count or date the images
        single = [at for at in kept if self._count([at]) == len(self.names)]
        words = " and ".join(f"'{self._words[at] or self._texts[at]}'" for at in beside)
        why = f"the numbers after {words} count no views; choose one value of each"
        if self._count(kept) == self._count(varying):
            why = "several numbers differ from name to name, and no two of them alone fill a grid"
            if not kept:
                raise SepiError(
                    f"{source}: no number in the names counts views; give --grid, or --pattern, such as {EXAMPLES}"
                )
            if len(kept) == 1:
                return tuple(kept), self._is_count(kept[0])
            places = [at for at in kept if at not in single]
            if len(places) == 2 and (not single or self._fills(*places)):
                return tuple(places), True
            running = [at for at in single if self._is_count(at)]
            if len(running) == 1:
                return tuple(running), True
            if single and not running:
                return tuple(kept), False
        columns = tuple(single[:1]) or self.row_first(tuple(kept[-2:]))[0]
        suggestion = self.pattern(columns, fixed=not single)
        raise SepiError(f"{source}: {why} ({self.names[0]}); try --pattern, such as '{suggestion}'")

    def _count(self, columns: Sequence[int]) -> int:
        """Number of different places that these numbers give."""
        return len(set(zip(*(self._columns[at] for at in columns), strict=True))) if columns else 1

    def _varying(self, columns: Iterable[int]) -> list[int]:
        """Indices of numbers that differ from name to name; of equivalent ones (other step or sign) only the first."""
        first: dict[Values, int] = {}
        for at in columns:
            if self._count([at]) > 1:
                lowest, step = origin(self._columns[at])
                counted = tuple((value - lowest) // step for value in self._columns[at])
                highest = max(counted)
                first.setdefault(min(counted, tuple(highest - value for value in counted)), at)
        return sorted(first.values())

    def _no_places(self, varying: Sequence[int]) -> list[int]:
        """Indices of numbers that count frames, exposures and the like, if other numbers differ too.

        In ``frame_03_07`` the word belongs to all numbers, since not each has its own. Axes of a light field may be
        called t and s. Numbers of images in a camera's folder do not count places.
        """
        words = {at: self._words[at] for at in varying}
        other = _NO_PLACE - {"t"} if "s" in words.values() else _NO_PLACE
        found = [
            at
            for at, word in words.items()
            if (word in other and (at > 0 or all(words.values())))
            or (at > 0 and "/" in self._texts[at] and self._words[0] in CAMERAS)
        ]
        return found if len(found) < len(words) else []

    def _span(self, at: int) -> int:
        """Number of places between the least and the greatest number."""
        lowest, step = origin(self._columns[at])
        return (max(self._columns[at]) - lowest) // step + 1

    def _fills(self, row: int, column: int) -> bool:
        """Whether two numbers give each view a place of its own, in a grid that they fill well."""
        return self._count([row, column]) == len(self.names) >= _FILLED * self._span(row) * self._span(column)

    def _is_count(self, at: int) -> bool:
        """Whether numbers, perhaps with gaps, count one by one."""
        return len(self.names) >= _COUNTED * self._span(at)

    def row_first(self, columns: tuple[int, ...]) -> tuple[tuple[int, ...], bool]:
        """Row and column in that order, and whether words in the names say so: ``x3_y7``, ``c3r7``."""
        said = [_AXES.get(self._words[at], "") for at in columns]
        return (columns[::-1] if said == ["column", "row"] else columns), sorted(said) == ["column", "row"]

    def pattern(self, columns: Sequence[int], fixed: bool = False) -> str:
        """Pattern with these numbers; others that differ are ``*``, or ``fixed`` as in the first name."""
        fields = dict(zip(columns, ("{row}", "{column}") if len(columns) == 2 else ("{number}",), strict=True))
        parts = [self._texts[0]]
        for at, number in enumerate(self._first):
            free = not fixed and self._count([at]) > 1
            parts.append(self._hyphens[at] + fields[at] if at in fields else "*" if free else "".join(number))
            parts.append(self._texts[at + 1])
        ending = self.names[0].rpartition(".")[2] if self._texts[-1] else ""
        return ("".join(parts) + ("." + ending if ending else "")).replace(_MARK, "*")


def _cut(name: str) -> tuple[tuple[str, ...], list[tuple[str, str]]]:
    """Texts between the whole numbers of a name, and the numbers, each with the signs before it."""
    stem, dot, suffix = name.rpartition(".")
    if not dot:
        stem, suffix = name, ""
    texts: list[str] = [""]
    numbers, at = [], 0
    for match in _NUMBER.finditer(stem):
        texts[-1] += stem[at : match.start()]
        at, digits = match.end(), match[0].lstrip("+-")
        if match.lastgroup == "decimal" or len(digits) > _MAX_DIGITS:
            # names that differ in decimals are alike
            texts[-1] += _MARK if match.lastgroup == "decimal" else match[0]
        else:
            numbers.append((match[0][: -len(digits)], digits))
            texts.append("")
    texts[-1] += stem[at:]
    return (*texts, suffix.lower()), numbers


def _hyphens(signs: Iterable[Sequence[str]]) -> list[str]:
    """Signs before each number that all names share: hyphens rather than minus signs, unless a sign is a plus."""
    columns = [list(column) for column in zip(*signs, strict=True)]
    signed = any("+" in sign for column in columns for sign in column)
    # these texts are not paths
    return [commonprefix([sign[:-1] for sign in column] if signed else column) for column in columns]  # noqa: RUF071


def _signed(signs: str, text: str, separator: str, convert: Callable[[str], Number]) -> Number:
    """Number, negative if a minus follows the separator."""
    return -convert(text) if "-" in signs[len(separator) :] else convert(text)


def _compiled(source: str, pattern: str) -> re.Pattern[str]:
    """Pattern as a regular expression whose time is at most quadratic in the length of a name."""
    parts = re.findall(r"\{[^{}]*\}|\*|[^{}*]+|[{}]", pattern)
    fields = sorted(part for part in parts if part[0] in "{}")
    touching = any(first[0] == "{" == second[0] for first, second in pairwise(parts))
    # file names have at most 255 characters
    no_name = len(pattern) > 255 or pattern.count("/") > 1 or pattern.startswith(("/", ".")) or "\\" in pattern
    if fields not in (["{column}", "{row}"], ["{number}"]) or touching or no_name:
        raise SepiError(
            f"{source}: pattern '{pattern[:255]}': expected the name of a file in the folder, or ROW/NAME, with "
            f"{{row}} and {{column}} once each and something between them, or {{number}} once; such as {EXAMPLES}"
        )
    segments = [""]
    for part in parts:
        if part == "*":
            segments.append("")
        elif part[0] == "{":
            segments[-1] += rf"(?<![0-9])(?P<{part[1:-1]}>[+-]?[0-9]{{1,{_MAX_DIGITS}}}+)(?![0-9])"
        else:
            segments[-1] += re.escape(part)
    first, *middle = segments
    last = ".*" + middle.pop() if middle else ""
    # text between two stars may match at its first occurrence, without backtracking
    return re.compile(first + "".join(f"(?>.*?{segment})" for segment in middle) + last, re.DOTALL)
