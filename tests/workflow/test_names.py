"""Names that a shell, a template or a page could take for something else: harmless, or refused in one line."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hostile_names import HOSTILE, accepted
from workflow_copy import SIZE

from sepi.errors import SepiError
from sepi.scenes import render
from sepi.workflow.config import load_settings


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


def test_why_a_method_may_not_have_a_name_is_one_line() -> None:
    refused = [name for name in HOSTILE if not accepted(name)]
    assert "a/b" in refused
    for name in refused:
        with pytest.raises(SepiError) as told:
            load_settings({"external": {name: "/maps"}})
        assert str(told.value).isprintable()
