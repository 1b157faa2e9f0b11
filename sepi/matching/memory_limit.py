"""A limit on the memory of an estimate: the part always needed, and the rest, which the bands may use.

The views, the maps, the cost volumes of variant ``best`` and the rows of costs of each thread of a plane sweep are held
as a whole. Whatever needs all views at once is computed in bands of rows (:mod:`sepi.matching.row_bands`), narrower
ones if memory is short. The results are the same. The compared methods hold everything as a whole.
"""

from collections.abc import Iterable

from sepi.errors import SepiError
from sepi.lightfield import LightField
from sepi.matching.base_detail import BaseDetailParameters
from sepi.matching.denoising import denoised
from sepi.matching.plane_sweep import SweepParameters
from sepi.matching.row_bands import least_band_bytes
from sepi.matching.softening import SofteningParameters, compared_views, softened
from sepi.matching.visibility_sweep import BYTES_PER_CANDIDATE, VisibilitySweepParameters
from sepi.process.memory import require_memory
from sepi.process.threads import threads_used
from sepi.stage import OcclusionMarginParameters, Parameters

_LIBRARIES = 300 * 2**20
"""Python with what it imports, and what is allocated for the moment."""

_BYTES_OF_MAPS = 200
"""Of each pixel: maps, the reference view, the systems of the regularisation."""


def require_memory_of(light_field: LightField, stages: Iterable[Parameters]) -> None:
    """Check that an estimate fits into the limit on the process's address space, if one is set.

    Parameters
    ----------
    light_field : LightField
        With a known disparity range.
    stages : iterable of Parameters
        Parameters of the stages that will run.

    Raises
    ------
    MemoryError
    """
    _, least = _bytes_taken(light_field, stages)
    require_memory(least - _LIBRARIES - light_field.views.nbytes)


def bytes_of_bands(light_field: LightField, stages: Iterable[Parameters], memory: int) -> int:
    """Bytes that the bands may take, so that an estimate stays within a limit.

    Parameters
    ----------
    light_field : LightField
        With a known disparity range.
    stages : iterable of Parameters
        Parameters of the stages that will run.
    memory : int
        The limit, bytes.

    Returns
    -------
    int
        Bytes.

    Raises
    ------
    SepiError
        If the limit is less than what is needed in any case.
    """
    whole, least = _bytes_taken(light_field, stages)
    if memory < least:
        raise SepiError(
            f"{light_field.name}: needs at least {-(-least // 2**20)} MB with these views and candidates, more than "
            f"the limit of {memory // 2**20} MB; fewer candidates, a narrower range or variant paper need less"
        )
    return memory - whole


def bytes_of_volumes(light_field: LightField, stages: Iterable[Parameters]) -> int:
    """Bytes of the cost volumes, which other stages may reuse; the disparity range must be known."""
    sweeps = [p.fewer(light_field, p.finest_sampling) for p in stages if isinstance(p, VisibilitySweepParameters)]
    height, width = light_field.shape
    return BYTES_PER_CANDIDATE * max(sweeps, default=0) * height * width


def _bytes_taken(light_field: LightField, stages: Iterable[Parameters]) -> tuple[int, int]:
    """Bytes held as a whole, without and with the narrowest bands."""
    stages = list(stages)
    height, width = light_field.shape
    rings = [p.sweep_bytes(light_field, threads_used()) for p in stages if isinstance(p, SweepParameters)]
    pixels, samples = height * width, height * width * int(light_field.present.sum())
    own = max((p.needs.bytes_per_sample * samples + p.needs.bytes_per_pixel * pixels for p in stages), default=0)
    ours = _BYTES_OF_MAPS * pixels + max(bytes_of_volumes(light_field, stages), *rings, 0)
    copies = [light_field.views]
    for p in stages:
        made: tuple[LightField, ...] = ()
        if isinstance(p, SofteningParameters):
            made = denoised(light_field, p.denoising), compared_views(light_field, p)
        elif isinstance(p, SweepParameters):
            made = (softened(light_field, p.softening),)
        for field in made:
            copies += [field.views] * all(field.views is not known for known in copies)
    ours += sum(views.nbytes for views in copies[1:])
    whole = _LIBRARIES + light_field.views.nbytes + round(max(ours, own))
    in_bands = any(isinstance(p, (BaseDetailParameters, OcclusionMarginParameters)) for p in stages)
    if not in_bands:
        return whole, whole
    # here, since it loads what compiles
    from sepi.matching.aligned_views import BYTES_PER_PIXEL

    # the optimisation holds most of a pixel
    return whole, whole + least_band_bytes(light_field, BYTES_PER_PIXEL)
