"""Row and column, or running number, of a view from the name of its file."""

from __future__ import annotations

import functools
import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise

from sepi.errors import SepiError
from sepi.io.readers.name_groups import DECIMAL, EXAMPLES, MAX_DIGITS, Counting, Kind, NameGroup, fill, hyphens, signed

# names of the two views of a stereo pair
_PAIRS = (("left", "right"), ("Left", "Right"), ("LEFT", "RIGHT"), ("l", "r"), ("L", "R"))
_INTEGER = r"(?P<integer>[+-]*+[0-9]++)"
# ways to find the numbers, and whether decimals may count: for camera positions beside counting numbers, for names such
# as 03.07.png, and for names of positions alone such as 0.5_1.0.png
_EITHER = re.compile(f"{DECIMAL}|{_INTEGER}")
_FORMS = ((_EITHER, False), (re.compile(_INTEGER), False), (_EITHER, True))


@dataclass(frozen=True)
class ViewNumbers:
    """Interpretation of the names of a folder's views.

    Attributes
    ----------
    numbers : dict of str to tuple of int
        Name to ``(row, column)``, or to ``(number,)`` for a running number or an order.
    numbers_of : callable
        The same numbers of any name that matches those of the views; None for other names.
    unmatched : tuple of str
        Names that were left out.
    kind : Kind
        Meaning of the numbers.
    pattern : str
        Pattern that gives the same numbers; empty if the names only sort, or a pattern was given.
    said : bool
        Whether the names say which number is the row and which the column.
    in_decimals : bool
        Whether the numbers may be parts of what looks like decimal numbers, which then are no camera positions.
    """

    numbers: dict[str, tuple[int, ...]]
    numbers_of: Callable[[str], tuple[int, ...] | None]
    unmatched: tuple[str, ...] = ()
    kind: Kind = Kind.COUNT
    pattern: str = ""
    said: bool = False
    in_decimals: bool = False


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
    others = tuple(name for name in names if name not in matches)
    kind = Kind.GRID if len(fields) == 2 else Kind.COUNT
    in_decimals = re.search(r"[0-9}*]\.\{|\}\.[0-9{*]", pattern) is not None
    return ViewNumbers(numbers, numbers_of, others, kind, in_decimals=in_decimals)


def infer_view_numbers(source: str, names: Iterable[str]) -> ViewNumbers:
    """Numbers that count the views, in names that differ only in numbers.

    Decimal numbers, such as a camera's position, do not count the views.

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
    group, counted = _best_reading(source, names)
    if counted is None:
        raise SepiError(f"{source}: {group.why_open()} ({group.names[0]}); try --pattern, such as {group.suggestion()}")
    if not counted.columns:
        raise SepiError(f"{source}: no number in the names counts the views; give --pattern, such as {EXAMPLES}")
    columns, said = group.row_first(counted.columns)
    numbers = {name: group.numbers_of(name, columns) or () for name in group.names}
    numbers_of: Callable[[str], tuple[int, ...] | None] = functools.partial(group.numbers_of, columns=columns)
    if counted.kind is Kind.SORT:
        ranks = {key: rank for rank, key in enumerate(sorted(set(numbers.values())))}
        numbers = {name: (ranks[key],) for name, key in numbers.items()}
        # if names only sort, other names have no place among the views
        numbers_of = _no_numbers
    pattern = "" if counted.kind is Kind.SORT else group.pattern(columns)
    others = tuple(sorted({*names}.difference(group.names)))
    return ViewNumbers(numbers, numbers_of, others, counted.kind, pattern, said, group.form is not _EITHER)


def decimals_in(names: Sequence[str]) -> list[tuple[float, ...]]:
    """Decimal numbers in each name; empty if names differ in how many they have."""
    stems = (name.rpartition(".")[0] for name in names)
    found = [[re.split("(?=[0-9])", text, maxsplit=1) for text in re.findall(DECIMAL, stem)] for stem in stems]
    if len(set(map(len, found))) != 1:
        return [()] * len(names)
    separators = hyphens([sign for sign, _ in row] for row in found)
    return [
        tuple(signed(sign, text, hyphen, float) for (sign, text), hyphen in zip(row, separators, strict=True))
        for row in found
    ]


def sorted_view_numbers(names: Iterable[str]) -> ViewNumbers:
    """Ranks of all names in natural order, ``img9`` before ``img10``."""

    def key(name: str) -> tuple[list[int | str], str]:
        return [int(part) if at % 2 else part for at, part in enumerate(re.split(r"([0-9]+)", name))], name

    return ViewNumbers({name: (rank,) for rank, name in enumerate(sorted(names, key=key))}, _no_numbers, kind=Kind.SORT)


def pair_view_numbers(names: Iterable[str]) -> ViewNumbers | None:
    """A left and a right view, ``left.png`` and ``right.png``; None unless there is exactly one such pair."""
    names = sorted(names)
    swapped = [
        (name, re.sub(rf"(?<![A-Za-z]){left}(?![A-Za-z])", right, name)) for name in names for left, right in _PAIRS
    ]
    pairs = [pair for pair in swapped if pair[0] != pair[1] in names]
    if len(pairs) != 1:
        return None
    others = tuple(name for name in names if name not in pairs[0])
    return ViewNumbers({name: (0, at) for at, name in enumerate(pairs[0])}, _no_numbers, others, Kind.GRID, said=True)


def _no_numbers(_: str) -> None:
    return None


def _best_reading(source: str, names: Sequence[str]) -> tuple[NameGroup, Counting | None]:
    """The first way to read the numbers that gives a grid; else the first that gives any count."""
    readings = []
    for form, decimals_count in _FORMS:
        group = NameGroup(source, names, form, decimals_count)
        readings.append((group, counted := group.counting()))
        if counted is not None and counted.kind is Kind.GRID:
            row, column = (group.columns[at] for at in counted.columns)
            if fill(row, column):
                return readings[-1]
    return next((reading for reading in readings if reading[1] is None or reading[1].columns), readings[0])


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
            segments[-1] += rf"(?<![0-9])(?P<{part[1:-1]}>[+-]?[0-9]{{1,{MAX_DIGITS}}}+)(?![0-9])"
        else:
            segments[-1] += re.escape(part)
    first, *middle = segments
    last = ".*" + middle.pop() if middle else ""
    # text between two stars may match at its first occurrence, without backtracking
    return re.compile(first + "".join(f"(?>.*?{segment})" for segment in middle) + last, re.DOTALL)
