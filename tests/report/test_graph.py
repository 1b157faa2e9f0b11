"""The rule graph: what Snakemake prints is read, nothing that needs something else is lost, every edge is drawn."""

import json
import re
import shutil
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import networkx as nx
import numpy as np
import pytest
from click.testing import CliRunner
from hypothesis import given, settings
from hypothesis import strategies as st

from sepi.errors import SepiError
from sepi.report import graph
from sepi.report.graph import Edges, drawn, rule_edges

REPOSITORY = Path(__file__).parents[2]
DIAMOND = [("a", "b"), ("a", "c"), ("b", "d"), ("c", "d"), ("a", "d")]
CHAIN = [("a", "b"), ("b", "c"), ("c", "d"), ("a", "c"), ("a", "d"), ("b", "d")]

Point = tuple[float, float]


@st.composite
def graphs(draw: st.DrawFn) -> list[tuple[str, str]]:
    """Edges without a cycle: from letters to later ones."""
    pairs = st.tuples(st.integers(0, 7), st.integers(0, 7)).filter(lambda pair: pair[0] < pair[1])
    found = draw(st.lists(pairs, min_size=1, max_size=14, unique=True))
    return sorted(("hgfedcba"[one], "hgfedcba"[other]) for one, other in found)


def svg_of(edges: Edges) -> ElementTree.Element:
    return ElementTree.fromstring(drawn(edges))


def boxes_of(picture: ElementTree.Element) -> dict[str, tuple[float, ...]]:
    """Left, top, width and height of each rule's box."""
    found = {}
    for group in picture.iter("g"):
        rect, text = group.find("rect"), group.find("text")
        assert rect is not None
        assert text is not None
        found[text.text or ""] = tuple(float(rect.get(name, "nan")) for name in ("x", "y", "width", "height"))
    return found


def drawn_edges(picture: ElementTree.Element) -> set[tuple[str, str]]:
    """Pairs of rules that lines join: from below the one, through places without a box, to above the other."""
    lines: dict[Point, list[Point]] = {}
    for path in picture.iter("path"):
        numbers = [float(number) for number in re.findall(r"-?\d+\.\d", path.get("d", ""))]
        # the last number is how far a line goes on straight down
        x, y = numbers[6:8]
        lines.setdefault((numbers[0], numbers[1]), []).append((x, round(y + sum(numbers[8:]), 1)))
    boxes = boxes_of(picture)
    tops = {(round(x + w / 2, 1), y): name for name, (x, y, w, _) in boxes.items()}
    found = set()
    for name, (x, y, w, h) in boxes.items():
        waiting = list(lines.get((round(x + w / 2, 1), round(y + h, 1)), ()))
        while waiting:
            point = waiting.pop()
            if point in tops:
                found.add((name, tops[point]))
            else:
                assert lines[point], "a line that ends nowhere"
                waiting += lines[point]
    return found


@pytest.mark.parametrize(("edges", "kept"), [(DIAMOND, DIAMOND[:4]), (CHAIN, CHAIN[:3]), ([("a", "b")], [("a", "b")])])
def test_what_a_longer_way_implies_is_left_out(edges: list[tuple[str, str]], kept: list[tuple[str, str]]) -> None:
    picture = svg_of(edges)
    assert drawn_edges(picture) == set(kept)
    assert picture.get("role") == "img"
    words = picture.findtext("title") or ""
    assert all(f"{user} needs {maker}" in words for maker, user in kept)
    assert words.count(" needs ") == len(kept)


@settings(max_examples=60, deadline=None)
@given(graphs())
def test_every_rule_and_every_edge_is_drawn(edges: list[tuple[str, str]]) -> None:
    """Who needs whom stays the same; each box stands below what it needs, beside the others, and in the picture."""
    picture = svg_of(edges)
    left, top, width, height = map(float, picture.get("viewBox", "").split())
    boxes = boxes_of(picture)
    assert set(boxes) == {name for pair in edges for name in pair}
    kept = drawn_edges(picture)
    assert kept <= set(edges)
    assert nx.transitive_closure(nx.DiGraph(kept)).edges == nx.transitive_closure(nx.DiGraph(edges)).edges
    for name, (x, y, w, h) in boxes.items():
        assert (x >= left, y >= top, x + w <= left + width, y + h <= top + height) == (True,) * 4
        for other, (x2, y2, _, _) in boxes.items():
            assert name == other or abs(x - x2) >= w or abs(y - y2) >= h, (name, other)
    for maker, user in edges:
        assert np.subtract(boxes[user], boxes[maker])[1] > boxes[maker][3]


def test_names_are_no_markup() -> None:
    """A rule's name comes from a workflow that a user may extend."""
    picture = svg_of([("<b&\"'", "x")])
    assert [text.text for text in picture.iter("text")] == ["<b&\"'", "x"]


@pytest.fixture
def edited_copy(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A copy of the workflow with an edited config.yaml beside its Snakefile, in a folder that is worked in."""
    tree = tmp_path / "tree"
    for name in ("rules", "profiles"):
        shutil.copytree(REPOSITORY / name, tree / name)
    shutil.copy2(REPOSITORY / "Snakefile", tree)
    edited = {"hci_root": "scenes/here", "report": {"pixels": {"builtin/wall": [[1, 2]]}}, "external": {"a": "maps"}}
    (tree / "config.yaml").write_text(json.dumps(edited))
    monkeypatch.chdir(tree)
    return tree


@pytest.mark.workflow
@pytest.mark.parametrize("external", [False, True])
def test_the_workflows_own_graph(external: bool, edited_copy: Path) -> None:
    """Snakemake itself is asked; the four stages follow each other, and all end in the page.

    The user's own configuration does not reach the graph: its relative paths and its scenes mean nothing there.
    """
    before = set(edited_copy.rglob("*"))
    edges = rule_edges(edited_copy / "Snakefile", external)
    assert set(edited_copy.rglob("*")) == before, "the folder that is worked in must stay as it is"
    needs = set(nx.transitive_closure(nx.DiGraph(edges)).edges)
    stages = ["ingest", "initial", "occlusion", "textureless", "optimize", "evaluate", "numbers", "page", "all"]
    for number, stage in enumerate(stages[:-1]):
        assert (stage, stages[number + 1]) in needs, stage
    assert ("maps", "page") in needs
    assert (("external", "numbers") in needs) == external
    svg_of(edges)


@pytest.mark.workflow
def test_without_a_graph_the_page_says_so_and_still_comes(tmp_path: Path) -> None:
    """A version of Snakemake that draws otherwise must not cost the whole report."""
    snakefile = tmp_path / "Snakefile"
    snakefile.write_text("rule all:\n    input: nonsense\n")
    (tmp_path / "rules").mkdir()
    with pytest.raises(SepiError, match=r"(?s)Snakefile: snakemake --rulegraph gave no graph: .*nonsense"):
        rule_edges(snakefile)
    output = tmp_path / "graph.svg"
    result = CliRunner().invoke(graph.command, ["--snakefile", str(snakefile), "--output", str(output)])
    assert result.exit_code == 0
    assert result.stderr.startswith("sepi: warning: ")
    assert len(result.stderr.strip().splitlines()) == 1
    assert "no rule graph" in output.read_text()
