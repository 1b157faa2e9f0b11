"""The digest of a stage's code: too coarse, and a changed comment costs hours; too fine, and results are stale."""

import json
import os
from collections.abc import Callable
from pathlib import Path

import pytest

from sepi.io.readers.formats import FORMATS
from sepi.variants import STAGES, compared_methods
from sepi.workflow import code_digest as module
from sepi.workflow.code_digest import code_digest, imported_modules, ingest_modules, keep, remember, stage_modules

FILES = {
    "pkg/__init__.py": "from pkg import extra\n",
    "pkg/one.py": '"""One."""\n\nimport numpy\n\nfrom pkg import shared\nfrom pkg.io import reader\n\n\n'
    'def f(x):\n    """Twice."""\n    return 2 * x  # doubled\n\n\ng = option("--n", help=f"Number {1:{2}d}.")\n',
    "pkg/two.py": "from pkg.shared import value\nfrom .io.files import path\n",
    "pkg/shared.py": "value = 1\n",
    "pkg/extra.py": "extra = 1\n",
    "pkg/lazy.py": "def g():\n    import pkg.extra\n    return pkg.extra\n",
    "pkg/deep.py": "try:\n    x = 1\nexcept ValueError:\n    import pkg.extra\nfinally:\n    from pkg import shared\n"
    "with open('x'):\n    match x:\n        case 1:\n            from pkg.io import reader\n"
    "if x:\n    pass\nelse:\n    from pkg.io.files import path\n",
    "pkg/names.py": "from pkg.io import read\n",
    "pkg/command.py": "from typing import TYPE_CHECKING\n\nif TYPE_CHECKING:\n    from pkg.extra import extra\n\n"
    "if __name__ == '__main__':\n    from pkg.shared import value\n    print(value)\n",
    "pkg/io/__init__.py": "from pkg.io.reader import read\n",
    "pkg/io/reader.py": "from pkg.io.files import path\n\ndef read():\n    return path\n",
    "pkg/io/files.py": "path = 1\n",
    "pkg/loops.py": "from pkg.kernels import sums\n",
    "pkg/kernels/__init__.py": "native = 1\n",
    "pkg/kernels/lanes.hpp": '// Eight at once.\n#include "array.hpp"\nint lanes = 8;\n',
    "pkg/kernels/array.hpp": "int axes;\n",
    "pkg/io/kernels/sums.cpp": '#include <cmath>\n#include "sums.hpp"\n\nint sum() { return lanes; /* all */ }\n',
    "pkg/io/kernels/sums.hpp": '#pragma once\n#include "kernels/lanes.hpp"\n',
    "pkg/io/kernels/others.cpp": "int other;\n",
}


@pytest.fixture
def tree(tmp_path: Path) -> Path:
    for name, text in FILES.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    return tmp_path


def changed_by(tree: Path, file: str, old: str, new: str) -> set[str]:
    """Which of the modules one, two, lazy, names and loops have another digest after the replacement."""
    modules = ["pkg.one", "pkg.two", "pkg.lazy", "pkg.names", "pkg.loops"]
    before = {module: code_digest(module, root=tree) for module in modules}
    text = (tree / file).read_text()
    assert old in text
    # digests are remembered by path: compare with a second tree
    other = tree.parent / f"{tree.name}-changed"
    for name in FILES:
        (other / name).parent.mkdir(parents=True, exist_ok=True)
        (other / name).write_text(text.replace(old, new) if name == file else (tree / name).read_text())
    return {module.removeprefix("pkg.") for module in modules if code_digest(module, root=other) != before[module]}


def test_imports_are_followed(tree: Path) -> None:
    assert imported_modules("pkg.one", root=tree) == {"pkg.one", "pkg.shared", "pkg.io.reader", "pkg.io.files"}
    assert imported_modules("pkg.two", root=tree) == {"pkg.two", "pkg.shared", "pkg.io.files"}
    assert imported_modules("pkg.lazy", root=tree) == {"pkg.lazy", "pkg.extra"}
    deep = {"pkg.deep", "pkg.extra", "pkg.shared", "pkg.io.reader", "pkg.io.files"}
    assert imported_modules("pkg.deep", root=tree) == deep
    assert imported_modules("pkg.command", root=tree) == {"pkg.command"}
    assert imported_modules("pkg.names", "pkg.lazy", root=tree) > imported_modules("pkg.lazy", root=tree)
    assert imported_modules("pkg.names", root=tree) == {"pkg.names", "pkg.io", "pkg.io.reader", "pkg.io.files"}


