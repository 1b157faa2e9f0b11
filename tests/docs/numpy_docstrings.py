"""What the public names are, and what their docstrings say, section by section.

numpydoc would parse them, too, but brings Sphinx with it; these tests need no more than headings and names.
"""

from __future__ import annotations

import ast
import dataclasses
import importlib
import inspect
import re
import textwrap
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from types import FunctionType, ModuleType
from typing import Any

from pydantic import BaseModel

import sepi

ROOT = Path(__file__).parents[2]
LIST = ROOT / "docs" / "reference" / "api_names.txt"

_HEADING = re.compile(r"^([A-Z]\w+(?: \w+)?)\n-{3,}$", re.MULTILINE)


def listed_names() -> list[str]:
    """The names of the list, without its titles and comments."""
    lines = LIST.read_text(encoding="utf-8").splitlines()
    return [line for line in map(str.strip, lines) if line and not line.startswith("#")]


def found(dotted: str) -> Any:
    """What a dotted name stands for."""
    module, name = home(dotted)
    return getattr(module, name)


def home(dotted: str) -> tuple[ModuleType, str]:
    """The module in which users find a name, and the name there."""
    path, _, name = dotted.rpartition(".")
    return importlib.import_module(path), name


def is_constant(dotted: str) -> bool:
    """Whether a name is neither function nor class, so that its docstring stands below it."""
    return not isinstance(found(dotted), FunctionType | type)


def docstring(dotted: str) -> str:
    """Docstring of a function or class; of a constant, the string below its assignment, wherever that is."""
    if not is_constant(dotted):
        return inspect.getdoc(found(dotted)) or ""
    module, name = home(dotted)
    return inspect.cleandoc(_below_assignment(module.__name__, name))


def _below_assignment(module: str, name: str) -> str:
    tree = _tree(module)
    for body in (tree.body, *(node.body for node in tree.body if isinstance(node, ast.If))):
        for node, after in zip(body, [*body[1:], None], strict=True):
            if isinstance(node, ast.ImportFrom) and name in [alias.name for alias in node.names]:
                return _below_assignment(str(node.module), name)
            targets = node.targets if isinstance(node, ast.Assign) else [getattr(node, "target", None)]
            if name in [target.id for target in targets if isinstance(target, ast.Name)]:
                is_text = isinstance(after, ast.Expr) and isinstance(after.value, ast.Constant)
                return str(after.value.value) if is_text else ""
    raise AssertionError(f"{module} assigns no {name}")


@cache
def _tree(module: str) -> ast.Module:
    return ast.parse(Path(str(importlib.import_module(module).__file__)).read_text(encoding="utf-8"))


def sections(text: str) -> dict[str, str]:
    """Heading to the text of its section; what comes before the first heading is the section ``""``."""
    parts = _HEADING.split(text)
    return {"": parts[0].strip(), **dict(zip(parts[1::2], (part.strip("\n") for part in parts[2::2]), strict=True))}


def names_in(section: str) -> list[str]:
    """The names that a section such as Parameters describes, in order, without stars."""
    heads = [line.partition(" : ")[0] for line in section.splitlines() if line and not line[0].isspace()]
    return [name.strip().lstrip("*") for head in heads for name in head.split(",")]


def parameters_of(function: Any) -> list[str]:
    """The parameters that callers of a function, a method or a class may give."""
    return [name for name in inspect.signature(function).parameters if name != "self"]


def fields_of(cls: type) -> list[str] | None:
    """Fields of a data class, a named tuple, or a model; None of a class that declares none."""
    if dataclasses.is_dataclass(cls):
        return [field.name for field in dataclasses.fields(cls)]
    if issubclass(cls, BaseModel):
        return list(cls.model_fields)
    return list(cls._fields) if hasattr(cls, "_fields") else None


def public_members(cls: type) -> Iterator[tuple[str, FunctionType | property]]:
    """Public methods and properties that a class, or one of this package that it inherits from, defines."""
    own = [parent for parent in cls.__mro__ if parent.__module__.startswith("sepi")]
    members = {name: value for parent in reversed(own) for name, value in vars(parent).items()}
    for name, value in members.items():
        function = getattr(value, "__func__", value)
        shown = not name.startswith("_") or name == "__call__"
        if shown and isinstance(function, FunctionType | property):
            yield name, function


def raises_an_error(function: Any) -> bool:
    """Whether a function, or one of its module that it calls by name, raises a ``SepiError`` by itself."""
    code = inspect.unwrap(function)
    module = inspect.getmodule(code)
    assert module is not None
    functions = {node.name: node for node in _tree(module.__name__).body if isinstance(node, ast.FunctionDef)}
    node = ast.parse(textwrap.dedent(inspect.getsource(code))).body[0]
    waiting, seen = [node], set()
    while waiting:
        for inner in ast.walk(waiting.pop()):
            if isinstance(inner, ast.Raise) and "SepiError" in ast.unparse(inner):
                return True
            called = inner.func.id if isinstance(inner, ast.Call) and isinstance(inner.func, ast.Name) else None
            if called in functions and called not in seen:
                seen.add(called)
                waiting.append(functions[called])
    return False


def unimported(source: str) -> set[str]:
    """What a text takes from ``sepi`` by a dot that ``import sepi`` alone, or a line of its own, does not bring."""
    imported = {name.split(".")[1] for name in re.findall(r"^import (sepi\.[\w.]+)", source, re.MULTILINE)}
    used = [node for node in ast.walk(ast.parse(source)) if isinstance(node, ast.Attribute)]
    names = {node.attr for node in used if isinstance(node.value, ast.Name) and node.value.id == "sepi"}
    return names - {*dir(sepi), *imported}
