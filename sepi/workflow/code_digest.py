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
- not the readers of the formats, the built-in and the rendered scenes, of which a job runs one: only that counts, which
  :func:`ingest_modules` names;
- not what is told of the rendered scenes, since to render them takes long;
- the syntax tree without docstrings, texts of help and descriptions of parameters: neither these nor comments nor
  layout count, and every version of Python gives the same digest;
- of kernels, the source of each that it imports and the headers which that includes, without comments and layout;
- not other libraries: a new version of numpy reruns nothing.

No stage imports another stage, so a change in one leaves the others' digests as they are.

Reading all of the code takes most of a second, a fifth of a start of Snakemake. So what each source comes to is cached
in Snakemake's own folder, keyed by the source itself: a changed one is read, whatever its time stamp.
"""

from __future__ import annotations

import ast
import hashlib
import json
import re
from collections.abc import Iterator
from contextlib import suppress
from functools import cache
from importlib.util import resolve_name
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sepi.errors import SepiError
from sepi.io.files import atomic_path

if TYPE_CHECKING:
    from sepi.stage import Choice

ROOT = Path(__file__).parents[2]

_DOCUMENTED = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)
# blocks of a module that are not run when it is imported
_NOT_RUN = ("TYPE_CHECKING", "__name__ == '__main__'")


# packages and modules of which a job runs one
_ALTERNATIVES = (
    "scenes",
    "rendered",
    *(
        f"io.readers.{name}"
        for name in (
            "calibrated",
            "eslf",
            "exported",
            "hci",
            "hci_2013",
            "hdf5_arrays",
            "image_folder",
            "matlab",
            "mosaic",
            "numpy_files",
            "open_lf",
            "tiff_stack",
        )
    ),
)
_HEADER = ".hpp"
# what is told to people alone: words of calls, and what the rendered scenes are
_TOLD = ("help", "description")
_TELLING = "rendered.catalogue"

# what a source comes to: a digest of its code; level, module and names of what it imports, as they stand in it
_Code = tuple[str, list[tuple[int, str, list[str]]]]

# in Snakemake's folder
_KEPT = "sepi_code.json"
# what is read by other code than this one may come to something else
_OWN = Path(__file__).read_bytes()
# key of a source to what it comes to: of the start before, and of this one
_before: dict[str, _Code] = {}
_read: dict[str, _Code] = {}


def stage_modules(stage: str, choice: Choice) -> tuple[str, ...]:
    """Modules that decide, with what they import, what is in a stage's file: the stage, the module of the choice that
    it runs, what is done to the views before, and the format of the file.
    """
    return (f"sepi.{stage}", choice.function.__module__, "sepi.exposure", "sepi.io.hdf5", "sepi.io.provenance")


def ingest_modules(reader: str) -> tuple[str, ...]:
    """Modules that decide what is in a light field's file: ingest, and the module that reads or renders the views."""
    return ("sepi.ingest", reader)


def render_modules(world: str) -> tuple[str, ...]:
    """Modules that decide what is in the file of a rendered scene: the renderer, and the module of that scene."""
    return ("sepi.rendered.rendering", f"sepi.rendered.worlds.{world}")


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
        total.update(f"{name}\n{_code_and_imports(name, root)[0]}\n".encode())
    return total.hexdigest()[:16]


def imported_modules(*modules: str, root: Path = ROOT) -> set[str]:
    """The modules and those of their package that they import, directly or through others; dotted names."""
    found: set[str] = set()
    waiting = list(modules)
    while waiting:
        name = waiting.pop()
        if name not in found:
            found.add(name)
            followed = [other for other in _code_and_imports(name, root)[1] if other.partition(".")[2] != _TELLING]
            waiting.extend(other for other in followed if _is_alternative(name) or not _is_alternative(other))
    return found


def _is_alternative(module: str) -> bool:
    inner = f"{module.partition('.')[2]}."
    return any(inner.startswith(f"{known}.") for known in _ALTERNATIVES)


