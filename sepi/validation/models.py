"""Checked models from what a user wrote (configuration, flags, JSON); each error is one line that names the key."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any, TypeVar

import numpy as np
from pydantic import BaseModel, BeforeValidator, ConfigDict, ValidationError

from sepi.errors import SepiError
from sepi.validation import pair_of, require_known

Model = TypeVar("Model", bound=BaseModel)


AS_PAIR = BeforeValidator(lambda value: pair_of(value) or (tuple(value) if isinstance(value, list) else value))
"""Validator of a field of two numbers, which also takes them as the command line does."""


class CheckedModel(BaseModel):
    """Keys and values that a user writes; frozen, without unknown keys or conversion of types."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, defer_build=True)


def _plain(value: object) -> Any:
    """A NumPy number as a Python number, for JSON."""
    if isinstance(value, np.generic):
        return value.item()
    raise TypeError


def validated(model: type[Model], values: Mapping[str, Any], where: str) -> Model:
    """The model with these values, checked.

    Parameters
    ----------
    model : type
        A pydantic model; unknown keys are errors.
    values : mapping
        Keys and values as JSON has them (lists for tuples, no NaN).
    where : str
        Where the user wrote them, for the message: ``"stages.initial.sepi"``.

    Raises
    ------
    SepiError
        If a key is wrong: the first one, why, and what would be right.
    """
    _require_fields(model, values, where)
    for key, value in values.items():
        try:
            json.dumps(value, default=_plain)
        except TypeError as error:
            # YAML can name Python objects
            raise SepiError(f"{where}.{key}: expected numbers, text, lists or keys with values, got {value}") from error
    try:
        # through JSON: strict models accept a JSON list for a tuple, but not a Python list
        return model.model_validate_json(json.dumps(dict(values), allow_nan=False, default=_plain))
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        key = ".".join([where, *map(str, first["loc"])])
        got = "" if first["type"] == "missing" else f", got {first['input']!r}"
        raise SepiError(f"{key}: {first['msg'][:1].lower()}{first['msg'][1:]}{got}") from error
    except (TypeError, ValueError) as error:
        raise SepiError(f"{where}: {error}") from error


def _require_fields(model: type[BaseModel], values: Mapping[str, Any], where: str) -> None:
    """Raise for unknown keys; unlike pydantic, suggest the nearest known key."""
    require_known(where, values, model.model_fields)
    for name, value in values.items():
        inner = model.model_fields[name].annotation
        if isinstance(inner, type) and issubclass(inner, BaseModel) and isinstance(value, Mapping):
            _require_fields(inner, value, f"{where}.{name}")
