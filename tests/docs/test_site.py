"""The documentation: its links, its pages, its drawings, and the site that is made of it."""

import os
import re
import shutil
import subprocess
import sys
from functools import partial
from pathlib import Path
from xml.etree import ElementTree

import pytest
from markdown_links import DOCS, FILES, MADE, REPOSITORY, broken_links

sys.path.insert(0, str(DOCS))

import make_pictures
import pictures.failures
import pictures.stages
from pictures.style import INKS, write_drawing

from sepi.scenes import render

SMALL = 64


@pytest.mark.parametrize("file", FILES)
def test_links_resolve(file: str) -> None:
    """A reader of a checkout, or on a forge, who follows a link finds no such page or heading."""
    assert broken_links(FILES[file], MADE) == []


def test_named_pages_exist() -> None:
    """A message, comment or docstring sends the reader to docs/NAME.md, which is gone; one page is generated."""
    gone = []
    for path in [
        *REPOSITORY.glob("*"),
        *(p for name in ("sepi", "bench", "rules", "profiles") for p in (REPOSITORY / name).rglob("*")),
    ]:
        if path.suffix in (".py", ".md", ".smk", ".yaml", ".toml") or path.name in ("Snakefile", "Makefile"):
            for name in re.findall(r"docs/[\w/]+\.md", path.read_text(encoding="utf-8")):
                if name != "docs/reference/api.md" and not (REPOSITORY / name).exists():
                    gone.append(f"{path.relative_to(REPOSITORY)}: {name}")
    assert gone == []


@pytest.mark.slow
@pytest.mark.parametrize("name", make_pictures.drawings(SMALL))
def test_drawing(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """`make docs` ends at this drawing."""
    for module in (pictures.failures, pictures.stages):
        monkeypatch.setattr(module, "render", partial(render, views=3))
    write_drawing(tmp_path, name, make_pictures.drawings(SMALL)[name]())
    drawings = [ElementTree.parse(tmp_path / f"{name}-{ink.name}.svg").getroot() for ink in INKS]
    assert all(len(drawing.findall(".//{http://www.w3.org/2000/svg}path")) > 3 for drawing in drawings)
    # the page does not jump when it goes dark
    assert len({(drawing.get("width"), drawing.get("height")) for drawing in drawings}) == 1


@pytest.mark.slow
def test_site(tmp_path: Path) -> None:
    """`make docs` fails: a warning of Sphinx, a reference that leads nowhere, a generated page that is not made.

    All but the pictures and the run of the gallery, which take minutes; drawings are stood in for by empty ones.
    """
    tree = tmp_path / "tree"
    ignored = shutil.ignore_patterns("_made", "examples", "api", "api.md", "__pycache__")
    shutil.copytree(DOCS, tree / "docs", ignore=ignored)
    for name in ("README.md", "CONTRIBUTING.md", "CHANGELOG.md", "config.yaml"):
        shutil.copy(REPOSITORY / name, tree)
    made = tree / "docs" / "_made"
    made.mkdir()
    for name in make_pictures.drawings(SMALL):
        for ink in INKS:
            (made / f"{name}-{ink.name}.svg").write_text(
                '<svg xmlns="http://www.w3.org/2000/svg" width="9" height="9"/>'
            )
    (made / "said-of-order.txt").write_text("as-given\n")
    said = {
        "index": "sepi",
        "reference/api/sepi.estimate_depth": 'id="sepi.estimate_depth"',
        "reference/configuration": "num_disparities",
        "reference/command_line": "--disparity-range",
        # a link to a file outside docs/ leads to the page that shows it
        "develop/architecture": 'href="contributing.html"',
    }
    command = [sys.executable, str(Path(__file__).with_name("quick_site.py")), *said]
    paths = {"PYTHONPATH": str(REPOSITORY)}
    done = subprocess.run(command, cwd=tree, env=os.environ | paths, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    for page, words_of_it in said.items():
        assert words_of_it in (tree / "site" / f"{page}.html").read_text(encoding="utf-8"), page
