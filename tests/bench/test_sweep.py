"""A parameter is chosen on some scenes and tried on the one left out; held-out rendered scenes are no part of it."""

import re
from functools import partial
from pathlib import Path

import pytest
from error_lines import done
from rendered_files import write_drawn

from bench import sweep
from bench.__main__ import main
from sepi.errors import SepiError
from sepi.extensions.rendered.exposure import read_scene
from sepi.scenes import render, write_hci

QUICK = ("--variant", "no_occlusion_no_textureless", "--threads", "1")


def test_the_value_for_a_scene_is_chosen_on_the_others() -> None:
    """Value 2 is best on average, but without the third scene, which it was chosen for, value 1 is."""
    text = sweep.tables(["1", "2", "3"], {"a": [1.0, 2.0, 9.0], "b": [2.0, 1.5, 9.0], "c": [9.0, 4.0, 1.0]})
    rows = [re.findall(r"[^|\s]+(?: [^|\s]+)*", line) for line in text.splitlines()]
    assert ["2", "2.500", "2.000", "1.500", "4.000"] in rows
    assert rows[8:11] == [["a", "2", "2.000", "1.000"], ["b", "2", "1.500", "1.500"], ["c", "1", "9.000", "1.000"]]
    assert text.endswith(f": {(2 + 1.5 + 9) / 3:.3f}")


def test_held_out_scenes_are_refused_whatever_their_files_are_called(tmp_path: Path) -> None:
    """A parameter that was chosen on them would say nothing about other scenes."""
    write_drawn(tmp_path / "innocent.h5", "foliage")
    write_hci(read_scene(tmp_path / "innocent.h5", "low", 2), tmp_path / "folder")
    write_drawn(tmp_path / "sticks.h5", "sticks")
    for name in ("innocent.h5", "folder"):
        with pytest.raises(SepiError, match=f"{name}: scene 'foliage' is held out, .*; on sticks, wires"):
            sweep.scene_for_choosing(str(tmp_path / name), "off")
    assert sweep.scene_for_choosing(str(tmp_path / "sticks.h5"), "high").name == "sticks_high"


def test_the_command_scores_each_value_on_each_scene(tmp_path: Path) -> None:
    for name, builtin in (("sticks", "dots"), ("wires", "pyramids")):
        write_drawn(tmp_path / f"{name}.h5", name, builtin)
    scenes = [word for name in ("sticks", "wires") for word in ("--scene", str(tmp_path / f"{name}.h5"))]
    words = ["sweep", "optimize.wls.alpha", "1e-6", "1", *QUICK, "--noise", "off", *scenes]
    result = done(*words, of=main)
    assert "| left out" in result.stdout
    assert re.search(r"\| sticks +\| 1e-6 ", result.stdout)


def test_noise_is_added_measured_and_scored(monkeypatch: pytest.MonkeyPatch) -> None:
    """If this fails, the table of noise is of something else than it says."""
    monkeypatch.setattr(sweep, "render", partial(render, size=96, views=5))
    arguments = "noise --scene pyramids --sigma 0 --sigma 12 --variant fast --allowed --threads 1"
    called = done(*arguments.split(), of=main)
    head, _, *rows = ([cell.strip() for cell in line.split("|")[1:-1]] for line in called.output.splitlines())
    assert head == ["", "pyramids", "pyramids + 12"]
    assert [row[0] for row in rows] == ["`fast`", "allowed, alone", "allowed, 5x5"]
    scores, alone, together = ([[float(n) for n in cell.split(" / ")] for cell in row[1:]] for row in rows)
    assert scores[0][1] < scores[1][1]
    # what noise allows grows with it, and neighbours know more than a pixel alone
    assert together[1][0] < alone[1][0]
    assert alone[0][0] < 0.1 * alone[1][0]
