"""Initial depth (section IV-A, Eq. 1-5 of [1]_).

For each pixel of the reference view, ``sepi`` takes the candidate whose line through the SEPI has the least colour
variance (Eq. 3-4), with its distinctness as confidence (Eq. 5). The line meets one sample of each view, so this is a
plane sweep (:mod:`sepi.matching.plane_sweep`); :mod:`sepi.matching.stitched_epi` builds the SEPIs themselves.

``semi_global`` compares colours and fine detail (:mod:`sepi.matching.base_detail`) of a few views that are spread over
the grid, and smooths the costs semi-globally (:mod:`sepi.matching.semi_global`).

``structure_tensor`` is the initial depth of the paper's ablation (:mod:`sepi.matching.structure_tensor`).

:class:`sepi.stage.Choice` describes arguments and results of all choices.

References
----------
.. [1] Zhou, Shi, Liu, Jin, Zhang, Hou: Light Field Depth Estimation via Stitched Epipolar Plane Images.
"""

from __future__ import annotations

from sepi.lightfield import LightField
from sepi.matching.plane_sweep import SweepParameters, sweep
from sepi.matching.softening import compared_views
from sepi.matching.structure_tensor import structure_tensor_depth
from sepi.matching.visibility_sweep import FirstDepthParameters, VisibilitySweepParameters, first_depth
from sepi.stage import Choice, NoParameters, Progress, StageMaps


def sepi(
    light_field: LightField, previous: StageMaps | None, parameters: SweepParameters, progress: Progress
) -> StageMaps:
    """Depth from full SEPIs: all views, every candidate (Eq. 1-5 of [1]_).

    Returns
    -------
    StageMaps
        ``disparity`` and ``confidence``, shape (H, W), float32: the candidate of least colour variance, refined by a
        parabola, and ``1 - min / mean`` of the costs (Eq. 5).

    References
    ----------
    .. [1] Zhou, Shi, Liu, Jin, Zhang, Hou: Light Field Depth Estimation via Stitched Epipolar Plane Images.
       arXiv:2203.15201.

    Examples
    --------
    >>> import numpy as np
    >>> from sepi import initial
    >>> from sepi.scenes import render
    >>> from sepi.stage import no_progress
    >>> light_field = render("slanted_plane", size=64, views=5)
    >>> parameters = initial.CHOICES["sepi"].parameters(num_disparities=61)
    >>> maps = initial.sepi(light_field, None, parameters, no_progress)
    >>> bool(np.median(np.abs(maps.disparity - light_field.ground_truth)) < 0.03)
    True
    """
    result = sweep(light_field, parameters, progress=progress)
    return StageMaps(result.disparity[0], result.confidence()[0])


def semi_global(
    light_field: LightField, previous: StageMaps | None, parameters: VisibilitySweepParameters, progress: Progress
) -> StageMaps:
    """Depth from colours and detail of a few views, with semi-global smoothing; variant ``best`` uses it.

    Returns
    -------
    StageMaps
        ``disparity`` and ``confidence``, shape (H, W), float32.

    References
    ----------
    .. [1] Hirschmuller: Stereo processing by semiglobal matching and mutual information. IEEE TPAMI 30(2), 2008.
       doi:10.1109/TPAMI.2007.1166

    Examples
    --------
    >>> import numpy as np
    >>> from sepi import initial
    >>> from sepi.scenes import render
    >>> from sepi.stage import no_progress
    >>> light_field = render("slanted_plane", size=64, views=5)
    >>> maps = initial.semi_global(light_field, None, initial.CHOICES["semi_global"].parameters(), no_progress)
    >>> bool(np.median(np.abs(maps.disparity - light_field.ground_truth)) < 0.05)
    True
    """
    return first_depth(compared_views(light_field, parameters), parameters, progress)


def structure_tensor(
    light_field: LightField, previous: StageMaps | None, parameters: NoParameters, progress: Progress
) -> StageMaps:
    """Depth from the structure tensor of single EPIs, for the paper's ablation without SEPIs (table 4 of [1]_).

    Returns
    -------
    StageMaps
        ``disparity`` and ``confidence``, shape (H, W), float32.

    References
    ----------
    .. [1] Zhou, Shi, Liu, Jin, Zhang, Hou: Light Field Depth Estimation via Stitched Epipolar Plane Images.
       arXiv:2203.15201.

    Examples
    --------
    The gain by stitching in a scene with noise:

    >>> import numpy as np
    >>> from sepi import initial
    >>> from sepi.scenes import render
    >>> from sepi.stage import no_progress
    >>> light_field = render("dots", size=64, views=5)
    >>> def median_error(name):
    ...     choice = initial.CHOICES[name]
    ...     maps = choice.run(light_field, None, choice.parameters(), no_progress)
    ...     return np.median(np.abs(maps.disparity - light_field.ground_truth))
    >>> bool(median_error("sepi") < median_error("structure_tensor"))
    True
    """
    disparity, confidence = structure_tensor_depth(light_field)
    progress(1.0)
    return StageMaps(disparity, confidence)


CHOICES = {
    "sepi": Choice(SweepParameters, sepi),
    "semi_global": Choice(FirstDepthParameters, semi_global),
    "structure_tensor": Choice(NoParameters, structure_tensor),
}

if __name__ == "__main__":
    from sepi.process.command import stage_command

    stage_command("initial", CHOICES)()
