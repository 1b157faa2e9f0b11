"""Probes of a scene for the report: of the user's pixels, and of a few that show how the method works."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from sepi.extensions.page.probes.pixels import InterestingPixel, interesting_pixels
from sepi.extensions.page.probes.probe import Probe, probe
from sepi.inspection.coded_views import comparable
from sepi.io.provenance import history_of
from sepi.matching.plane_sweep import SweepParameters
from sepi.report.panels import SceneResults
from sepi.report.plan import BEST_VARIANT, MAIN_VARIANT


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
    pixels = [*asked, *interesting_pixels(light_field, maps, light_field.ground_truth)]
    parameters = sweep_parameters(final_file)
    return [
        probe(
            light_field,
            pixel,
            maps=maps,
            parameters=parameters,
            best=results.final(BEST_VARIANT) if BEST_VARIANT in results.maps else None,
        )
        for pixel in pixels
        if np.isfinite(maps.disparity[pixel.y, pixel.x])
    ]


def sweep_parameters(final_file: Path) -> SweepParameters:
    """Parameters of the sweep from which a final map of the paper's method was made."""
    known = history_of(final_file)[0]["parameters"]
    return SweepParameters(**{name: known[name] for name in SweepParameters.model_fields if name in known})
