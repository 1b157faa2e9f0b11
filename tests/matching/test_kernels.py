"""Compiled code: the same bytes in the first run and in later ones, and never that of a source that has changed."""

import ast
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

import sepi

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


def foreign_names(source: str) -> set[str]:
    """Names of other modules of the package that compiled functions use, at first hand or through other definitions."""
    definitions: dict[str, ast.AST] = {}
    imported: set[str] = set()
    for node in ast.parse(source).body:
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            definitions[node.name] = node
        elif isinstance(node, ast.Assign | ast.AnnAssign):
            targets = node.targets if isinstance(node, ast.Assign) else [node.target]
            definitions |= {name: node for target in targets for name in names_in(target)}
        elif isinstance(node, ast.ImportFrom) and (node.level or (node.module or "").startswith("sepi")):
            imported |= {alias.asname or alias.name for alias in node.names}
        elif isinstance(node, ast.Import):
            imported |= {a.asname or "sepi" for a in node.names if a.name.startswith("sepi")}
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
    return used & imported


def test_rule_sees_functions_constants_and_flags_of_other_files() -> None:
    source = (
        "from numba import njit\nfrom sepi.a import f, FLAGS, UNIT, Kind\nHALF = UNIT / 2\n"
        "@njit(fastmath=FLAGS)\ndef g(x: Kind) -> Kind:\n    return f(x) * HALF\n"
    )
    assert foreign_names(source) == {"f", "FLAGS", "UNIT"}


@pytest.mark.parametrize(
    "file", [path for path in PACKAGE.rglob("*.py") if "njit" in path.read_text()], ids=lambda path: path.stem
)
def test_compiled_functions_use_their_own_file_only(file: Path) -> None:
    """When the file of a function changes, numba compiles it anew; of other files that it uses numba knows nothing."""
    assert foreign_names(file.read_text()) == set()


@pytest.mark.system
@pytest.mark.slow
def test_changed_source_is_compiled_anew(tmp_path: Path) -> None:
    """With old machine code a changed constant or function would have no effect, until somebody clears the cache."""
    package, cache = tmp_path / "sepi", tmp_path / "cache"
    shutil.copytree(PACKAGE, package, ignore=shutil.ignore_patterns("__pycache__"))
    kernels = package / "matching" / "plane_sweep_kernels.py"
    program = (
        "import numpy as np; from sepi.matching.plane_sweep import sampled_candidates;"
        "from sepi.matching.plane_sweep_kernels import Run, cost_row; from sepi.matching.sweep_arrays import ViewStack;"
        "colours = np.random.default_rng(0).integers(0, 255, (3, 3, 3, 9, 9)).astype(np.uint8);"
        "subsets, groups = np.ones((1, 1), bool), np.zeros((3, 3), np.int64);"
        "shown = np.zeros((3, 3, 0, 2), np.int64);"
        "views = ViewStack(colours, 1, 1, groups, subsets, np.float32(900), shown);"
        "baselines = np.moveaxis(np.indices((3, 3)), 0, 2) - 1.0;"
        "candidates = sampled_candidates(np.linspace(-1, 1, 5).astype(np.float32), baselines);"
        "cost = np.zeros((1, 5, 9), np.float32); cost_row(views, candidates, Run(4, 0, 9), cost);"
        "print(sum(cost_row.stats.cache_misses.values()), cost.sum())"
    )

    def compiled_and_cost() -> tuple[str, str]:
        compiled, cost = run(program, package, cache).decode().split()
        return compiled, cost

    compiled, before = compiled_and_cost()
    assert compiled == "1"
    assert compiled_and_cost() == ("0", before)
    for old, new in (("z / (z + scale2)", "z / (z + 4 * scale2)"), ('"nnan", "ninf", "nsz"', '"nnan", "ninf"')):
        source = kernels.read_text()
        assert old in source
        kernels.write_text(source.replace(old, new))
        compiled, cost = compiled_and_cost()
        assert compiled == "1"
        # rounding is the same with the other flags
        assert (float(cost) < 0.9 * float(before)) == ("scale2" in new)
        before = cost


@pytest.mark.system
@pytest.mark.slow
@pytest.mark.parametrize(
    ("variants", "number", "factor"),
    [
        (("paper", "wang", "no_sepi", "best", "best_no_detail"), "u1", 1),
        pytest.param(("paper",), "u2", 257, marks=pytest.mark.faults),
        pytest.param(("paper",), "f4", 1 / 255, marks=pytest.mark.faults),
    ],
)
def test_first_run_gives_the_bytes_of_later_ones(
    tmp_path: Path, variants: tuple[str, ...], number: str, factor: float
) -> None:
    """Freshly compiled kernels round as those loaded from disk do; else two machines would never agree."""
    program = (
        "import sys, numpy as np; from dataclasses import replace; from sepi.scenes import render;"
        "from sepi.pipeline import estimate_depth; scene = render('pyramids', size=64, views=5);"
        f"views = scene.views * np.array({factor}); scene = replace(scene, views=views.astype('{number}'))\n"
        f"for variant in {variants}:\n"
        "    maps = estimate_depth(scene, variant)\n"
        "    sys.stdout.buffer.write(maps.disparity.tobytes() + maps.confidence.tobytes())"
    )
    assert run(program, PACKAGE, tmp_path, threads=2) == run(program, PACKAGE, tmp_path, threads=1)
