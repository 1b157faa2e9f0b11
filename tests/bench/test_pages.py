"""Tables of the pages that stand below a command of the benchmark have the form in which it prints them."""

import re
import shlex
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from click.testing import CliRunner

from bench import __main__ as bench
from bench import cases, noisy, plot, sweep
from bench.measure import Case, Measurement
from bench.scene import Scene
from sepi.lightfield import LightField
from sepi.scenes import render

pytestmark = pytest.mark.slow

DOCS = Path(__file__).parents[2] / "docs"
BELOW_COMMANDS = re.compile(r"((?:    .*\n)*    python -m bench (?:run|noise).*\n(?:    .*\n)*)\n((?:\|.*\n)+)")


def form(tables: str) -> tuple[list[str], list[str]]:
    """Heads, and what the first cells say, of tables that are parts of one."""
    heads, names, at_head = [], [], True
    for line in tables.splitlines():
        if at_head:
            heads += [cell.strip() for cell in line.split("|")[1:-1]]
        elif line.startswith("|") and not re.match(r"\|:?-", line):
            names.append(line.split("|")[1].strip())
        at_head = not line
    return list(dict.fromkeys(heads)), list(dict.fromkeys(names))


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nothing is computed or measured."""
    field = render("dots", size=64, views=3)

    def named(path: str, _noise: str) -> LightField:
        return replace(field, name=Path(path).name)

    def measured(some: list[Case], *_: int) -> tuple[list[Measurement], int]:
        return [Measurement(c.group, c.name, (1,), 1, {**c.figures, "largest_difference": 0}) for c in some], 0

    for owner, name, other in (
        (bench, "available_cores", lambda: 2),
        (bench, "_all_measured", measured),
        (Scene, "write_files", lambda _: field),
        (Scene, "write_grown", lambda *_: None),
        *((cases, name, lambda *_: SimpleNamespace(call=lambda: None)) for name in ("whole", "whole_variant")),
        (plot, "write", lambda *_: None),
        (sweep, "scene_for_choosing", named),
        (noisy, "estimate_depth", lambda *_: SimpleNamespace(disparity=np.zeros(field.shape, np.float32))),
    ):
        monkeypatch.setattr(owner, name, other)


@pytest.mark.parametrize(("page", "tables"), [("develop/performance.md", 3), ("develop/research_log.md", 4)])
def test_pages_show_tables_as_they_are_printed(page: str, tables: int, quick: None, tmp_path: Path) -> None:
    """Who repeats a command could not paste what it prints, and figures of different versions stand side by side."""
    found = BELOW_COMMANDS.findall((DOCS / page).read_text(encoding="utf-8"))
    assert len(found) == tables
    for commands, table in found:
        printed = ""
        for line in commands.replace("\\\n", "").splitlines():
            words = shlex.split(line)[3:]
            if "..." in words:
                words.remove("...")
                words += [word for name in re.findall(r"\| `(\w+)`", table) for word in ("--variant", name)]
            more = ["--output", str(tmp_path)] if words[0] == "run" else []
            done = CliRunner().invoke(bench.main, [*words, *more], catch_exceptions=False)
            assert done.exit_code == 0, done.output
            printed += done.output + "\n"
        sections = (tmp_path / "bench.md").read_text().split("\n## ") if more else [f"\n\n{printed}"]
        assert form(table) in [form(section.partition("\n\n")[2]) for section in sections]
