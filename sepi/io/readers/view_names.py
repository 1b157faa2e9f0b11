"""Row and column, or running number, of a view from the name of its file."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise

from sepi.errors import SepiError

EXAMPLES = "'view_{row}_{column}.png' or 'img{number}.jpg'"

_FIELDS = ("row", "column", "number")
_MAX_DIGITS = 18
_SMALL = 100

# a minus sign is one only after what separates words; after a letter or a digit it is a hyphen
_SIGN = r"(?:(?<![^_ ,(\[=])-)?"
_DECIMAL = rf"(?P<decimal>(?<![0-9.]){_SIGN}[0-9]++\.[0-9]++(?![0-9.]))|"
_INTEGER = rf"(?P<integer>{_SIGN}[0-9]++)"


@dataclass(frozen=True)
class ViewNumbers:
    """What the names of a folder's views say.

    Attributes
    ----------
    numbers : dict of str to tuple of int
        Name to ``(row, column)``, or to ``(number,)`` where views are numbered through.
    unmatched : tuple of str
        Names that were left out.
    line : {"row", "column"} or None
        For views numbered through: whether the one number that all names share stands where the number of the row or
        of the column would, so that the views may be a single one.
    line_likely : bool
        Whether that number is written in the same way as the views' numbers.
    """

    numbers: dict[str, tuple[int, ...]]
    unmatched: tuple[str, ...] = ()
    line: str | None = None
    line_likely: bool = False


@dataclass(frozen=True)
class _Name:
    """A name cut into the text between its numbers and the numbers' texts."""

    name: str
    texts: tuple[str, ...]
    numbers: tuple[str, ...]


def parse_view_numbers(source: str, names: Iterable[str], pattern: str) -> ViewNumbers:
    """Numbers where a pattern has them.

    Parameters
    ----------
    source : str
        Path of the folder, for messages.
    names : iterable of str
    pattern : str
        Name of a view with ``{row}`` and ``{column}``, or ``{number}``; ``*`` stands for anything.
    """
    names = sorted(names)
    form = _compiled(source, pattern)
    fields = [field for field in _FIELDS if field in form.groupindex]
    matches = {name: match for name in names if (match := form.fullmatch(name))}
    if not matches:
        found = f"; found: {', '.join(names[:3])}{', ...' if len(names) > 3 else ''}" if names else ""
        raise SepiError(f"{source}: no file has a name like '{pattern}'{found}")
    columns = [_values([match[field] for match in matches.values()]) for field in fields]
    return ViewNumbers(
        dict(zip(matches, zip(*columns, strict=True), strict=True)),
        tuple(name for name in names if name not in matches),
    )


