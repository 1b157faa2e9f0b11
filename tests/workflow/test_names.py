"""Names that a shell, a template or a page could take for something else: harmless, or refused in one line."""

import csv
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from workflow_copy import SIZE, TINY, Workflow, copy_of_the_project

from sepi.errors import SepiError
from sepi.io.pfm import write_pfm
from sepi.scenes import render, write_hci
from sepi.workflow.config import load_settings

HOSTILE = (
    "a b",
    "it's",
    'say "so"',
    "$(touch hacked)",
    "`touch hacked`",
    "a;touch hacked",
    "a&touch hacked&",
    "a|b",
    "a>hacked",
    "*",
    "?",
    "~",
    "{scene}",
    "{wildcards.scene}",
    "{{a}}",
    "%s",
    "$HOME",
    "\\",
    "<script>hacked()</script>",
    "<img src=x onerror=hacked()>",
    "&amp;",
    "a\nb",
    "a\rb",
    "a\tb",
    "a\0b",
    "\x1b[31m",
    "\u202eabc",
    "\ud800",
    "..",
    ".",
    "",
    "-rf",
    "--help",
    "a/b",
    "/etc/passwd",
    "a" * 300,
)


def settings_with(kind: str, name: str, folder: Path) -> Any:
    """The configuration in which something has this name."""
    views = folder / "views.npy"
    if kind == "scene":
        return load_settings({"builtin": {"scenes": []}, "light_fields": {name: {"path": str(views)}}})
    return load_settings({"variants": {name: {"base": "paper"}}})


@pytest.fixture(scope="module")
def views(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a small light field."""
    folder = tmp_path_factory.mktemp("views")
    np.save(folder / "views.npy", render("dots", size=SIZE, views=3).views)
    return folder


@pytest.mark.parametrize("name", HOSTILE, ids=ascii)
@pytest.mark.parametrize("kind", ["scene", "variant"])
def test_scenes_and_variants_are_named_by_plain_words(views: Path, kind: str, name: str) -> None:
    """They are parts of paths and of commands; nothing but a refusal is to be expected of these."""
    with pytest.raises(SepiError) as refused:
        settings_with(kind, name, views)
    assert str(refused.value).isprintable()


@pytest.mark.parametrize(
    ("kind", "word"), [("light_fields", "<results>"), ("external", "<logs>"), ("light_fields", "{")]
)
def test_paths_that_snakemake_would_change_are_refused(tmp_path: Path, kind: str, word: str) -> None:
    """It would look for other files than those that were named."""
    folder = tmp_path / f"a {word}"
    folder.mkdir()
    np.save(folder / "views.npy", render("dots", size=SIZE, views=3).views)
    entry = {"path": str(folder / "views.npy")} if kind == "light_fields" else str(folder)
    with pytest.raises(SepiError, match=f"Snakemake would replace '{word}' in .*; rename it, or link to it"):
        load_settings({kind: {"mine": entry}})


def accepted(name: str) -> bool:
    """Whether a method may have this name."""
    try:
        return bool(load_settings({"external": {name: "/maps"}}).external)
    except SepiError:
        return False


def test_why_a_method_may_not_have_a_name_is_one_line() -> None:
    refused = [name for name in HOSTILE if not accepted(name)]
    assert "a/b" in refused
    for name in refused:
        with pytest.raises(SepiError) as told:
            load_settings({"external": {name: "/maps"}})
        assert str(told.value).isprintable()


@pytest.mark.workflow
@pytest.mark.slow
def test_methods_may_be_named_by_any_printable_text(tmp_path: Path) -> None:
    """Their names are columns of tables, folders of pictures and words on the page; nothing runs what is in them."""
    # folders of the light fields, of the maps and of the run: whatever the system allows
    inside = tmp_path / 'it\'s $(touch hacked); `id` %s "so" & <B>'
    folder = inside / "scenes" / "box"
    light_field = render("dots", size=SIZE, views=3)
    write_hci(light_field, folder)
    methods = [name for name in HOSTILE if accepted(name)]
    assert len(methods) > len(HOSTILE) / 2
    write_pfm(inside / "maps" / "box.pfm", light_field.ground_truth)
    config = TINY | {
        "builtin": {"scenes": []},
        "hci_root": str(folder.parent),
        "external": {name: {"path": str(inside / "maps")} for name in methods},
    }
    workflow = Workflow(copy_of_the_project(tmp_path / "tree"), inside / "run", config)
    result = workflow.run("all")
    assert result.returncode == 0, result.stdout
    assert not list(tmp_path.rglob("hacked"))
    with (workflow.folder / "reports" / "table1_mse.csv").open(newline="", encoding="utf-8") as table:
        assert set(methods) <= set(next(csv.reader(table)))
    page = (workflow.folder / "reports" / "index.html").read_text(encoding="utf-8")
    assert not re.search("<script>hacked|<img src=x", page)
