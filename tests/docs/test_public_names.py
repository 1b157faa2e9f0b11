"""The public names: what the reference says of them agrees with the code, and its examples run."""

import dataclasses
import doctest
import importlib
import inspect
import io
import re
from collections.abc import Iterator
from pathlib import Path
from types import FunctionType

import cv2
import pytest
from markdown_links import REPOSITORY
from numpydoc.docscrape import get_doc_object
from numpydoc.validate import validate
from test_gallery import unimported

import sepi
import sepi.stage
from sepi import kernels
from sepi.variants import STAGES

LIST = REPOSITORY / "docs" / "reference" / "api_names.txt"
NAMES = [line for line in map(str.strip, LIST.read_text(encoding="utf-8").splitlines()) if line and line[0] != "#"]
# no docstring; parameters not described, unknown, in another order; results not described; no example
FAULTS = {"GL08", "PR01", "PR02", "PR03", "RT01", "YD01"}
STAGE_FUNCTIONS = [choice.function for stage in STAGES.values() for choice in map(stage.__getitem__, stage)]
# of constants, too, in the docstrings of their modules
MODULES = [
    ".".join(path.relative_to(REPOSITORY).with_suffix("").parts).removesuffix(".__init__")
    for path in sorted((REPOSITORY / "sepi").rglob("*.py"))
    if ">>> " in path.read_text(encoding="utf-8")
]


def found(dotted: str) -> object:
    module, _, name = dotted.rpartition(".")
    return getattr(importlib.import_module(module), name)


@pytest.mark.parametrize("dotted", [name for name in NAMES if isinstance(found(name), FunctionType | type)])
def test_the_reference_says_what_there_is(dotted: str) -> None:
    """It names an argument or a field that there is not, or keeps quiet about one, or about what comes back."""
    documented = found(dotted)
    faults, fields, methods = FAULTS | {"EX01"}, None, []
    if isinstance(documented, type):
        methods = [name for name, value in vars(documented).items() if inspect.isfunction(value) and name[0] != "_"]
    if dataclasses.is_dataclass(documented):
        fields = [one.name for one in dataclasses.fields(documented)]
    elif hasattr(documented, "_fields"):
        fields = list(documented._fields)
    if fields is not None:
        said = get_doc_object(documented)["Attributes"]
        assert [name for one in said for name in one.name.split(", ")] == fields
    # what every stage function is given stands in one place
    if fields is not None or documented in (sepi.stage.Parameters, *STAGE_FUNCTIONS):
        faults.discard("PR01")
    assert not [error for error in validate(dotted)["errors"] if error[0] in faults]
    for name in methods:
        assert not [error for error in validate(f"{dotted}.{name}")["errors"] if error[0] in FAULTS], name


@pytest.fixture
def own_folder(here: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """A folder for what an example writes; threads and choices of the stages as they were before."""
    for stage, choices in STAGES.items():
        monkeypatch.setitem(STAGES, stage, dict(choices))
    threads = cv2.getNumThreads(), kernels.thread_count()
    yield
    cv2.setNumThreads(threads[0])
    kernels.set_thread_count(threads[1])


@pytest.mark.usefixtures("own_folder")
@pytest.mark.parametrize("module", MODULES)
def test_examples_run(module: str) -> None:
    """A user who pastes an example gets something else than the reference shows. Warnings are errors here, too."""
    tests = doctest.DocTestFinder(exclude_empty=True).find(importlib.import_module(module), module, globs={})
    assert any(test.examples for test in tests)
    for test in tests:
        source = "".join(example.source for example in test.examples)
        assert not re.search(r"#\s*doctest: *\+SKIP", source)
        # what an example before it has imported is not there for who pastes it
        assert unimported(source) == set(), test.name
        told = io.StringIO()
        test.globs = {"__name__": "__main__"}
        assert doctest.DocTestRunner(verbose=False).run(test, out=told.write).failed == 0, told.getvalue()
