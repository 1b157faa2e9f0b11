"""A scene for the page, and figures of single pixels beside its pictures."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from sepi.extensions.page.probes.figure import write_probes
from sepi.extensions.page.probes.pixels import InterestingPixel
from sepi.extensions.page.probes.probe import Probe, to_json
from sepi.extensions.page.probes.scene_probes import scene_probes
from sepi.extensions.page.viewer import viewer_json
from sepi.io.files import atomic_path
from sepi.report.panels import Panel, SceneResults, first_final
from sepi.report.plots.pictures import disparity_limits, reference_picture


def write_scene(
    folder: Path,
    page: Path | None,
    results: SceneResults,
    panels: Sequence[Panel],
    dataset: str,
    scene: str,
    final_file: Path,
    pixels: Sequence[tuple[int, int]],
) -> None:
    """Write figures of single pixels to ``folder / "pixels"``, and the scene for the page if that is made.

    Parameters
    ----------
    folder : Path
        Folder of the scene's pictures.
    page : Path or None
        JSON file to write.
    results : SceneResults
    panels : sequence of Panel
        All of the scene.
    dataset, scene : str
    final_file : Path
        File of the last stage of the paper's method.
    pixels : sequence of (int, int)
        Rows and columns that the user asks for.
    """
    asked = [InterestingPixel(y, x, "asked for") for y, x in pixels]
    probes = scene_probes(results, final_file, asked)
    if probes:
        write_probes(folder / "pixels", probes, reference_picture(results.light_field))
    if page is not None:
        with atomic_path(page) as temporary:
            text = json.dumps(page_json(results, panels, dataset, scene, probes), separators=(",", ":"))
            temporary.write_text(text, encoding="utf-8")


def page_json(
    results: SceneResults, panels: Sequence[Panel], dataset: str, scene: str, probes: Sequence[Probe]
) -> dict[str, Any]:
    """Data of a scene for the page."""
    shown = [panel for panel in panels if panel.in_page]
    return {
        "dataset": dataset,
        "scene": scene,
        "grid": list(results.light_field.grid),
        "first": {"a": "reference_view", "b": first_final(shown)},
        **viewer_json(shown, disparity_limits(results.light_field), results.light_field),
        "probes": [to_json(found) for found in probes],
        "problems": dict(results.problems),
    }
