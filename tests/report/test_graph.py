"""The rule graph: what Snakemake prints is read, nothing that needs something else is lost, every edge is drawn."""

import json
import re
import shutil
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from hypothesis import given, settings
from hypothesis import strategies as st

from sepi.errors import SepiError
from sepi.report import graph
from sepi.report.graph import Edges, drawn, layers, parsed, reduced, rule_edges

REPOSITORY = Path(__file__).parents[2]
SVG = "{http://www.w3.org/2000/svg}"
DIAMOND = [("a", "b"), ("a", "c"), ("b", "d"), ("c", "d"), ("a", "d")]


@st.composite
def graphs(draw: st.DrawFn) -> list[tuple[str, str]]:
    """Edges without a cycle: from letters to later ones."""
    pairs = st.tuples(st.integers(0, 7), st.integers(0, 7)).filter(lambda pair: pair[0] < pair[1])
    found = draw(st.lists(pairs, min_size=1, max_size=14, unique=True))
    return sorted(("hgfedcba"[one], "hgfedcba"[other]) for one, other in found)


def reachable(edges: Edges) -> set[tuple[str, str]]:
    """Every pair of which one needs the other, however indirectly."""
    found = set(edges)
    while True:
        more = {(one, last) for one, middle in found for first, last in found if middle == first} - found
        if not more:
            return found
        found |= more


def test_what_snakemake_prints_is_read() -> None:
    text = """---
title: Rulegraph
---
flowchart TB
    id0[all]
    id1[page]
    id10[numbers]
    style id0 fill:#D9575D,stroke-width:2px,color:#333333
    id1 --> id0
    id10 --> id1
"""
    assert parsed(text) == [("numbers", "page"), ("page", "all")]
    assert parsed("no graph here") == []


def test_what_a_longer_way_implies_is_left_out() -> None:
    assert reduced(DIAMOND) == [pair for pair in DIAMOND if pair != ("a", "d")]
    chain = [("a", "b"), ("b", "c"), ("c", "d"), ("a", "c"), ("a", "d"), ("b", "d")]
    assert reduced(chain) == [("a", "b"), ("b", "c"), ("c", "d")]


@settings(max_examples=60, deadline=None)
@given(graphs())
def test_no_need_is_lost_or_added(edges: list[tuple[str, str]]) -> None:
    """Who needs whom stays the same, with as few edges as possible."""
    kept = reduced(edges)
    assert set(kept) <= set(edges)
    assert reachable(kept) == reachable(edges)
    for edge in kept:
        assert edge not in reachable([other for other in kept if other != edge])


@settings(max_examples=60, deadline=None)
@given(graphs())
def test_every_rule_stands_below_what_it_needs(edges: list[tuple[str, str]]) -> None:
    """And every edge goes down row by row, without a gap."""
    rows, ways = layers(edges)
    row_of = {name: number for number, row in enumerate(rows) for name in row}
    assert len(row_of) == sum(map(len, rows)), "a place is taken twice"
    assert {name for name in row_of if ">" not in name} == {name for pair in edges for name in pair}
    assert [(way[0], way[-1]) for way in ways] == edges
    for way in ways:
        assert [row_of[name] for name in way] == list(range(row_of[way[0]], row_of[way[-1]] + 1))


