"""The workflow's rule graph from Snakemake, drawn as SVG for the page.

One built-in scene is enough: the graph shows rules, not jobs, and all scenes have the same rules.
"""

from __future__ import annotations

import html
import json
import re
import shutil
import subprocess
import sys
import tempfile
import warnings
from collections.abc import Iterable
from pathlib import Path

import click
import networkx as nx

from sepi.errors import SepiError, SepiWarning
from sepi.io.files import atomic_path
from sepi.process.command import SepiCommand

Edges = Iterable[tuple[str, str]]
"""Pairs of rules: the one that makes a file, and the one that needs it."""

# sizes of a rule's box, between boxes, and of the gap through which an edge passes a row
_WIDTH, _HEIGHT, _ACROSS, _DOWN, _PASSING = 118, 32, 22, 30, 30


def rule_edges(snakefile: Path, external: bool = False, rules: Iterable[Path] = ()) -> list[tuple[str, str]]:
    """Edges between the rules that ``snakemake all`` runs, sorted.

    Parameters
    ----------
    snakefile : Path
        The Snakefile, which includes files of a folder ``rules``.
    external : bool
        Whether maps of external methods are configured, which adds a rule.
    rules : iterable of Path
        Paths of these files; default: those in the folder beside the Snakefile.

    Raises
    ------
    SepiError
        If Snakemake fails.
    """
    # a copy is not locked by the running workflow, and its own configuration has no scenes or paths of the user
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder)
        shutil.copy(snakefile, copy / "Snakefile")
        (copy / "rules").mkdir()
        for path in rules or (snakefile.parent / "rules").glob("*.*"):
            # Snakemake may name its copies of remote files NAME@REVISION
            shutil.copy(path, copy / "rules" / path.name.partition("@")[0])
        config = {"builtin": {"scenes": ["dots"]}, "external": {"other": "maps"} if external else {}}
        (copy / "config.yaml").write_text(json.dumps(config))
        run = subprocess.run(
            [sys.executable, "-m", "snakemake", "--rulegraph", "mermaid-js", "--", "all"],
            cwd=copy,
            capture_output=True,
            text=True,
            check=False,
        )
    edges = parsed(run.stdout)
    if run.returncode != 0 or not edges:
        raise SepiError(f"{snakefile}: snakemake --rulegraph gave no graph: {run.stderr.strip()[-500:]}")
    return edges


def parsed(text: str) -> list[tuple[str, str]]:
    """Edges of a graph that Snakemake prints as Mermaid text, sorted."""
    names = dict(re.findall(r"^\s*(id\d+)\[([^\]]+)\]", text, re.MULTILINE))
    pairs = re.findall(r"^\s*(id\d+) --> (id\d+)", text, re.MULTILINE)
    return sorted((names[maker], names[user]) for maker, user in pairs)


def drawn(edges: Edges) -> str:
    """SVG of a rule graph, in the colours of the page, with each rule below the rules that it needs.

    Edges that follow from others are left out.
    """
    graph = nx.transitive_reduction(nx.DiGraph(edges))
    words = "; ".join(f"{user} needs {maker}" for maker, user in sorted(graph.edges))
    rows = _rows(graph)
    middle = _middles(graph, rows)
    width = max(sum(map(_room, row)) for row in rows)
    height = len(rows) * (_HEIGHT + _DOWN) + _DOWN
    lines = [_line(middle[upper], middle[lower], isinstance(lower, tuple)) for upper, lower in graph.edges]
    boxes = [
        f'<g><rect x="{x - _WIDTH / 2:.1f}" y="{y - _HEIGHT / 2:.1f}" width="{_WIDTH}" height="{_HEIGHT}" rx="6"/>'
        f'<text x="{x:.1f}" y="{y + 4:.1f}">{html.escape(name)}</text></g>'
        for name, (x, y) in middle.items()
        if isinstance(name, str)
    ]
    size = f'viewBox="{-width / 2:.1f} 0 {width} {height}" width="{width}" height="{height}"'
    return (
        f'<svg class="graph" role="img" {size}>'
        f"<title>Rules of the workflow: {html.escape(words)}</title>{''.join(sorted(lines))}{''.join(boxes)}</svg>\n"
    )


# a rule's name; or the place at which an edge passes a row: maker, user, number of the row
_Place = str | tuple[str, str, int]


def _rows(graph: nx.DiGraph) -> list[list[_Place]]:
    """Rows of rules by their longest path from the start; an edge that passes a row has a place in it."""
    rows: list[list[_Place]] = [sorted(names) for names in nx.topological_generations(graph)]
    row_of = {name: number for number, row in enumerate(rows) for name in row}
    for maker, user in list(graph.edges):
        passed = [(maker, user, number) for number in range(row_of[maker] + 1, row_of[user])]
        if passed:
            graph.remove_edge(maker, user)
            nx.add_path(graph, [maker, *passed, user])
        for place in passed:
            rows[place[2]].append(place)
    return rows


def _middles(graph: nx.DiGraph, rows: list[list[_Place]]) -> dict[_Place, tuple[float, float]]:
    """Middle of every place, near the places that it needs, with all rows centred at 0."""
    middle: dict[_Place, tuple[float, float]] = {}

    def pull(place: _Place) -> tuple[float, str]:
        above = [middle[upper][0] for upper in graph.predecessors(place)]
        return sum(above) / max(1, len(above)), str(place)

    for number, row in enumerate(rows):
        x = -sum(map(_room, row)) / 2
        for place in sorted(row, key=pull):
            middle[place] = (x + _room(place) / 2, _DOWN + number * (_HEIGHT + _DOWN) + _HEIGHT / 2)
            x += _room(place)
    return middle


def _room(place: _Place) -> int:
    return _WIDTH + _ACROSS if isinstance(place, str) else _PASSING


def _line(upper: tuple[float, float], lower: tuple[float, float], passes: bool) -> str:
    """An edge from below one place to above another, or if it passes that row, to below that place."""
    (x, y), (to_x, to_y) = upper, lower
    begin, half, end = y + _HEIGHT / 2, (y + to_y) / 2, to_y - _HEIGHT / 2
    on = f" v{_HEIGHT:.1f}" if passes else ""
    return f'<path d="M{x:.1f},{begin:.1f} C{x:.1f},{half:.1f} {to_x:.1f},{half:.1f} {to_x:.1f},{end:.1f}{on}"/>'


@click.command(name="python -m sepi.report.graph", cls=SepiCommand)
@click.option("--snakefile", type=click.Path(path_type=Path), required=True, help="The workflow.")
@click.option("--external", is_flag=True, help="Maps of external methods are configured.")
@click.option("--output", type=click.Path(path_type=Path), required=True, help="SVG file to write.")
@click.argument("rules", nargs=-1, type=click.Path(path_type=Path))
def command(snakefile: Path, external: bool, output: Path, rules: tuple[Path, ...]) -> None:
    """Draw the rules that 'snakemake all' runs. RULES are the files that the Snakefile includes."""
    try:
        picture = drawn(rule_edges(snakefile, external, rules))
    except SepiError as error:
        # the page is useful without its graph
        warnings.warn(str(error), SepiWarning, stacklevel=1)
        picture = '<p class="soft">Snakemake gave no rule graph; logs/graph.log says why.</p>\n'
    with atomic_path(output) as temporary:
        temporary.write_text(picture, encoding="utf-8")


if __name__ == "__main__":
    command()
