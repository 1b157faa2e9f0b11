"""The gallery's examples run, each as a script in a process of its own, and what their text says is so."""

import ast
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

import sepi

RUN = Path(__file__).with_name("example_with_claims.py")
GALLERY = Path(__file__).parents[2] / "docs" / "gallery"

OUTLINES = "(np.hypot(*np.gradient(light_field.ground_truth)) > 0.05)"

# what the text of each example says, in the example's own names
CLAIMS: dict[str, list[str]] = {
    "plot_01_first_depth_map": [
        "np.median(error) < 0.005",
        "np.mean(error > 0.07) < 0.02",
    ],
    "plot_02_sepis_and_cost_curves": [
        "spread['right candidate'] < 0.2 * spread['wrong candidate']",
        "abs(found - true) < 0.01",
    ],
    "plot_03_occlusion": [
        "cost_at_truth['right'] < 0.5 * cost_at_truth['full'] < 0.5 * cost_at_truth['left']",
        "mse['best'] < mse['half-SEPIs'] < 2 / 3 * mse['all views']",
    ],
    "plot_04_textureless_regions": [
        # the last curve is the wall's: flat
        "np.ptp(curves.costs[0]) < 0.15",
        "np.median(lti[bare]) < 0.3 * np.median(lti[~bare])",
        "mse['best'] < mse['paper'] < mse['no_textureless']",
    ],
    "plot_05_confidence": [
        "curves['by confidence'].mean() < 0.5 * error.mean()",
        "error[kept].mean() < 0.7 * error.mean() and 0.5 < kept.mean() < 0.95",
        "abs(maps.confidence.mean() - np.mean(error <= close)) < 0.2 and right > 0.9",
        # low round every outline, and on the right; there are the large errors, and few of these pixels are wrong
        f"maps.confidence[{OUTLINES}].mean() < maps.confidence.mean() - 0.1",
    ],
    "plot_06_missing_views": [
        "bad['star'] < bad['cross'] < bad['row']",
        "bad['black, told'] < 0.7 * bad['black, not told']",
    ],
    "plot_07_another_view": [
        "corner.views is light_field.views",
        "(~same & ~nearer).mean() < 0.02",
    ],
    "plot_08_point_cloud": [
        "np.median(error_mm) < 1.5",
        "abs(measured - true) < 0.3",
        "cloud.metric and cloud.positions[:, 2].max() < 0",
    ],
    "plot_09_refocusing": [
        "noise['all in focus'] < 0.3 * noise['centre view']",
        "maps.disparity[clicks['the pot']] > 1.5 and maps.disparity[clicks['the paper']] < -1",
    ],
    "plot_10_comparing_methods": [
        "scores['best']['all']['mse100'] < scores['paper']['all']['mse100'] < scores['mishiba']['all']['mse100']",
        "scores['best']['discontinuities']['fattening'] < 0.5 * scores['paper']['discontinuities']['fattening']",
    ],
    "plot_11_a_stage_of_your_own": [
        "bad['fill'] < 0.5 * min(bad['first map'], bad['wls'])",
        "mse['fill'] > mse['first map'] > mse['wls']",
    ],
    "plot_12_many_light_fields": [
        "list(done) == ['dots', 'pyramids', 'wall'] and same",
        "list(failed) == ['broken'] and 'broken/input_Cam000.png' in failed['broken']",
        "not Path(workplace.name).exists()",
    ],
    "plot_13_every_view": ["agree.min() > 0.75 and agree[2, 2] == 1", "np.max(1 - agree - hidden) < 0.03"],
    "plot_14_calibrated_cameras": [
        "np.median(error[known]) < 5 and 0.6 < known.mean() < 1",
        "light_field.grid == (3, 3) and light_field.rig.units == 'metres'",
    ],
    "plot_15_error_bars": [
        # wide at outlines, more so to one side, and on the bare wall; narrow where there is texture
        "np.median(width[~bare & ~rim]) < 0.6 * min(np.median(width[rim]), np.median(width[bare & ~rim]))",
        "0.8 < held(maps).mean() < 0.98",
        "np.median(in_noise.high - in_noise.low) > 1.5 * np.median(width) and held(in_noise).mean() > 0.8",
        "all(errors['mean by sigma'].mean() < errors[name].mean() for name in errors if name != 'mean by sigma')",
        "shared.mean() > 0.005 and stays > 0.9",
        "len(cloud.positions) == kept.sum() and 0.3 < kept.mean() < 0.95",
        "error_cm[kept].mean() < 0.85 * error_cm.mean()",
    ],
}


def unimported(source: str) -> set[str]:
    """What a text takes from ``sepi`` by a dot that ``import sepi`` alone, or a line of its own, does not bring."""
    imported = {name.split(".")[1] for name in re.findall(r"^import (sepi\.[\w.]+)", source, re.MULTILINE)}
    used = [node for node in ast.walk(ast.parse(source)) if isinstance(node, ast.Attribute)]
    names = {node.attr for node in used if isinstance(node.value, ast.Name) and node.value.id == "sepi"}
    return names - {*dir(sepi), *imported}


def test_every_example_is_checked() -> None:
    """A new example that nobody runs would break unseen."""
    assert sorted(path.stem for path in GALLERY.glob("plot_*.py")) == sorted(CLAIMS)


def test_examples_import_what_they_use() -> None:
    """What runs them has loaded ``sepi.scenes`` already; whoever runs the script gets an AttributeError."""
    missing = {name: unimported((GALLERY / f"{name}.py").read_text(encoding="utf-8")) for name in CLAIMS}
    assert not any(missing.values()), missing


@pytest.mark.slow
@pytest.mark.parametrize("name", CLAIMS)
def test_example_runs_and_shows_what_it_says(name: str, tmp_path: Path) -> None:
    """Someone who downloads the script gets an error or a warning, or pictures that do not show what the text says."""
    environment = os.environ | {"OMP_NUM_THREADS": "1"} | {"MPLBACKEND": "agg"}
    command = [sys.executable, str(RUN), str(GALLERY / f"{name}.py"), *CLAIMS[name]]
    done = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path, env=environment, check=False)
    assert done.returncode == 0, done.stderr
    assert not done.stderr
    assert not list(tmp_path.iterdir()), "an example leaves files behind"