@pytest.mark.parametrize(
    ("file", "old", "new", "changed"),
    [
        ("pkg/one.py", "2 * x", "3 * x", {"one"}),
        ("pkg/one.py", "# doubled", "# two times", set()),
        ("pkg/one.py", "Number ", "Count ", set()),
        ("pkg/one.py", "--n", "--m", {"one"}),
        ("pkg/one.py", "Twice.", "Two times.", set()),
        ("pkg/one.py", '"""One."""', '"""The first."""', set()),
        ("pkg/one.py", "2 * x", "(\n        2 * x\n    )", set()),
        ("pkg/shared.py", "value = 1", "value = 2", {"one", "two"}),
        ("pkg/shared.py", "value = 1", "value = 1  # one", set()),
        ("pkg/io/files.py", "path = 1", "path = 2", {"one", "two", "names"}),
        ("pkg/io/__init__.py", "\n", "\nx = 1\n", {"names"}),
        ("pkg/extra.py", "extra = 1", "extra = 2", {"lazy"}),
        ("pkg/__init__.py", "extra", "shared", set()),
        ("pkg/io/kernels/sums.cpp", "return lanes", "return 2 * lanes", {"loops"}),
        ("pkg/io/kernels/sums.cpp", "/* all */ ", "", set()),
        ("pkg/io/kernels/sums.cpp", " }", "\n}", set()),
        ("pkg/io/kernels/sums.hpp", "lanes.hpp", 'lanes.hpp"\n#define SUMS "', {"loops"}),
        ("pkg/kernels/lanes.hpp", "8", "4", {"loops"}),
        ("pkg/kernels/array.hpp", "int", "long", {"loops"}),
        ("pkg/kernels/lanes.hpp", "Eight at once.", "Side by side.", set()),
        ("pkg/io/kernels/others.cpp", "other", "another", set()),
    ],
)
def test_what_changes_a_digest(tree: Path, file: str, old: str, new: str, changed: set[str]) -> None:
    assert changed_by(tree, file, old, new) == changed


def test_every_version_of_python_gives_the_same(tree: Path) -> None:
    """Another environment would make everything again."""
    assert [code_digest(f"pkg.{name}", root=tree) for name in ("one", "deep")] == [
        "30ce924585184b43",
        "8b1590d2ae63072d",
    ]


def test_a_light_field_is_read_again_for_its_own_reader_alone() -> None:
    """A word in another format's reader must not cost all maps."""
    readers = {known.reader.__name__ for known in FORMATS.values()} - {FORMATS["sepi"].reader.__name__}
    for reader in (*readers, "sepi.scenes"):
        found = imported_modules(*ingest_modules(reader))
        assert {reader, "sepi.io.hdf5", "sepi.inspection.disparity_range"} <= found
    assert not imported_modules(*ingest_modules("sepi.io.readers.numpy_files")) & (
        readers - {"sepi.io.readers.numpy_files"}
    )
    assert not any(name.startswith("sepi.scenes") for name in imported_modules("sepi.ingest"))


def test_a_module_that_does_not_exist_is_an_error(tree: Path) -> None:
    with pytest.raises(ModuleNotFoundError, match=r"pkg\.three"):
        code_digest("pkg.three", root=tree)


# modules that can change the maps of a stage, and modules that cannot
COVERED = {
    "initial": (
        {"kernels.plane_sweep", "kernels.visibility", "matching.structure_tensor", "image.noise"},
        {"boundaries.decision", "image.edges", "regularization.planes", "matching.gauss_newton"},
    ),
    "occlusion": (
        {
            "kernels.plane_sweep",
            "matching.kernels.sweep_arrays.hpp",
            "matching.visibility_sweep",
            "kernels.colour_mixture",
            "image.edges",
        },
        {"matching.structure_tensor", "image.superpixels", "regularization.planes", "matching.gauss_newton"},
    ),
    "textureless": (
        {"image.superpixels", "regularization.planes", "regularization.uniform_regions", "matching.gauss_newton"},
        {"matching.plane_sweep", "kernels.plane_sweep", "matching.semi_global", "boundaries.decision"},
    ),
    "optimize": (
        {
            "regularization.wls",
            "regularization.second_order",
            "kernels.gauss_newton",
            "kernels.lanes.hpp",
            "lightfield",
        },
        {"matching.plane_sweep", "regularization.planes", "image.superpixels", "image.edges"},
    ),
}
NEVER = {
    "pipeline",
    "variants",
    "process.command",
    "evaluate",
    "reading",
    "workflow.config",
    "workflow.datasets",
    "cli.main",
    "scenes",
}
NEVER |= {
    "extensions",
    "io.readers.arrays",
    "io.readers.formats",
    "inspection.disparity_range",
    "report.numbers",
}


