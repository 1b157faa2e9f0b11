"""Checked models from what a user wrote (configuration, flags, JSON); each error is one line that names the key."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import fields
from functools import cache
from typing import Annotated, Any, TypeVar, get_type_hints

import numpy as np
from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, ValidationError, create_model

from sepi.errors import SepiError
from sepi.validation import pair_of, require_known

Model = TypeVar("Model", bound=BaseModel)


AS_PAIR = BeforeValidator(lambda value: pair_of(value) or (tuple(value) if isinstance(value, list) else value))
"""Validator of a field of two numbers, which also takes them as the command line does."""

Index = Annotated[int, Field(ge=0)]
Count = Annotated[int, Field(ge=1)]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
Grid = Annotated[tuple[Count, Count] | None, AS_PAIR]
Position = Annotated[tuple[Index, Index] | None, AS_PAIR]


class CheckedModel(BaseModel):
    """Keys and values that a user writes; frozen, without unknown keys or conversion of types."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, defer_build=True)


@cache
def model_of(described: type, base: type[BaseModel] = CheckedModel) -> type[Any]:
    """Model with the fields of a data class, and those of a ``base``."""
    # the types of this module need not be imported there
    hints = get_type_hints(described, None, globals(), include_extras=True)
    keys: dict[str, Any] = {field.name: (hints[field.name], field.default) for field in fields(described)}
    return create_model(described.__name__, __base__=base, **keys)


def _plain(value: object) -> Any:
    """A NumPy number or array as Python's, for JSON."""
    if isinstance(value, np.generic | np.ndarray):
        return value.tolist()
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
            json.dumps(value, allow_nan=False, default=_plain)
        except (TypeError, ValueError) as error:
            # YAML can name Python objects; NaN and infinity are no values
            raise SepiError(f"{where}.{key}: expected numbers, text, lists or keys with values, got {value}") from error
    try:
        # through JSON: strict models accept a JSON list for a tuple, but not a Python list
        return model.model_validate_json(json.dumps(dict(values), allow_nan=False, default=_plain))
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        key = ".".join([where, *map(str, first["loc"])])
        got = "" if first["type"] == "missing" else f", got {first['input']!r}"
        message = first["msg"].removeprefix("Value error, ")
        raise SepiError(f"{key}: {message[:1].lower()}{message[1:]}{got}") from error
    except (TypeError, ValueError) as error:
        raise SepiError(f"{where}: {error}") from error


def _require_fields(model: type[BaseModel], values: Mapping[str, Any], where: str) -> None:
    """Raise for unknown keys; unlike pydantic, suggest the nearest known key."""
    require_known(where, values, model.model_fields)
    for name, value in values.items():
        inner = model.model_fields[name].annotation
        if isinstance(inner, type) and issubclass(inner, BaseModel) and isinstance(value, Mapping):
            _require_fields(inner, value, f"{where}.{name}")
