"""Depth maps of a light field: the stages of a variant, run in order."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from numbers import Real
from types import NoneType
from typing import Any

import numpy as np

from sepi.inspection.coded_views import comparable
from sepi.lightfield import LightField, require_light_field
from sepi.matching.memory_limit import bytes_of_bands, bytes_of_volumes, require_memory_of
from sepi.matching.unknown import with_unknown
from sepi.process.memory import give_back_memory
from sepi.process.workspace import Workspace
from sepi.stage import MadeBy, Parameters, Progress, StageMaps, entry, no_progress, part_of
from sepi.validation import require_type
from sepi.variants import HANDED_ON, STAGES, VARIANTS, Variant, stage_parameters, variant_named
from sepi.variants.built_in import DEFAULT_VARIANT


def estimate_depth(
    light_field: LightField,
    variant: str | Variant = DEFAULT_VARIANT,
    parameters: Mapping[str, Mapping[str, Any]] | None = None,
    progress: Progress = no_progress,
    memory: int | None = None,
) -> StageMaps:
    """Disparity, confidence and masks of a light field's reference view.

    Parameters
    ----------
    light_field : LightField
        If its disparity range is unknown, the range is estimated from the views.
    variant : str or Variant
        Name of a built-in variant (:data:`sepi.variants.VARIANTS`), or a choice and parameters for each stage.
    parameters : mapping, optional
        Stage to field to value, to override defaults: ``{"initial": {"num_disparities": 91}}``.
    progress : callable
        Called with the fraction done, 0..1.
    memory : int, optional
        Most bytes of the process, the light field and Python included. Less memory takes more time, for the same maps.

    Returns
    -------
    StageMaps
        ``disparity`` (H, W) float32 in pixels per view step, ``confidence`` (H, W) float32 in 0..1, ``extra`` maps of
        the stages and ``unknown``, bool: pixels for whose depth no view has evidence, with confidence 0.

    Raises
    ------
    SepiError
        If the variant, a stage or a field is unknown, a value is not allowed, or ``memory`` is too small.
    MemoryError
        If a limit on the process's address space is too small.

    Examples
    --------
    >>> import numpy as np
    >>> import sepi
    >>> from sepi.scenes import render
    >>> light_field = render("pyramids", size=96, views=5)
    >>> maps = sepi.estimate_depth(light_field)
    >>> maps.disparity.shape, maps.confidence.dtype.name, sorted(maps.extra)
    ((96, 96), 'float32', ['high', 'low', 'occluded', 'sigma', 'textureless', 'unknown'])
    >>> bool(np.median(np.abs(maps.disparity - light_field.ground_truth)) < 0.01)
    True

    The method as published, with another value of a parameter:

    >>> maps = sepi.estimate_depth(light_field, "paper", {"initial": {"num_disparities": 91}})
    >>> sorted(set(maps.extra) - {"sigma", "low", "high"})[:4]
    ['lti', 'occluded', 'occlusion_candidates', 'superpixels']
    """
    require_light_field(light_field)
    require_type("variant", variant, (str, Variant), "the name of a variant or a Variant")
    require_type("memory", memory, (Real, NoneType), "a number of bytes")
    chosen = variant_named(variant) if isinstance(variant, str) else variant
    settings = stage_parameters(chosen, parameters)
    if light_field.disparity_range is None:
        from sepi.inspection.disparity_range import estimate_range

        light_field = light_field.with_range(estimate_range(light_field))
    light_field.require_seen_range()
    # kernels need contiguous views
    views, workspace = np.ascontiguousarray(light_field.views), light_field.workspace or Workspace()
    light_field = replace(light_field, views=views, workspace=workspace)
    compared = comparable(light_field)
    require_memory_of(compared, settings.values())
    # the workspace keeps the noise that require_memory_of measured
    workspace = replace(workspace, detail_bytes=bytes_of_volumes(compared, settings.values()))
    if memory is not None:
        workspace = replace(workspace, band_bytes=bytes_of_bands(compared, settings.values(), memory))
    compared = replace(compared, workspace=workspace)
    maps = _after_all_stages(compared, chosen, settings, progress)
    name = variant if isinstance(variant, str) else next((key for key, one in VARIANTS.items() if one == variant), "")
    history = tuple(
        entry(stage, choice, settings[stage], light_field)
        for stage, choice in chosen.choices.items()
        if choice != HANDED_ON
    )
    made_by = MadeBy(name, history, light_field.require_disparity_range())
    return replace(with_unknown(light_field, maps), made_by=made_by)


def _after_all_stages(
    light_field: LightField, chosen: Variant, settings: Mapping[str, Parameters], progress: Progress
) -> StageMaps:
    maps: StageMaps | None = None
    for number, (stage, choice) in enumerate(chosen.choices.items()):
        of_all = part_of(progress, number, len(STAGES))
        maps = STAGES[stage][choice].run(light_field, maps, settings[stage], of_all)
        of_all(1.0)
        if stage == "occlusion":
            # this stage takes most
            give_back_memory()
    assert maps is not None  # there are stages
    return maps