@pytest.mark.parametrize("stage", COVERED)
def test_a_stage_is_run_again_for_what_can_change_its_maps_alone(stage: str) -> None:
    """One module too few, and results are stale; one too many, and a day of computing is done twice."""
    assert list(COVERED) == list(STAGES)
    choice = next(iter(STAGES[stage].values()))
    found = {name.removeprefix("sepi.") for name in imported_modules(*stage_modules(stage, choice))}
    needed, needless = COVERED[stage]
    assert needed | {stage, "matching.exposure", "io.hdf5", "lightfield"} <= found
    assert not found & (needless | NEVER | (set(STAGES) - {stage}))
    assert not any(name.startswith("extensions") for name in found)


@pytest.mark.parametrize("method", compared_methods())
def test_a_compared_method_is_run_again_for_its_own_code_alone(method: str) -> None:
    """A change in one of them must not cost a day of computing all the others, nor be missed."""
    found = imported_modules(*stage_modules("initial", STAGES["initial"][method]))
    compared = {
        name.removeprefix("sepi.extensions.methods.") for name in found if name.startswith("sepi.extensions.methods.")
    }
    assert method in compared
    assert not compared & (set(compared_methods()) - {method})


@pytest.fixture
def as_at_a_start(monkeypatch: pytest.MonkeyPatch) -> Callable[[], list[str]]:
    """Forget what was read, as a new process has; gives what is read from then on, by its text."""

    def start() -> list[str]:
        found: list[str] = []
        for cached in (module.code_digest, module._code_and_imports, module._file_of):
            cached.cache_clear()
        monkeypatch.setattr(module, "_before", {})
        monkeypatch.setattr(module, "_read", {})
        monkeypatch.setattr(module, "_python_code", lambda source: found.append(source.decode()) or reading(source))
        return found

    reading = module._python_code
    return start


def test_a_start_that_reads_less_forgets_only_what_is_gone(
    tree: Path, tmp_path: Path, as_at_a_start: Callable[[], list[str]]
) -> None:
    """Else the next full start reads all anew, or the file grows with each version of the code."""
    shared, kept = tree / "pkg/shared.py", tmp_path / "sepi_code.json"
    for text, *modules in [("value = 3\n", "pkg.one", "pkg.two"), ("value = 4\n", "pkg.shared")]:
        shared.write_text(text)
        as_at_a_start()
        remember(tmp_path)
        code_digest(*modules, root=tree)
        keep(tmp_path)
    number = len(json.loads(kept.read_text()))
    read = as_at_a_start()
    remember(tmp_path)
    assert len(imported_modules("pkg.one", "pkg.two", root=tree)) == number
    assert read == []
    (tree / "pkg/two.py").unlink()
    as_at_a_start()
    remember(tmp_path)
    code_digest("pkg.shared", root=tree)
    keep(tmp_path)
    assert len(json.loads(kept.read_text())) == number - 1


def test_a_start_reads_what_changed_since_the_one_before(
    tree: Path, tmp_path: Path, as_at_a_start: Callable[[], list[str]], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Stale digests would leave stale maps; a file that somebody damaged must stop nobody."""
    (tmp_path / "kept").mkdir()
    as_at_a_start()
    before = code_digest("pkg.one", root=tree)
    keep(tmp_path / "kept")
    # an older time, and the same size
    shared = tree / "pkg/shared.py"
    shared.write_text("value = 3\n")
    os.utime(shared, (0, 0))
    read = as_at_a_start()
    remember(tmp_path / "kept")
    changed = code_digest("pkg.one", root=tree)
    assert (changed != before, read) == (True, ["value = 3\n"])
    # a name that becomes a module of its own is one, though the source that imports it is the same
    (tree / "pkg/shared").mkdir()
    (tree / "pkg/shared/value.py").write_text("x = 1\n")
    (tree / "pkg/shared/__init__.py").write_text("")
    shared.unlink()
    as_at_a_start()
    remember(tmp_path / "kept")
    assert "pkg.shared.value" in imported_modules("pkg.two", root=tree)
    kept = tmp_path / "kept/sepi_code.json"
    monkeypatch.setattr(module, "_OWN", b"another version")
    for unusable in (kept.read_text(), "[]", "{", "[1]"):
        kept.write_text(unusable)
        read = as_at_a_start()
        remember(tmp_path / "kept")
        code_digest("pkg.one", root=tree)
        assert len(read) == 4
    keep(tmp_path / "nowhere")
    assert not (tmp_path / "nowhere").exists()
