"""Compiled code: the same bytes in the first run and in later ones, and never that of a source that has changed."""

import ast
import importlib
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from numba.core.dispatcher import Dispatcher
from numba.extending import _Intrinsic

import sepi
from sepi.compiled import _KernelFiles
from sepi.regularization.second_order_kernels import step

PACKAGE = Path(sepi.__file__).parent


def run(program: str, package: Path, cache: Path, threads: int = 1) -> bytes:
    environment = os.environ | {
        "NUMBA_CACHE_DIR": str(cache),
        "NUMBA_NUM_THREADS": str(threads),
        "OMP_NUM_THREADS": str(threads),
    }
    environment["PYTHONPATH"] = str(package.parent)
    # the folder that a program is started in comes before all others
    return subprocess.run(
        [sys.executable, "-c", program], env=environment, cwd=package.parent, capture_output=True, check=True
    ).stdout


def names_in(node: ast.AST) -> Iterator[str]:
    """Names that a definition uses, but for those of its annotations."""
    for field, value in ast.iter_fields(node):
        for child in value if isinstance(value, list) else [value]:
            if isinstance(child, ast.AST) and field not in ("annotation", "returns"):
                yield from names_in(child)
    if isinstance(node, ast.Name):
        yield node.id


def foreign_names(source: str) -> dict[str, str]:
    """Names of other modules of the package that compiled functions use, at first hand or through other definitions.

    And the module of each.
    """
    definitions: dict[str, ast.AST] = {}
    imported: dict[str, str] = {}
    for node in ast.parse(source).body:
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            definitions[node.name] = node
        elif isinstance(node, ast.Assign | ast.AnnAssign):
            targets = node.targets if isinstance(node, ast.Assign) else [node.target]
            definitions |= {name: node for target in targets for name in names_in(target)}
        elif isinstance(node, ast.ImportFrom) and (node.level or (node.module or "").startswith("sepi")):
            if node.module == "sepi.compiled":
                # numba's own words
                continue
            imported |= {alias.asname or alias.name: node.module or "" for alias in node.names}
        elif isinstance(node, ast.Import):
            imported |= {a.asname or "sepi": a.name for a in node.names if a.name.startswith("sepi")}
    used: set[str] = set()
    compiled = [
        name
        for name, node in definitions.items()
        if isinstance(node, ast.FunctionDef) and any("jit" in ast.unparse(d) for d in node.decorator_list)
    ]
    while compiled:
        name = compiled.pop()
        if name not in used:
            used.add(name)
            compiled += names_in(definitions[name]) if name in definitions else ()
    return {name: imported[name] for name in used & imported.keys()}


def test_rule_sees_functions_constants_and_flags_of_other_files() -> None:
    source = (
        "from numba import njit\nfrom sepi.a import f, FLAGS, UNIT, Kind\nHALF = UNIT / 2\n"
        "@njit(fastmath=FLAGS)\ndef g(x: Kind) -> Kind:\n    return f(x) * HALF\n"
    )
    assert foreign_names(source) == dict.fromkeys(("f", "FLAGS", "UNIT"), "sepi.a")


@pytest.mark.parametrize(
    "file", [path for path in PACKAGE.rglob("*.py") if "njit" in path.read_text()], ids=lambda path: path.stem
)
def test_compiled_functions_use_compiled_functions_of_other_files_only(file: Path) -> None:
    """Numba compiles a function anew when its own file changes, or that of a compiled function which it names.

    Of other things in other files nobody sees that they have changed.
    """
    for name, module in foreign_names(file.read_text()).items():
        kind = type(getattr(importlib.import_module(module), name))
        assert issubclass(kind, Dispatcher | _Intrinsic), f"{module}.{name}"


