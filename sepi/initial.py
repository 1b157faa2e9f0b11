"""Initial depth (section IV-A, Eq. 1-5 of [1]_).

``sepi`` takes, for every pixel of the reference view, the candidate whose line through the SEPI has the least colour
variance (Eq. 3-4), and its distinctness as confidence (Eq. 5). The line meets one sample of each view, so this is a
plane sweep (:mod:`sepi.matching.plane_sweep`); the construction itself is in :mod:`sepi.matching.stitched_epi`.

``semi_global`` compares colours and fine detail (:mod:`sepi.matching.base_detail`) of a few views that are spread over
the grid, and smooths the costs semi-globally (:mod:`sepi.matching.semi_global`).

``structure_tensor`` is the initial depth that the paper's ablation puts in its place
(:mod:`sepi.matching.structure_tensor`).

References
----------
.. [1] Zhou, Shi, Liu, Jin, Zhang, Hou: Light Field Depth Estimation via Stitched Epipolar Plane Images.
"""

from __future__ import annotations

from sepi.compared.methods import choices_of
from sepi.lightfield import LightField
from sepi.matching.plane_sweep import SweepParameters, sweep
from sepi.matching.structure_tensor import StructureTensorParameters, structure_tensor_depth
from sepi.matching.visibility_sweep import (
    FirstDepthParameters,
    VisibilitySweepParameters,
    first_depth,
)
from sepi.stage import Choice, Progress, StageMaps


def sepi(
    light_field: LightField, previous: StageMaps | None, parameters: SweepParameters, progress: Progress
) -> StageMaps:
    """Depth from full SEPIs: all views, every candidate (Eq. 1-5).

    Parameters
    ----------
    light_field : LightField
        With a known disparity range.
    previous : None
        The first stage builds on nothing.
    parameters : SweepParameters
    progress : callable

    Returns
    -------
    StageMaps
        ``disparity`` and ``confidence``, shape (H, W), float32.

    Raises
    ------
    SepiError
        If the disparity range is unknown.
    """
    result = sweep(light_field, parameters, progress=progress)
    return StageMaps(result.disparity[0], result.confidence()[0])


def semi_global(
    light_field: LightField, previous: StageMaps | None, parameters: VisibilitySweepParameters, progress: Progress
) -> StageMaps:
    """Depth from colours and detail of a few views, smoothed semi-globally; arguments and result as for ``sepi``."""
    result = first_depth(light_field, parameters, progress)
    return StageMaps(result.disparity, result.confidence)


def structure_tensor(
    light_field: LightField, previous: StageMaps | None, parameters: StructureTensorParameters, progress: Progress
) -> StageMaps:
    """Depth from the structure tensor of single EPIs, for the ablation; arguments and result as for ``sepi``."""
    disparity, confidence = structure_tensor_depth(light_field, parameters)
    progress(1.0)
    return StageMaps(disparity, confidence)


CHOICES = {
    "sepi": Choice(SweepParameters, sepi),
    "semi_global": Choice(FirstDepthParameters, semi_global),
    "structure_tensor": Choice(StructureTensorParameters, structure_tensor),
    **choices_of("initial"),
}

if __name__ == "__main__":
    from sepi.command import stage_command

    stage_command("initial", CHOICES)()
