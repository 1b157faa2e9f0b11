"""The public names: what the reference shows of them is complete, agrees with the code, and its examples run."""

from __future__ import annotations

import ast
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
from numpy_docstrings import (
    ROOT,
    docstring,
    fields_of,
    found,
    home,
    is_constant,
    listed_names,
    names_in,
    parameters_of,
    public_members,
    raises_an_error,
    sections,
    unimported,
)

import sepi
from sepi import kernels
from sepi.variants import STAGES

NAMES = listed_names()
CONSTANTS = [name for name in NAMES if is_constant(name)]
FUNCTIONS = [name for name in NAMES if isinstance(found(name), FunctionType)]
CLASSES = [name for name in NAMES if isinstance(found(name), type)]
STAGE_FUNCTIONS = {choice.function for stage in STAGES.values() for choice in map(stage.__getitem__, stage)}
MEMBERS = [f"{name}.{member}" for name in CLASSES for member, _ in public_members(found(name))]

# the module where a constant's examples stand: digests of code count strings below assignments, not modules' docstrings
MODULES = sorted({"sepi", *(home(name)[0].__name__ for name in CONSTANTS)})


def member(dotted: str) -> FunctionType | property:
    name, _, attribute = dotted.rpartition(".")
    return dict(public_members(found(name)))[attribute]


METHODS = [dotted for dotted in MEMBERS if not isinstance(member(dotted), property)]


def text_of(dotted: str) -> str:
    return inspect.getdoc(member(dotted)) or "" if dotted in MEMBERS else docstring(dotted)


def code_of(dotted: str) -> FunctionType:
    """The function that a listed function or method is."""
    code = member(dotted) if dotted in MEMBERS else found(dotted)
    assert isinstance(code, FunctionType)
    return code


def examples_of(dotted: str) -> list[tuple[str, str]]:
    """Name and docstring of all that stands below a name in the reference; of a module its own docstring alone."""
    if dotted in MODULES:
        return [(dotted, inspect.getdoc(importlib.import_module(dotted)) or "")]
    below = [name for name in MEMBERS if name.rpartition(".")[0] == dotted]
    return [(name, text_of(name)) for name in (dotted, *below) if ">>>" in text_of(name)]


def test_the_list_names_everything_that_sepi_exports() -> None:
    """A name that users import from ``sepi`` has no page otherwise."""
    assert {f"sepi.{name}" for name in sepi.__all__} <= set(NAMES)
    assert len(NAMES) == len(set(NAMES))


def test_there_is_a_docstring() -> None:
    """Whoever asks for help gets none otherwise."""
    for dotted in (*NAMES, *MEMBERS):
        summary = sections(text_of(dotted))[""].partition("\n\n")[0]
        assert len(summary) > 10, dotted
        assert summary.endswith((".", ":")), dotted


def test_parameters_and_result_are_described() -> None:
    """The reference names an argument that there is not, keeps quiet about one, or about what comes back.

    What every stage function is given stands in one place.
    """
    for dotted in (*FUNCTIONS, *METHODS):
        said, code = sections(text_of(dotted)), code_of(dotted)
        expected = [] if code in STAGE_FUNCTIONS else parameters_of(code)
        assert names_in(said.get("Parameters", "")) == expected, dotted
        returns = inspect.get_annotations(code)["return"]
        assert ("Returns" in said or "Yields" in said) == (returns not in (None, "None")), dotted


def test_fields_are_described() -> None:
    """The reference keeps quiet about what an object holds, or is made of."""
    for dotted in CLASSES:
        said, cls = sections(docstring(dotted)), found(dotted)
        fields = fields_of(cls)
        heading, expected = ("Parameters", parameters_of(cls)) if fields is None else ("Attributes", fields)
        assert names_in(said.get(heading, "")) == expected, dotted


def test_errors_are_described() -> None:
    """Nobody catches an error that the reference does not tell of."""
    for dotted in (*FUNCTIONS, *METHODS, *CLASSES):
        if dotted in CLASSES:
            # a data class makes its own __init__, and goes on in __post_init__
            made_by = "__init__" if fields_of(found(dotted)) is None else "__post_init__"
            functions = [vars(found(dotted))[made_by]] if made_by in vars(found(dotted)) else []
        else:
            functions = [code_of(dotted)]
        if any(raises_an_error(function) for function in functions if function not in STAGE_FUNCTIONS):
            assert "SepiError" in names_in(sections(text_of(dotted)).get("Raises", "")), dotted


def test_there_is_an_example_of_each() -> None:
    """An example that does not use the name teaches something else; one that is skipped teaches nothing."""
    for dotted in NAMES:
        name = dotted.rpartition(".")[2]
        text = home(dotted)[0].__doc__ or "" if is_constant(dotted) and name != "__version__" else docstring(dotted)
        examples = doctest.DocTestParser().get_examples(sections(text).get("Examples", ""))
        assert any(re.search(rf"\b{name}\b", example.source) for example in examples), dotted
        assert any(example.want for example in examples), dotted
        assert not any(example.options.get(doctest.SKIP) for example in examples), dotted


def test_examples_import_what_they_use() -> None:
    """``sepi.scenes`` is there in an example that runs after another; a user who pastes it gets an AttributeError."""
    for dotted in (*NAMES, *MODULES):
        for name, text in examples_of(dotted):
            source = "".join(example.source for example in doctest.DocTestParser().get_examples(text))
            assert unimported(source) == set(), name


@pytest.fixture
def own_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """A folder for what an example writes; threads and choices of the stages as they were before."""
    monkeypatch.chdir(tmp_path)
    for stage, choices in STAGES.items():
        monkeypatch.setitem(STAGES, stage, dict(choices))
    threads = cv2.getNumThreads(), kernels.thread_count()
    yield
    cv2.setNumThreads(threads[0])
    kernels.set_thread_count(threads[1])


@pytest.mark.usefixtures("own_folder")
@pytest.mark.parametrize("dotted", [dotted for dotted in (*NAMES, *MODULES) if examples_of(dotted)])
def test_examples_run(dotted: str) -> None:
    """A user who pastes an example gets something else than the reference shows. Warnings are errors here, too."""
    for name, text in examples_of(dotted):
        test = doctest.DocTestParser().get_doctest(text, {"__name__": "__main__"}, name, None, 0)
        told = io.StringIO()
        result = doctest.DocTestRunner(verbose=False).run(test, out=told.write)
        assert result.failed == 0, told.getvalue()


def test_no_example_is_left_out() -> None:
    """An example in a docstring that no test runs is wrong sooner or later."""
    run = "\n".join(text for name in (*NAMES, *MODULES) for _, text in examples_of(name))
    kinds = (ast.Module, ast.ClassDef, ast.FunctionDef)
    for file in sorted((ROOT / "sepi").rglob("*.py")):
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            text = ast.get_docstring(node) if isinstance(node, kinds) else None
            if text and ">>>" in text:
                assert text.partition(">>>")[2][:60] in run, file