def test_compiled_at_once_by_two_processes_for_two_types(tmp_path: Path) -> None:
    """Either finds the code of its own type, or none: that of the other would crash, or compute anything."""
    assert isinstance(step._cache._cache_file, _KernelFiles)
    one, other = (_KernelFiles(str(tmp_path), "cost-1.py3", "of this source") for _ in range(2))
    # as both read the index before either wrote it
    known, save_data = iter([{}, {}]), one._save_data
    one._load_index = other._load_index = lambda: next(known)

    def save_other_meanwhile(*written: Any) -> None:
        other.save("float", "code for floats")
        save_data(*written)

    one._save_data = save_other_meanwhile
    one.save("integer", "code for integers")
    del one._load_index, other._load_index
    assert one.load("integer") in ("code for integers", None)
    assert one.load("float") in ("code for floats", None)
    one.save("integer", "code for integers")
    assert (one.load("float"), one.load("integer")) == ("code for floats", "code for integers")


@pytest.mark.system
@pytest.mark.slow
def test_changed_source_is_compiled_anew(tmp_path: Path) -> None:
    """With old machine code a changed constant or function would have no effect, until somebody clears the cache."""
    kernels = tmp_path / "kernels.py"
    # of another file that it calls, and of one that this one calls
    other, beyond = tmp_path / "other_kernels.py", tmp_path / "kernels_beyond.py"
    head = "from sepi.compiled import njit\n"
    beyond.write_text(head + "@njit(inline='always')\ndef same(z):\n    return z\n")
    other.write_text(head + "from kernels_beyond import same\n@njit()\ndef alike(z):\n    return same(z)\n")
    source = (
        "from sepi.compiled import njit\nfrom other_kernels import alike\nSCALE = 2.0\nFLAGS = {'nnan', 'ninf'}\n"
        "@njit(inline='always')\ndef robust(z):\n    return alike(z) / (z + SCALE)\n"
        "@njit(cache=True, fastmath=FLAGS)\ndef cost(x):\n    return robust(x * x)\n"
    )
    program = (
        f"import sys; sys.path.insert(0, {str(tmp_path)!r}); from kernels import cost; print(cost(2.0));"
        "print(sum(cost.stats.cache_misses.values()), sum(cost.stats.cache_hits.values()))"
    )

    def cost_misses_hits(text: str) -> tuple[float, ...]:
        kernels.write_text(text)
        return tuple(float(word) for word in run(program, PACKAGE, tmp_path / "cache").split())

    assert cost_misses_hits(source) == (4 / 6, 1, 0)
    for old, new, expected in (
        ("SCALE = 2.0", "SCALE = 12.0", 4 / 16),
        ("alike(z) / (z", "2 * alike(z) / (z", 8 / 16),
        ("'nnan', 'ninf'", "'nnan'", 8 / 16),
    ):
        assert old in source
        source = source.replace(old, new)
        assert cost_misses_hits(source) == (expected, 1, 0), new
    beyond.write_text(beyond.read_text().replace("return z", "return 2 * z"))
    assert cost_misses_hits(source) == (16 / 16, 1, 0)
    assert run(program, PACKAGE, tmp_path / "cache").split()[1:] == [b"0", b"1"]


@pytest.mark.system
@pytest.mark.slow
@pytest.mark.parametrize(
    ("variants", "number", "factor"),
    [
        pytest.param(("paper", "wang", "no_sepi", "best", "best_no_detail"), "u1", 1, marks=pytest.mark.faults),
        pytest.param(("paper",), "u2", 257, marks=pytest.mark.faults),
        pytest.param(("paper",), "f4", 1 / 255, marks=pytest.mark.faults),
    ],
)
def test_first_run_gives_the_bytes_of_later_ones(
    tmp_path: Path, variants: tuple[str, ...], number: str, factor: float
) -> None:
    """Freshly compiled kernels round as those loaded from disk do; else two machines would never agree.

    `make` asks the same of the kernels that it compiles.
    """
    program = (
        "import sys, numpy as np; from dataclasses import replace; from sepi.scenes import render;"
        "from sepi.pipeline import estimate_depth; scene = render('pyramids', size=64, views=5);"
        f"views = scene.views * np.array({factor}); scene = replace(scene, views=views.astype('{number}'))\n"
        f"for variant in {variants}:\n"
        "    maps = estimate_depth(scene, variant)\n"
        "    sys.stdout.buffer.write(maps.disparity.tobytes() + maps.confidence.tobytes())"
    )
    assert run(program, PACKAGE, tmp_path, threads=2) == run(program, PACKAGE, tmp_path, threads=1)
