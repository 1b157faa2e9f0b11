"""The digest of a stage's code: too coarse, and a changed comment costs hours; too fine, and results are stale."""

from pathlib import Path

import pytest

from sepi.io.readers.formats import FORMATS
from sepi.variants import STAGES, compared_methods
from sepi.workflow.code_digest import code_digest, imported_modules, stage_modules

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
        ("pkg/one.py", "2 * x", "(\n        2 * x\n    )", set()),
        ("pkg/shared.py", "value = 1", "value = 2", {"one", "two"}),
        ("pkg/io/files.py", "path = 1", "path = 2", {"one", "two", "names"}),
        ("pkg/io/__init__.py", "\n", "\nx = 1\n", {"names"}),
        ("pkg/extra.py", "extra = 1", "extra = 2", {"lazy"}),
        ("pkg/__init__.py", "extra", "shared", set()),
        ("pkg/io/kernels/sums.cpp", "return lanes", "return 2 * lanes", {"loops"}),
        ("pkg/io/kernels/sums.cpp", "/* all */ ", "", set()),
        ("pkg/io/kernels/sums.hpp", "lanes.hpp", 'lanes.hpp"\n#define SUMS "', {"loops"}),
        ("pkg/kernels/lanes.hpp", "8", "4", {"loops"}),
        ("pkg/kernels/array.hpp", "int", "long", {"loops"}),
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
    readers = {known.matches.__module__ for known in FORMATS.values()} - {FORMATS["sepi"].matches.__module__}
    for reader in (*readers, "sepi.scenes.light_field"):
        assert {reader, "sepi.io.hdf5"} <= imported_modules("sepi.ingest", reader)
    arrays = "sepi.io.readers.array_files"
    assert not imported_modules("sepi.ingest", arrays) & (readers - {arrays})
    assert not any(name.startswith("sepi.scenes") for name in imported_modules("sepi.ingest"))


@pytest.mark.parametrize("method", compared_methods())
def test_a_compared_method_is_run_again_for_its_own_code_alone(method: str) -> None:
    """A change in one of them must not cost a day of computing all the others, nor be missed."""
    found = imported_modules(*stage_modules("initial", STAGES["initial"][method]))
    compared = {
        name.removeprefix("sepi.extensions.methods.") for name in found if name.startswith("sepi.extensions.methods.")
    }
    assert method in compared
    assert not compared & (set(compared_methods()) - {method})


def test_a_name_that_becomes_a_module_is_one(tree: Path) -> None:
    """Though the source that imports it is the same."""
    before = code_digest("pkg.two", root=tree)
    # digests are remembered by path
    other = tree.rename(tree.with_name("other"))
    (other / "pkg/shared.py").unlink()
    for name, text in (("__init__", "value = 1\n"), ("value", "x = 1\n")):
        (other / "pkg/shared").mkdir(exist_ok=True)
        (other / f"pkg/shared/{name}.py").write_text(text)
    assert "pkg.shared.value" in imported_modules("pkg.two", root=other)
    assert code_digest("pkg.two", root=other) != before