@settings(max_examples=30, deadline=None)
@given(graphs())
def test_every_rule_and_every_edge_is_drawn(edges: list[tuple[str, str]]) -> None:
    """Boxes do not overlap, edges begin and end at their boxes, all lies in the picture."""
    picture = svg_of(edges)
    width, height = (float(picture.get(name, "nan")) for name in ("width", "height"))
    boxes = {}
    for group in picture.iter("g"):
        rect, text = group.find("rect"), group.find("text")
        assert rect is not None
        assert text is not None
        boxes[text.text or ""] = np.array([float(rect.get(name, "nan")) for name in ("x", "y", "width", "height")])
    assert set(boxes) == {name for pair in edges for name in pair}
    for name, (x, y, w, h) in boxes.items():
        assert min(x, y) >= 0
        assert (x + w <= width, y + h <= height) == (True, True)
        for other, (x2, y2, w2, h2) in boxes.items():
            assert name == other or abs(x - x2) >= min(w, w2) or abs(y - y2) >= min(h, h2), (name, other)
    ends = []
    for path in picture.iter("path"):
        numbers = [float(number) for number in re.findall(r"-?\d+\.\d", path.get("d", ""))]
        ends.append((numbers[:2], numbers[-2:]))
    expected = []
    for maker, user in reduced(edges):
        (x, y, w, h), (x2, y2, w2, _) = boxes[maker], boxes[user]
        expected.append(([x + w / 2, y + h], [x2 + w2 / 2, y2]))
    np.testing.assert_allclose(np.array(ends), np.array(expected), atol=0.11)


def svg_of(edges: Edges) -> ElementTree.Element:
    return ElementTree.fromstring(drawn(edges))


def test_the_picture_says_in_words_what_it_shows() -> None:
    title = svg_of(DIAMOND).find("title")
    assert title is not None
    assert "b needs a" in (title.text or "")
    assert svg_of(DIAMOND).get("role") == "img"


def test_names_are_no_markup() -> None:
    """A rule's name comes from a workflow that a user may extend."""
    picture = svg_of([("<b&\"'", "x")])
    assert [text.text for text in picture.iter("text")] == ["<b&\"'", "x"]


@pytest.mark.workflow
def test_the_workflows_own_graph(tmp_path: Path) -> None:
    """Snakemake itself is asked; the four stages follow each other, and all end in the page."""
    before = set(REPOSITORY.iterdir())
    edges = rule_edges(REPOSITORY / "Snakefile", {})
    needs = reachable(edges)
    stages = ["ingest", "initial", "occlusion", "textureless", "optimize", "evaluate", "numbers", "page", "all"]
    for number, stage in enumerate(stages[:-1]):
        assert (stage, stages[number + 1]) in needs, stage
    assert ("maps", "page") in needs
    assert not any("external" in pair for pair in edges)
    assert set(REPOSITORY.iterdir()) == before, "the folder that is worked in must stay as it is"
    svg_of(edges)


@pytest.mark.workflow
def test_without_a_graph_the_page_says_so_and_still_comes(tmp_path: Path) -> None:
    """A version of Snakemake that draws otherwise must not cost the whole report."""
    snakefile = tmp_path / "Snakefile"
    snakefile.write_text("rule all:\n    input: nonsense\n")
    with pytest.raises(SepiError, match=r"(?s)Snakefile: snakemake --rulegraph gave no graph: .*nonsense"):
        rule_edges(snakefile, {})
    output = tmp_path / "graph.svg"
    result = CliRunner().invoke(graph.command, ["--snakefile", str(snakefile), "--output", str(output)])
    assert result.exit_code == 0
    assert result.stderr.startswith("sepi: warning: ")
    assert len(result.stderr.strip().splitlines()) == 1
    assert "no rule graph" in output.read_text()


@pytest.mark.workflow
def test_the_users_own_configuration_does_not_reach_the_graph(tmp_path: Path) -> None:
    """An edited config.yaml beside the Snakefile: its relative paths and its scenes mean nothing to the graph."""
    tree = tmp_path / "tree"
    for name in ("rules", "profiles"):
        shutil.copytree(REPOSITORY / name, tree / name)
    shutil.copy2(REPOSITORY / "Snakefile", tree)
    edited = {"hci_root": "scenes/here", "report": {"pixels": {"builtin/wall": [[1, 2]]}}}
    (tree / "config.yaml").write_text(json.dumps(edited))
    assert ("numbers", "page") in rule_edges(tree / "Snakefile", {})
