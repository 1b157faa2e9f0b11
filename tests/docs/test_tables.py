"""Tables of the pages whose scores a command writes."""

import csv
import sys
from pathlib import Path

import pytest
from markdown_links import DOCS, FILES

sys.path.insert(0, str(DOCS))

from make_tables import filled, read_scores

from sepi.scenes import SCENES
from sepi.variants import VARIANTS

HEADS = ["dataset", "scene", "variant", "stage", "choice", "protocol", "region", "mse100", "q25", "badpix007"]


@pytest.fixture
def stages(tmp_path: Path) -> Path:
    """Scores of all variants on all scenes, as a run's table has them: the stage before the last is worse."""
    with (file := tmp_path / "stages.csv").open("w", encoding="utf-8", newline="") as opened:
        table = csv.writer(opened)
        table.writerow(HEADS)
        for scene in ("cotton", "antinous", *SCENES):
            for variant in VARIANTS:
                for stage, score in (("textureless", 9), ("optimize", 1)):
                    table.writerow(["", scene, variant, stage, "", "paper", "all", score, score, score])
                    table.writerow(["", scene, variant, stage, "", "benchmark", "all", 5, 5, 5])
    return file


def test_scores_are_filled_in(stages: Path) -> None:
    """What somebody else's table holds is overwritten, or what a run found is not shown."""
    page = "<!-- scores {mse100:.2f} / {q25:.1f} or empty -->\n\n| | cotton | time |\n|---|---:|---|\n"
    given = page + "| `best` | 0.30 / 0.2 | 3 s |\n| named `fast` | 2.00 / 0.2 | |\n| theirs | 4 | |\n"
    assert filled(given, read_scores(stages)) == (
        page + "| `best` | 1.00 / 1.0 | 3 s |\n| named `fast` | | |\n| theirs | 4 | |\n"
    )


def test_every_marked_table_is_made(stages: Path) -> None:
    """A comment whose table has another form: a run would change nothing, and nobody would see it."""
    marks = [part for file in FILES.values() for part in file.read_text(encoding="utf-8").split("<!-- scores")[1:]]
    assert marks
    for mark in marks:
        table = f"<!-- scores{mark}"
        assert filled(table, read_scores(stages)) != table
