"""Checks of values that a user wrote or passed; each error is one line that names the value."""

from __future__ import annotations

import difflib
import json
import math
import operator
import os
import re
from collections.abc import Iterable, Mapping
from numbers import Real
from pathlib import Path
from typing import Any

import numpy as np

from sepi.errors import SepiError


def value_of(text: str) -> Any:
    """Value of a text after ``KEY=``: read as JSON, else the text itself."""
    try:
        return json.loads(text)
    except (ValueError, RecursionError):
        return text


def settings_of(texts: Iterable[str], example: str, form: str = "KEY=VALUE", flag: str = "--set") -> dict[str, Any]:
    """Key to value, from a repeated flag ``--set KEY=VALUE``; keys have as many dots as the ``form`` in the error."""
    key = r"\.".join([r"\w+"] * (form.count(".") + 1))
    found = {}
    for text in texts:
        match = re.fullmatch(rf"({key})=(.*)", text)
        if match is None:
            raise SepiError(f"{flag} {text}: expected {form}, such as {example}")
        found[match[1]] = value_of(match[2])
    return found


def require_known(where: str, names: Iterable[str], known: Iterable[str]) -> None:
    """Raise for the first of ``names`` that is not ``known``; the error suggests the nearest and lists all."""
    # a mapping may load what it lists
    allowed = known if isinstance(known, Mapping) else list(known)
    unknown = next((str(name) for name in names if name not in allowed), None)
    if unknown is None:
        return
    near = difflib.get_close_matches(unknown, allowed, n=1, cutoff=0.5)
    hint = f"did you mean '{near[0]}'? " if near else ""
    raise SepiError(f"{where}: unknown '{unknown}'; {hint}known: {', '.join(allowed) or 'none'}")


def require_type(where: str, value: object, kind: type | tuple[type, ...], expected: str) -> None:
    """Raise unless ``value`` is of this type; the error says what was ``expected``."""
    if not isinstance(value, kind):
        raise SepiError(f"{where}: expected {expected}, got {described(value)}")


def require_path(where: str, value: object) -> Path:
    """The path that a string or path object holds."""
    require_type(where, value, (str, os.PathLike), "a path")
    return Path(value)  # type: ignore[arg-type]


def require_map(where: str, values: object, shape: tuple[int, ...] | None = None) -> None:
    """Raise unless ``values`` are an array (H, W) of real numbers, of this shape if there is one."""
    require_type(where, values, np.ndarray, "an array of numbers of shape (H, W)")
    assert isinstance(values, np.ndarray)
    if values.dtype.kind not in "fiu" or values.ndim != 2 or shape not in (None, values.shape):
        expected = "(H, W)" if shape is None else f"(H, W) = {shape}"
        raise SepiError(f"{where}: expected an array of numbers of shape {expected}, got {values.dtype} {values.shape}")


def is_finite(value: object) -> bool:
    """Whether a value is a finite real number, of Python or NumPy."""
    return isinstance(value, Real) and not isinstance(value, bool) and math.isfinite(value)


def whole_pair(where: str, value: Any, expected: str) -> tuple[int, int]:
    """Two whole numbers as a tuple; else an error that says what was ``expected``."""
    try:
        first, second = map(operator.index, value)
    except (TypeError, ValueError) as error:
        raise SepiError(f"{where}: expected {expected}, got {described(value)}") from error
    return first, second


def pair_of(text: object, signs: str = "xX×,") -> tuple[int, int] | None:
    """Two whole numbers with a sign between them, such as 9x9 or 4,4; None for anything else."""
    match = re.fullmatch(rf"\s*(\d{{1,6}})\s*[{signs}]\s*(\d{{1,6}})\s*", text) if isinstance(text, str) else None
    return None if match is None else (int(match[1]), int(match[2]))


def described(value: object) -> str:
    """A value for a message: the value itself if short, else its type."""
    if isinstance(value, Real) and not isinstance(value, bool):
        return f"{value:g}"
    short = repr(value)
    return short if len(short) <= 40 and not isinstance(value, np.ndarray) else f"a {type(value).__name__}"