def infer_view_numbers(source: str, names: Iterable[str]) -> ViewNumbers:
    """Numbers that differ from name to name, among names that are alike but for their numbers.

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
    for form in (_DECIMAL + _INTEGER, _INTEGER):  # without decimals: names such as 03.07.png
        group = _largest_group(source, [_cut(name, re.compile(form)) for name in names])
        varying = _varying(group)
        if varying:
            break
    else:
        raise SepiError(
            f"{source}: no number in the names counts the views ({', '.join(names[:3])}); give --pattern, such as "
            f"{EXAMPLES}"
        )
    if len(varying) > 2:
        raise SepiError(
            f"{source}: {len(varying)} numbers differ from name to name ({group[0].name}); give --pattern, such as "
            f"'{_suggested(group[0], varying)}'"
        )
    kept = {view.name for view in group}
    columns = [_values([view.numbers[at] for view in group]) for at in varying]
    line, line_likely = _line(group, varying[0]) if len(varying) == 1 else (None, False)
    return ViewNumbers(
        dict(zip([view.name for view in group], zip(*columns, strict=True), strict=True)),
        tuple(name for name in names if name not in kept),
        line,
        line_likely,
    )


def _cut(name: str, form: re.Pattern[str]) -> _Name:
    stem, dot, suffix = name.rpartition(".")
    if not dot:
        stem, suffix = name, ""
    texts, numbers, at = [""], [], 0
    for match in form.finditer(stem):
        texts[-1] += stem[at : match.start()]
        at = match.end()
        if match.lastgroup == "decimal" or len(match[0]) > _MAX_DIGITS:
            # a mark that no name has, so that names with other decimals are alike
            texts[-1] += "/" if match.lastgroup == "decimal" else match[0]
        else:
            numbers.append(match[0])
            texts.append("")
    texts[-1] += stem[at:]
    return _Name(name, (*texts, suffix.lower()), tuple(numbers))


def _largest_group(source: str, names: Sequence[_Name]) -> list[_Name]:
    """The largest group of names of the same texts."""
    groups: dict[tuple[str, ...], list[_Name]] = defaultdict(list)
    for name in names:
        if name.numbers or "/" in "".join(name.texts):
            groups[name.texts].append(name)
    ranked = sorted(groups.values(), key=len, reverse=True)
    if not ranked:
        raise SepiError(f"{source}: no picture's name has a number; expected names such as {EXAMPLES}")
    if len(ranked) > 1 and len(ranked[0]) == len(ranked[1]):
        raise SepiError(
            f"{source}: as many pictures are named like {ranked[0][0].name} as like {ranked[1][0].name}; say which are "
            f"the views with --pattern, such as {EXAMPLES}"
        )
    return ranked[0]


def _varying(group: Sequence[_Name]) -> list[int]:
    """Which numbers differ from name to name, leaving out those that repeat another."""
    columns: dict[tuple[int, ...], int] = {}
    for at in range(len(group[0].numbers)):
        values = tuple(int(view.numbers[at]) for view in group)
        if len(set(values)) > 1:
            columns.setdefault(values, at)
    return sorted(columns.values())


def _values(texts: Sequence[str]) -> list[int]:
    """The numbers; where all have a minus sign it only separates."""
    hyphens = all(text.startswith("-") for text in texts)
    return [abs(int(text)) if hyphens else int(text) for text in texts]


def _line(group: Sequence[_Name], at: int) -> tuple[str | None, bool]:
    """Whether the number before or after the one that varies, the same in all names, may be a row or a column."""
    written = [view.numbers[at] for view in group]
    count = len(group[0].numbers)
    beside = {line: index for line, index in (("row", at - 1), ("column", at + 1)) if 0 <= index < count}
    shared = {
        line: group[0].numbers[index]
        for line, index in beside.items()
        if len({int(view.numbers[index]) for view in group}) == 1 and abs(int(group[0].numbers[index])) < _SMALL
    }
    if len(shared) != 1:
        return None, False
    line, number = next(iter(shared.items()))
    widths = {len(text) for text in written}
    padded = len(widths) == 1
    return line, len(number) in widths if padded else number == str(int(number))


def _suggested(view: _Name, varying: Sequence[int]) -> str:
    """A pattern that takes the last two numbers for row and column."""
    fields = {varying[-2]: "{row}", varying[-1]: "{column}"}
    middle = (
        f"{fields.get(at, '*' if at in varying else number)}{text}"
        for at, (number, text) in enumerate(zip(view.numbers, view.texts[1:-1], strict=True))
    )
    return "".join((view.texts[0], *middle, ".", view.texts[-1])).replace("/", "*")


def _compiled(source: str, pattern: str) -> re.Pattern[str]:
    """The pattern as a regular expression that takes no longer than the name's length squared."""
    parts = re.findall(r"\{[^{}]*\}|\*|[^{}*]+|[{}]", pattern)
    fields = sorted(part for part in parts if part[0] in "{}")
    touching = any(first[0] == "{" == second[0] for first, second in pairwise(parts))
    # no file's name is longer
    if (
        fields not in (["{column}", "{row}"], ["{number}"])
        or touching
        or len(pattern) > 255
        or set("/\\") & set(pattern)
    ):
        raise SepiError(
            f"{source}: pattern '{pattern[:255]}': expected the name of a file in the folder, with {{row}} and "
            f"{{column}} once each and something between them, or {{number}} once; such as {EXAMPLES}"
        )
    segments = [""]
    for part in parts:
        if part == "*":
            segments.append("")
        elif part[0] == "{":
            segments[-1] += rf"(?<![0-9])(?P<{part[1:-1]}>-?[0-9]{{1,{_MAX_DIGITS}}}+)(?![0-9])"
        else:
            segments[-1] += re.escape(part)
    first, *middle = segments
    last = ".*" + middle.pop() if middle else ""
    # what lies between two stars may be taken where it first occurs: there is no need to come back to it
    return re.compile(first + "".join(f"(?>.*?{segment})" for segment in middle) + last, re.DOTALL)
