"""A scene for the page, and figures of single pixels beside its pictures."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from sepi.extensions.page.pixels import InterestingPixel, interesting_pixels
from sepi.extensions.page.probe import Probe, to_json
from sepi.extensions.page.probe_figure import write_probes
from sepi.extensions.page.viewer import viewer_json
from sepi.inspection.coded_views import comparable
from sepi.io.files import write_whole
from sepi.io.provenance import history_of
from sepi.matching.plane_sweep import SweepParameters
from sepi.report.panels import Panel, SceneResults, first_final
from sepi.report.pictures import disparity_limits, reference_picture
from sepi.report.plan import BEST_VARIANT, MAIN_VARIANT, Plan


def scene_probes(results: SceneResults, final_file: Path, asked: Sequence[InterestingPixel]) -> list[Probe]:
    """Probes of the paper's method at single pixels of a scene.

    Parameters
    ----------
    results : SceneResults
    final_file : Path
        File of the last stage of the paper's method, with the sweep's parameters.
    asked : sequence of InterestingPixel
        Pixels of the user.

    Returns
    -------
    list of Probe
        The user's pixels first, then automatic ones; pixels without a depth are left out.
    """
    maps = results.final(MAIN_VARIANT)
    # as in the stages
    light_field = comparable(results.light_field)
    pixels = [*asked, *interesting_pixels(light_field, maps)]
    best = results.final(BEST_VARIANT) if BEST_VARIANT in results.maps else None
    known = history_of(final_file)[0]["parameters"]
    parameters = SweepParameters(**{name: known[name] for name in SweepParameters.model_fields if name in known})
    known_there = (pixel for pixel in pixels if np.isfinite(maps.disparity[pixel.y, pixel.x]))
    return [Probe(light_field, pixel, maps, parameters, best) for pixel in known_there]


def write_scene(
    folder: Path,
    page: Path | None,
    plan: Plan,
    results: SceneResults,
    panels: Sequence[Panel],
    pixels: Sequence[tuple[int, int]],
) -> None:
    """Write figures of single pixels to ``folder / "pixels"``, and the scene for the page if that is made.

    Parameters
    ----------
    folder : Path
        Folder of the scene's pictures.
    page : Path or None
        JSON file to write.
    plan : Plan
        Of this scene alone.
    results : SceneResults
    panels : sequence of Panel
        All of the scene.
    pixels : sequence of (int, int)
        Rows and columns that the user asks for.
    """
    asked = [InterestingPixel(y, x, "asked for") for y, x in pixels]
    ((dataset, scene),) = plan.pairs
    probes = scene_probes(results, plan.stage_file(dataset, scene, MAIN_VARIANT, plan.stages[-1]), asked)
    if probes:
        write_probes(folder / "pixels", probes, reference_picture(results.light_field))
    if page is not None:
        told = page_json(results, panels, dataset, scene, probes)
        write_whole(page, json.dumps(told, separators=(",", ":")))


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
        "problems": {method: found.problem for method, found in results.external.items() if found.problem},
    }
