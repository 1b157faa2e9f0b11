"""Digest of the code behind a command, so that the workflow reruns a stage when its code changes.

Snakemake sees the shell command of a rule, not the modules that the command imports. Each rule therefore has
``params: code=code_digest("sepi.MODULE")``. The digest covers:

- the module and all modules of this package that it imports, directly or through others, anywhere in the code;
- the syntax tree, without docstrings, help texts and descriptions of parameters, so that neither these nor comments and
  layout count, and every version of Python gives the same digest;
- the source of each kernel that it imports and the headers that this includes, without comments and layout.

It does not cover:

- code below ``if __name__ == "__main__":``. In a stage that is the command, which parses flags and shows progress, and
  cannot change the maps. :func:`stage_modules` adds the module that writes them;
- code below ``if TYPE_CHECKING:``, which never runs;
- the ``__init__`` of a package on the way to a module, unless a name is imported from the package itself;
- the format readers and the built-in scenes, of which a job runs only one, which its rule names;
- other libraries: a new version of NumPy reruns nothing.

No stage imports another stage, so a change in one does not change the digests of others.
"""

from __future__ import annotations

import ast
import hashlib
import re
from collections.abc import Iterator
from functools import cache
from importlib.util import find_spec, resolve_name
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from sepi.stage import Choice

ROOT = Path(__file__).parents[2]
_PACKAGE = __name__.partition(".")[0]

_DOCUMENTED = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)
# blocks of a module that do not run when it is imported
_NOT_RUN = ("TYPE_CHECKING", "__name__ == '__main__'")


# packages and modules of which a job runs one
_READERS = ("exported", "hci", "image_folder")
_ALTERNATIVES = ("scenes", *(f"io.readers.{name}" for name in _READERS))
# arguments of calls that are texts for people
_TOLD = ("help", "description")


def stage_modules(stage: str, choice: Choice) -> tuple[str, ...]:
    """Modules whose code, with imports, determines a stage's file: stage, choice, preparation of views, file format."""
    prepared = "sepi.inspection.coded_views"
    return (f"sepi.{stage}", choice.function.__module__, prepared, "sepi.io.hdf5", "sepi.io.provenance")


@cache
def code_digest(*modules: str, root: Path = ROOT) -> str:
    """Digest of modules and of all modules that they import from their own package and from this one.

    Parameters
    ----------
    *modules : str
        Dotted names, such as ``"sepi.initial"``.
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
    names = sorted(imported_modules(*modules, root=root))
    return _digest("".join(f"{name}\n{_code_and_imports(name, root)[0]}\n" for name in names))[:16]


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()


def imported_modules(*modules: str, root: Path = ROOT) -> set[str]:
    """Dotted names of modules and of those of their package that they import, directly or through others."""
    found: set[str] = set()
    waiting = list(modules)
    while waiting:
        name = waiting.pop()
        if name not in found:
            found.add(name)
            followed = _code_and_imports(name, root)[1]
            waiting.extend(other for other in followed if _is_alternative(name) or not _is_alternative(other))
    return found


def _is_alternative(module: str) -> bool:
    inner = f"{module.partition('.')[2]}."
    return any(inner.startswith(f"{known}.") for known in _ALTERNATIVES)


@cache
def _root_of(package: str, root: Path) -> Path:
    """Folder that holds a package: ``root``, or where an extension is installed."""
    spec = None if (root / package).is_dir() else find_spec(package)
    if spec is None or spec.origin is None:
        return root
    return Path(spec.origin).parents[0 if spec.submodule_search_locations is None else 1]


@cache
def _file_of(module: str, root: Path) -> Path | None:
    *above, name = module.split(".")
    folder = _root_of(module.partition(".")[0], root).joinpath(*above)
    # kernels lie beside their callers, and are imported from one package
    below = ("*", "extensions/*") if folder.name == "kernels" else ()
    kernels = (path for inner in below for path in folder.parent.glob(f"{inner}/kernels/{name}.cpp"))
    return next(filter(Path.is_file, (folder / f"{name}.py", folder / name / "__init__.py", *kernels)), None)


@cache
def _code_and_imports(module: str, root: Path) -> tuple[str, frozenset[str]]:
    """Digest of a module's code, and the modules of its package that it imports."""
    file = _file_of(module, root)
    if file is None:
        raise ModuleNotFoundError(f"no module {module} in {root}")
    if file.suffix != ".py":
        return _digest(_kernel_text(file, root / file.relative_to(root).parts[0])), frozenset()
    tree = ast.parse(file.read_bytes())
    tree.body = [node for node in tree.body if not (isinstance(node, ast.If) and ast.unparse(node.test) in _NOT_RUN)]
    named: list[tuple[int, str, list[str]]] = []
    code = _digest(_dumped(tree, named))
    package = module if file.name == "__init__.py" else module.rpartition(".")[0]
    return code, frozenset(name for one in named for name in _imported(*one, package, root))


def _dumped(node: Any, named: list[tuple[int, str, list[str]]]) -> str:
    """Syntax tree as text; level, module and names of its imports are added to ``named``.

    Empty fields are left out, since versions of Python differ in them; ``ast.dump`` differs in more.
    """
    if isinstance(node, list):
        return f"[{', '.join([_dumped(one, named) for one in node])}]"
    if isinstance(node, ast.Constant):
        return repr(node.value)
    if not isinstance(node, ast.AST):
        return repr(node)
    if isinstance(node, ast.Import):
        named += [(0, alias.name, []) for alias in node.names]
    elif isinstance(node, ast.ImportFrom):
        named.append((node.level, node.module or "", [alias.name for alias in node.names]))
    elif isinstance(node, _DOCUMENTED) and ast.get_docstring(node, clean=False) is not None:
        node.body = node.body[1:]
    elif isinstance(node, ast.Call):
        node.keywords = [keyword for keyword in node.keywords if keyword.arg not in _TOLD]
    fields = [(name, value) for name, value in ast.iter_fields(node) if value is not None and value != []]
    return f"{type(node).__name__}({', '.join([f'{name}={_dumped(value, named)}' for name, value in fields])})"


def _imported(level: int, base: str, names: list[str], package: str, root: Path) -> Iterator[str]:
    """Modules that a statement imports; for ``from pkg import name``: ``pkg.name`` if it is a module, else ``pkg``."""
    base = resolve_name("." * level + base, package)
    if base.partition(".")[0] not in (package.partition(".")[0], _PACKAGE):
        return
    if not names:
        yield base
    for name in names:
        inner = f"{base}.{name}"
        yield inner if _file_of(inner, root) else base


def _kernel_text(file: Path, package: Path) -> str:
    """A C++ source without comments and layout, and after it the headers of its package that it includes."""
    text = re.sub(r"//[^\n]*|/\*.*?\*/", " ", file.read_text(encoding="utf-8"), flags=re.DOTALL)
    headers = re.findall(r'^#include "(.+)"', text, re.MULTILINE)
    # a header lies beside the source, or elsewhere in the package
    places = (file.parent / name if (file.parent / name).is_file() else package / name for name in headers)
    return " ".join([*text.split(), *(_kernel_text(place, package) for place in places)])
