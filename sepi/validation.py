"""Turn what a user wrote (config keys, flags, JSON) into checked models; each error is one line that names the key."""

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
from typing import Any, TypeVar

import numpy as np
from pydantic import BaseModel, ConfigDict, ValidationError

from sepi.errors import SepiError
from sepi.renamed import new_name

Model = TypeVar("Model", bound=BaseModel)


class CheckedModel(BaseModel):
    """Keys and values that a user writes: frozen, unknown keys refused, no value taken for one of another type."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, defer_build=True)


def value_of(text: str) -> Any:
    """What a user wrote after ``KEY=``: as JSON reads it, or the text itself."""
    try:
        return json.loads(text)
    except (ValueError, RecursionError):
        return text


def settings_of(texts: Iterable[str], example: str) -> dict[str, Any]:
    """What a user gave by ``--set KEY=VALUE``, repeated."""
    found = {}
    for text in texts:
        match = re.fullmatch(r"(\w+)=(.*)", text)
        if match is None:
            raise SepiError(f"--set {text}: expected KEY=VALUE, such as {example}")
        found[match[1]] = value_of(match[2])
    return found


def require_known(where: str, names: Iterable[str], known: Iterable[str]) -> None:
    """Raise for the first of ``names`` that is not ``known``: with its new name, or the nearest and all of them."""
    allowed = list(known)
    unknown = next((str(name) for name in names if name not in allowed), None)
    if unknown is None:
        return
    new = new_name(unknown, allowed)
    if new is not None:
        raise SepiError(f"{where}: unknown '{unknown}'; it is now {new}")
    near = difflib.get_close_matches(unknown, allowed, n=1, cutoff=0.5)
    hint = f"did you mean '{near[0]}'? " if near else ""
    raise SepiError(f"{where}: unknown '{unknown}'; {hint}known: {', '.join(allowed) or 'nothing can be set here'}")


def require_type(where: str, value: object, kind: type | tuple[type, ...], expected: str) -> None:
    """Raise unless ``value`` is of this type: what is wrong, in the words of what was ``expected``."""
    if not isinstance(value, kind):
        raise SepiError(f"{where}: expected {expected}, got {described(value)}")


def require_path(where: str, value: object) -> Path:
    """A path, whatever held it."""
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
    """Two whole numbers, as a tuple whatever held them; an error that says what was ``expected`` otherwise."""
    try:
        first, second = map(operator.index, value)
    except (TypeError, ValueError) as error:
        raise SepiError(f"{where}: expected {expected}, got {described(value)}") from error
    return first, second


def described(value: object) -> str:
    """A value for a message: itself where that is short, else what it is."""
    if isinstance(value, Real) and not isinstance(value, bool):
        return f"{value:g}"
    short = repr(value)
    return short if len(short) <= 40 and not isinstance(value, np.ndarray) else f"a {type(value).__name__}"


def _plain(value: object) -> Any:
    """A NumPy number as Python's, for JSON."""
    if isinstance(value, np.generic):
        return value.item()
    raise TypeError


def validated(model: type[Model], values: Mapping[str, Any], where: str) -> Model:
    """Check ``values`` against ``model``.

    Parameters
    ----------
    model : type
        A pydantic model; its unknown keys are errors.
    values : mapping
        Keys and values as JSON has them (lists for tuples, no NaN).
    where : str
        The place the user wrote them, for the message: ``"stages.initial.sepi"``.

    Raises
    ------
    SepiError
        One line for the first key that is wrong: which, why, and what would be right.
    """
    _require_fields(model, values, where)
    for key, value in values.items():
        try:
            json.dumps(value, default=_plain)
        except TypeError as error:
            # YAML can name Python objects
            raise SepiError(f"{where}.{key}: expected numbers, text, lists or keys with values, got {value}") from error
    try:
        # by way of JSON, because strict models take a JSON list for a tuple but not a Python list
        return model.model_validate_json(json.dumps(dict(values), allow_nan=False, default=_plain))
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        key = ".".join([where, *map(str, first["loc"])])
        got = "" if first["type"] == "missing" else f", got {first['input']!r}"
        raise SepiError(f"{key}: {first['msg'][:1].lower()}{first['msg'][1:]}{got}") from error
    except (TypeError, ValueError) as error:
        raise SepiError(f"{where}: {error}") from error


def _require_fields(model: type[BaseModel], values: Mapping[str, Any], where: str) -> None:
    """Refuse unknown keys here rather than by pydantic, to suggest the nearest known one."""
    require_known(where, values, model.model_fields)
    for name, value in values.items():
        inner = model.model_fields[name].annotation
        if isinstance(inner, type) and issubclass(inner, BaseModel) and isinstance(value, Mapping):
            _require_fields(inner, value, f"{where}.{name}")
