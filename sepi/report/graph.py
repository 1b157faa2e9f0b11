"""The workflow's own rule graph, as Snakemake tells it, drawn as SVG for the page.

The graph is that of one built-in scene: rules, not jobs, are drawn, and every scene takes the same ones.
"""

from __future__ import annotations

import html
import json
import os
import re
import subprocess
import sys
import tempfile
import warnings
from collections.abc import Mapping, Sequence
from itertools import pairwise
from pathlib import Path

import click

from sepi.command import SepiCommand
from sepi.errors import SepiError, SepiWarning
from sepi.io.files import atomic_path
from sepi.workflow.config import GRAPH_CONFIG

Edges = Sequence[tuple[str, str]]
"""Pairs of rules: the one that makes something, and the one that needs it."""

_WIDTH, _HEIGHT, _ACROSS, _DOWN, _PASSING = 118, 32, 22, 30, 30


def rule_edges(snakefile: Path, config: Mapping[str, object]) -> list[tuple[str, str]]:
    """Edges between the rules that ``snakemake all`` runs.

    Parameters
    ----------
    snakefile : Path
    config : mapping
        Values of the configuration that change which rules run.

    Raises
    ------
    SepiError
        If Snakemake does not say.
    """
    small = {**config, "builtin": {"scenes": ["dots"]}}
    # in a folder of its own: the one that is worked in is locked
    with tempfile.TemporaryDirectory() as folder:
        words = ["--snakefile", str(snakefile.resolve()), "--rulegraph", "mermaid-js"]
        run = subprocess.run(
            [sys.executable, "-m", "snakemake", *words, "--", "all"],
            cwd=folder,
            # in place of a configuration that is not known here, whose relative paths would mean nothing
            env=os.environ | {GRAPH_CONFIG: json.dumps(small)},
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


def reduced(edges: Edges) -> list[tuple[str, str]]:
    """The edges without those that a longer way implies."""
    users: dict[str, set[str]] = {}
    for maker, user in edges:
        users.setdefault(maker, set()).add(user)

    def reached(start: str) -> set[str]:
        found: set[str] = set()
        waiting = [start]
        while waiting:
            for user in users.get(waiting.pop(), ()):
                if user not in found:
                    found.add(user)
                    waiting.append(user)
        return found

    return [
        (maker, user)
        for maker, user in edges
        if not any(user in reached(other) for other in users[maker] if other != user)
    ]


def layers(edges: Edges) -> tuple[list[list[str]], list[list[str]]]:
    """Places for the rules: each below all that it needs, near them.

    Returns
    -------
    rows : list of list of str
        Rules by the length of the longest way that leads to them. An edge that passes a row has a place in it, too,
        named ``MAKER>USER>ROW``.
    ways : list of list of str
        For each edge the places that it goes through.
    """
    makers: dict[str, list[str]] = {name: [] for pair in edges for name in pair}
    for maker, user in edges:
        makers[user].append(maker)
    level: dict[str, int] = {}

    def level_of(name: str) -> int:
        if name not in level:
            level[name] = 1 + max((level_of(maker) for maker in makers[name]), default=-1)
        return level[name]

    rows: list[list[str]] = [[] for _ in range(max(map(level_of, makers)) + 1)]
    for name in sorted(makers):
        rows[level[name]].append(name)
    above: dict[str, list[str]] = {name: [] for name in makers}
    ways = []
    for maker, user in edges:
        between = range(level[maker] + 1, level[user])
        passed = [f"{maker}>{user}>{number}" for number in between]
        for name, number in zip(passed, between, strict=True):
            rows[number].append(name)
        way = [maker, *passed, user]
        for upper, lower in pairwise(way):
            above.setdefault(lower, []).append(upper)
        ways.append(way)
    place: dict[str, float] = {}
    for row in rows:
        known = {name: [place[upper] for upper in above[name]] for name in row}
        row.sort(key=lambda name: (sum(known[name]) / len(known[name]) if known[name] else 0.0, name))
        place |= {name: (number + 0.5) / len(row) for number, name in enumerate(row)}
    return rows, ways


def _placed(rows: list[list[str]]) -> tuple[dict[str, tuple[float, float]], float]:
    """Middle of every place, and the width of them all; an edge that passes takes less room than a rule."""
    room = {name: _PASSING if ">" in name else _WIDTH + _ACROSS for row in rows for name in row}
    width = max(sum(room[name] for name in row) for row in rows)
    middle = {}
    for level, row in enumerate(rows):
        x = (width - sum(room[name] for name in row)) / 2
        for name in row:
            middle[name] = (x + room[name] / 2, _DOWN + level * (_HEIGHT + _DOWN) + _HEIGHT / 2)
            x += room[name]
    return middle, width


def _curve(way: list[str], middle: dict[str, tuple[float, float]]) -> str:
    """Path of an edge from below its first place to above its last, straight down past the rows between."""
    x, y = middle[way[0]]
    path = f"M{x:.1f},{y + _HEIGHT / 2:.1f}"
    y += _HEIGHT / 2
    for name in way[1:]:
        to_x, to_y = middle[name]
        half = (y + to_y - _HEIGHT / 2) / 2
        path += f" C{x:.1f},{half:.1f} {to_x:.1f},{half:.1f} {to_x:.1f},{to_y - _HEIGHT / 2:.1f}"
        if name != way[-1]:
            path += f" V{to_y + _HEIGHT / 2:.1f}"
        x, y = to_x, to_y + _HEIGHT / 2
    return f'<path d="{path}"/>'


def drawn(edges: Edges) -> str:
    """SVG of a rule graph, top to bottom, in the colours of the page."""
    edges = reduced(edges)
    rows, ways = layers(edges)
    middle, width = _placed(rows)
    height = len(rows) * (_HEIGHT + _DOWN) + _DOWN
    lines = [_curve(way, middle) for way in ways]
    boxes = [
        f'<g><rect x="{x - _WIDTH / 2:.1f}" y="{y - _HEIGHT / 2:.1f}" width="{_WIDTH}" height="{_HEIGHT}" rx="6"/>'
        f'<text x="{x:.1f}" y="{y + 4:.1f}">{html.escape(name)}</text></g>'
        for name, (x, y) in middle.items()
        if ">" not in name
    ]
    words = "; ".join(f"{user} needs {maker}" for maker, user in edges)
    return (
        f'<svg class="graph" role="img" viewBox="0 0 {width} {height}" width="{width}" height="{height}">'
        f"<title>Rules of the workflow: {html.escape(words)}</title>{''.join(lines)}{''.join(boxes)}</svg>\n"
    )


@click.command(name="python -m sepi.report.graph", cls=SepiCommand)
@click.option("--snakefile", type=click.Path(path_type=Path), required=True, help="The workflow.")
@click.option("--config", default="{}", show_default=True, help="JSON: values of the configuration.")
@click.option("--output", type=click.Path(path_type=Path), required=True, help="SVG file to write.")
def command(snakefile: Path, config: str, output: Path) -> None:
    """Draw the rules that 'snakemake all' runs."""
    try:
        picture = drawn(rule_edges(snakefile, json.loads(config)))
    except SepiError as error:
        # the page is worth more than its graph
        warnings.warn(str(error), SepiWarning, stacklevel=1)
        picture = '<p class="soft">Snakemake gave no rule graph; logs/graph.log says why.</p>\n'
    with atomic_path(output) as temporary:
        temporary.write_text(picture, encoding="utf-8")


if __name__ == "__main__":
    command()
