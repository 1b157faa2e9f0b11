"""Digest of the code behind a command, so that the workflow reruns a stage when its code changes.

Snakemake sees the shell command of a rule, not the modules that the command imports. Each rule therefore has
``params: code=code_digest("sepi.MODULE")``. What counts:

- the module itself and every module of this package that it imports, directly or through others, wherever the import
  stands;
- not what stands below ``if __name__ == "__main__":``. For a stage that is the command, which parses flags and shows
  progress: it cannot change the maps. What writes them to a file can: :func:`stage_modules` adds it;
- not what stands below ``if TYPE_CHECKING:``, which never runs;
- not the ``__init__`` of a package on the way to a module: it is run, but nothing of it is used. It counts where a name
  is imported from the package itself;
- the syntax tree without docstrings: neither comments nor layout count;
- not other libraries: a new version of numpy reruns nothing.

No stage imports another stage, so a change in one leaves the others' digests as they are.
"""

from __future__ import annotations

import ast
import hashlib
from collections.abc import Iterator
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parents[2]

# blocks of a module that are not run when it is imported
_NOT_RUN = ("TYPE_CHECKING", "__name__ == '__main__'")


def stage_modules(stage: str) -> tuple[str, ...]:
    """Modules that decide, with what they import, what is in a stage's file: the stage, and the format of the file."""
    return (f"sepi.{stage}", "sepi.io.hdf5", "sepi.io.provenance")


@cache
def code_digest(*modules: str, root: Path = ROOT) -> str:
    """Digest of modules and of all that they import from their own package.

    Parameters
    ----------
    *modules : str
        Dotted names, ``"sepi.initial"``.
    root : Path
        Folder that holds the package.

    Returns
    -------
    str
        16 hexadecimal digits.

    Raises
    ------
    ModuleNotFoundError
        If there is no such module below ``root``.
    """
    total = hashlib.sha256()
    for name in sorted(imported_modules(*modules, root=root)):
        total.update(f"{name}\n{_code(_file_of(name, root))}\n".encode())
    return total.hexdigest()[:16]


def imported_modules(*modules: str, root: Path = ROOT) -> set[str]:
    """The modules and those of their package that they import, directly or through others; dotted names."""
    found: set[str] = set()
    waiting = list(modules)
    while waiting:
        name = waiting.pop()
        if name not in found:
            found.add(name)
            waiting.extend(_imports(name, root))
    return found


def _file_of(module: str, root: Path) -> Path:
    path = root.joinpath(*module.split("."))
    for candidate in (path.with_name(f"{path.name}.py"), path / "__init__.py"):
        if candidate.is_file():
            return candidate
    raise ModuleNotFoundError(f"no module {module} in {root}")


def _is_module(module: str, root: Path) -> bool:
    try:
        return bool(_file_of(module, root))
    except ModuleNotFoundError:
        return False


@cache
def _tree(file: Path) -> ast.Module:
    tree = ast.parse(file.read_bytes(), str(file))
    tree.body = [node for node in tree.body if not (isinstance(node, ast.If) and ast.unparse(node.test) in _NOT_RUN)]
    return tree


@cache
def _imports(module: str, root: Path) -> frozenset[str]:
    return frozenset(_imported_by(module, root))


def _imported_by(module: str, root: Path) -> Iterator[str]:
    file = _file_of(module, root)
    package = module.split(".")[0]
    for node in _statements(_tree(file).body):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if alias.name.split(".")[0] == package)
        elif isinstance(node, ast.ImportFrom):
            base = _absolute(node, module, file.name == "__init__.py")
            if base.split(".")[0] == package:
                yield from _imported_from(base, [alias.name for alias in node.names], root)


def _imported_from(base: str, names: list[str], root: Path) -> Iterator[str]:
    for name in names:
        inner = f"{base}.{name}"
        if _is_module(inner, root):
            yield inner
        elif _is_module(base, root):
            yield base


def _absolute(node: ast.ImportFrom, module: str, is_package: bool) -> str:
    if node.level == 0:
        return node.module or ""
    parts = module.split(".")
    up = node.level - 1 if is_package else node.level
    return ".".join([*parts[: len(parts) - up], *([node.module] if node.module else [])])


@cache
def _code(file: Path) -> str:
    """The syntax tree of a file without docstrings; remembered, since most files belong to several commands."""
    tree = _tree(file)
    for node in [tree, *_statements(tree.body)]:
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef) and _is_text(
            node.body[:1]
        ):
            node.body = node.body[1:]
    return ast.dump(tree)


def _statements(body: list[ast.stmt]) -> Iterator[ast.stmt]:
    """All statements of a body and of those in it; expressions, of which there are far more, are not looked into."""
    for node in body:
        yield node
        for inner in (node, *getattr(node, "handlers", ()), *getattr(node, "cases", ())):
            for field in ("body", "orelse", "finalbody") if inner is node else ("body",):
                yield from _statements(getattr(inner, field, []))


def _is_text(first: list[ast.stmt]) -> bool:
    """Whether a body's first statement, if any, is its docstring."""
    return any(
        isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str)
        for node in first
    )