@cache
def _file_of(module: str, root: Path) -> Path | None:
    *above, name = module.removesuffix(_HEADER).split(".")
    folder = root.joinpath(*above)
    if module.endswith(_HEADER):
        return folder / f"{name}{_HEADER}"
    # kernels stand beside what calls them, and are imported from one place
    kernels = folder.parent.glob(f"*/kernels/{name}.cpp") if folder.name == "kernels" else ()
    return next(filter(Path.is_file, (folder / f"{name}.py", folder / name / "__init__.py", *kernels)), None)


@cache
def _code_and_imports(module: str, root: Path) -> tuple[str, frozenset[str]]:
    """A digest of the code of a module, and the modules of its package that it imports."""
    file = _file_of(module, root)
    if file is None:
        raise ModuleNotFoundError(f"no module {module} in {root}")
    source = file.read_bytes()
    key = hashlib.sha256(b"\0".join((_OWN, file.suffix.encode(), source))).hexdigest()
    if key not in _read:
        _read[key] = _before.get(key) or (_python_code if file.suffix == ".py" else _kernel_code)(source)
    code, named = _read[key]
    if file.suffix != ".py":
        return code, frozenset(_header(name, file, root) for _, name, _ in named)
    package = module if file.name == "__init__.py" else module.rpartition(".")[0]
    imports = {name for level, base, names in named for name in _imported(level, base, names, package, root)}
    return code, frozenset(name for name in imports if name.split(".")[0] == module.split(".")[0])


def _kernel_code(source: bytes) -> _Code:
    """Of a C++ source without comments and layout, and the headers of the project that it includes."""
    text = re.sub(r"//[^\n]*|/\*.*?\*/", " ", source.decode(), flags=re.DOTALL)
    headers = re.findall(r'^#include "(.+)\.hpp"', text, re.MULTILINE)
    return hashlib.sha256(" ".join(text.split()).encode()).hexdigest(), [(0, name, []) for name in headers]


def _python_code(source: bytes) -> _Code:
    """Of the syntax tree of a source without docstrings, and what its statements import."""
    tree = ast.parse(source)
    tree.body = [node for node in tree.body if not (isinstance(node, ast.If) and ast.unparse(node.test) in _NOT_RUN)]
    named: list[tuple[int, str, list[str]]] = []
    text = _dumped(tree, named)
    return hashlib.sha256(text.encode()).hexdigest(), named


def _dumped(node: Any, named: list[tuple[int, str, list[str]]]) -> str:
    """A syntax tree as text; what is imported is added to ``named``.

    Versions of Python differ in the empty fields that they have, and ``ast.dump`` in more.
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
    """The modules that a statement imports: of ``from pkg import name``, ``pkg.name`` if that is one, else ``pkg``."""
    base = resolve_name("." * level + base, package)
    if not names:
        yield base
    for name in names:
        inner = f"{base}.{name}"
        yield inner if _file_of(inner, root) else base


def _header(name: str, file: Path, root: Path) -> str:
    """The header that a kernel or a header includes by this name: beside it, or in the package."""
    near = file.parent / f"{name}{_HEADER}"
    place = near if near.is_file() else root / file.relative_to(root).parts[0] / f"{name}{_HEADER}"
    return ".".join(place.relative_to(root).with_suffix("").parts) + _HEADER


def remember(folder: Path) -> None:
    """Take over what the start before kept in a folder, where it is there and can be read."""
    with suppress(OSError, ValueError, TypeError):
        _before.update(json.loads((folder / _KEPT).read_text(encoding="utf-8")))


def keep(folder: Path) -> None:
    """Keep what was read, where the folder is there and can be written: the next start is as right without."""
    if folder.is_dir() and _read != _before:
        with suppress(OSError, SepiError), atomic_path(folder / _KEPT) as temporary:
            temporary.write_text(json.dumps(_read), encoding="utf-8")
