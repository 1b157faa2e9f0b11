"""Tables of the pages whose figures a command writes or prints."""

import csv
import itertools
import re
import sys
from pathlib import Path

from markdown_links import DOCS, FILES, REPOSITORY

sys.path.insert(0, str(DOCS))
sys.path.insert(0, str(REPOSITORY / "tests" / "report"))

from make_tables import TABLE, filled
from report_results import numbers_of, report_of, with_results

from sepi.report.plan import Plan
from sepi.report.properties import PROPERTIES
from sepi.scenes import SCENES
from sepi.variants import STAGES, VARIANTS
from sepi.workflow.rendered_scenes import NOISE_LEVELS

HCI = ("cotton", "antinous")


def written(file: Path, **columns: list[str]) -> None:
    """A CSV file with a row for each combination of some words, and a figure in columns that have none."""
    file.parent.mkdir(parents=True, exist_ok=True)
    words = {name: one or ["1"] for name, one in columns.items()}
    with file.open("w", encoding="utf-8", newline="") as opened:
        csv.writer(opened).writerows([[*words], *itertools.product(*words.values())])


def test_figures_are_filled_in(tmp_path: Path) -> None:
    """What somebody else's table holds is overwritten, or what a run found is not shown."""
    regions = {"protocol": ["paper"], "region": ["all", "occluded"]}
    written(tmp_path / "a.csv", variant=["best", "fast"], scene=[*HCI, "dots"], **regions, mse100=[], q25=[])
    (tmp_path / "b.csv").write_text("scene,mse100\ncotton,2\ncotton,4\ncotton,nan\ndots,\n")
    mark, form = (
        "<!-- from a.csv, variant by scene: {mse100:.2f} /\n{q25:.1f} or empty -->",
        "\n\n| | cotton | time |\n",
    )
    page = f"{mark}{form}|---|---:|---|\n| `best`, all | 9 | 3 s |\n| named `fast` | 2 | |\n| theirs | 4 | |\n"
    assert TABLE.sub(lambda found: filled(found, tmp_path), page) == (
        f"{mark}{form}|---|---:|---|\n| `best`, all | 1.00 / 1.0 | 3 s |\n| named `fast` | | |\n| theirs | 4 | |\n"
    )
    page = "<!-- from b.csv, none.csv, scene: {mse100:.0f} | {mse100:.1f} -->\n| | |\n|-|-|\n"
    assert TABLE.sub(lambda found: filled(found, tmp_path), page + "| cotton (hci) | 9 | |\n| dots | | 9 |\n") == (
        page + "| cotton (hci) | 3 | 3.0 |\n| dots | - | - |\n"
    )


def test_every_marked_table_is_made(tmp_path: Path) -> None:
    """A comment whose table has another form: a run would change nothing, and nobody would see it."""
    pages = [file.read_text(encoding="utf-8") for file in FILES.values()]
    plan = with_results(Plan(tmp_path, {"hci": ["cotton"]}, {v: VARIANTS[v].choices for v in ("paper", "best")}))
    heads = {"rendered/properties_mse": ["noise", "method", *PROPERTIES]}
    for name in ("stages", "edges", "comparison/methods", "ablation_best"):
        numbers = numbers_of(plan.parts_of_best() if name == "ablation_best" else plan.main())
        heads[name] = [*report_of(numbers, name.rpartition("/")[2]).rows]
    # thresholds of the configuration
    heads["comparison/methods"] += ["badpix_0.25", "badpix_1"]
    own = [name for page in pages for name in re.findall(r"^  (\w+): {path: ", page, re.MULTILINE)]
    words = {"variant": [*VARIANTS], "method": [*VARIANTS], "scene": [*HCI, *SCENES, *own], "dataset": ["builtin"]}
    words |= {"stage": [*STAGES], "noise": [*NOISE_LEVELS], "protocol": ["paper"], "region": ["all"]}
    for name, columns in heads.items():
        written(tmp_path / f"reports/{name}.csv", **{head: words.get(head, []) for head in columns})
    tables = [found for page in pages for found in TABLE.finditer(page)]
    assert len(tables) == "".join(pages).count("<!-- from ")
    for found in tables:
        rows = found["rows"].splitlines()
        for old, new in zip(rows, filled(found, tmp_path).splitlines()[-len(rows) :], strict=True):
            # what no run has is named in plain words
            assert old != new or not re.match(r"\| [^|]*`", old) or found["empty"], old
