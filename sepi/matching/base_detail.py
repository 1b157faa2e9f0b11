"""Base-detail decomposition: the colours of each view, and the fine detail that stays without smooth shading.

Photo-consistency assumes that a surface looks alike from everywhere. Shading does not: a glossy wall or floor changes
its brightness smoothly from view to view, and where texture is weak that change outweighs it, so that the colours alone
pull the depth aside over whole regions. Detail is what is left of a view when its edge-preserving mean (the bilateral
filter of [1]_) is taken away: texture passes, smooth changes do not, and edges stay in the base, so that a surface's
detail does not show its neighbour's colours. Colours with a wide scale decide at edges, detail with a narrow one
inside surfaces.

References
----------
.. [1] Tomasi, Manduchi: Bilateral filtering for gray and color images. ICCV 1998. doi:10.1109/ICCV.1998.710815
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Annotated, NamedTuple

import cv2
import numpy as np
import numpy.typing as npt
from pydantic import Field

from sepi.image.noise import noise_level, residual_variance
from sepi.lightfield import BoolMap, FloatMap, LightField, as_unit_float, full_scale
from sepi.stage import Parameters

DETAIL_UNIT = 1 / 32000
"""Unit of the detail, which is stored as int16: colours differ by at most 1."""

# views and their detail, by what it was made of
_Shared = dict[tuple[object, ...], tuple[npt.NDArray[np.generic], npt.NDArray[np.int16]]]
_shared: ContextVar[_Shared | None] = ContextVar("_shared", default=None)


ColourScale = Annotated[
    float,
    Field(
        ge=1e-6,
        le=2,
        description="residual of the colours at which their cost is one half; RGB distance, colours in 0..1",
    ),
]
"""A parameter whose default is not the same for every sweep."""


class BaseDetailParameters(Parameters):
    """Parameters of the decomposition, and of how well colours and detail must fit."""

    colour_scale: ColourScale = 0.0316
    detail_scale: float = Field(
        0.0045,
        ge=1e-6,
        le=2,
        description="residual of the detail at which its cost is one half; RGB distance, colours in 0..1",
    )
    detail_share: float = Field(0.6, ge=0, le=1, description="share of the detail in the cost; 0 uses colours alone")
    base_radius: int = Field(4, ge=1, le=20, description="bilateral window of 2 r + 1 pixels that takes detail out")
    base_sigma_colour: float = Field(
        0.0314, gt=0, le=2, description="sum of the RGB differences that counts as an edge of the base, colours in 0..1"
    )
    base_sigma_space: float = Field(4.0, gt=0, le=20, description="width of the base's window, in pixels")


class BaseDetail(NamedTuple):
    """Colours and detail of all views.

    Attributes
    ----------
    colours : ndarray, shape (T, S, 3, H, W), uint8, uint16 or float32
        In the views' own units; of grey views three times the same.
    colour_unit : float32
        What a colour value is multiplied with to span 0..1.
    detail : ndarray, shape (T, S, 3 or 0, H, W), int16
        Empty where the detail has no share.
    detail_unit : float32
        What a detail value is multiplied with.
    present : ndarray, shape (T, S), bool
    t0, s0 : int
        Position of the reference view.
    baselines : ndarray, shape (T, S, 2), float64
        Down and across from the reference view, in view steps.
    noise : float
        Expected squared residual, summed over RGB, by noise alone.
    guide : ndarray, shape (H, W, 3), float32
        Colours of the reference view, 0..1.
    """

    colours: npt.NDArray[np.generic]
    colour_unit: np.float32
    detail: npt.NDArray[np.int16]
    detail_unit: np.float32
    present: BoolMap
    t0: int
    s0: int
    baselines: npt.NDArray[np.float64]
    noise: float
    guide: FloatMap

    def squared_scale(self, scale: float) -> float:
        """Square of a robust scale, widened by the noise."""
        return scale**2 + self.noise


def base_detail_decomposition(
    light_field: LightField, parameters: BaseDetailParameters, *, last: bool = False
) -> BaseDetail:
    """Colours and detail of a light field; missing views stay empty.

    Parameters
    ----------
    light_field : LightField
    parameters : BaseDetailParameters
    last : bool
        Whether no later stage needs the detail: it is not kept for one then (:func:`shared_detail`).

    Returns
    -------
    BaseDetail
    """
    views, guide = light_field.rgb_views, light_field.reference_view
    edge = float(np.hypot(parameters.base_sigma_colour, 3 * noise_level(guide)))
    if parameters.detail_share > 0:
        detail = _detail_of_views(light_field, parameters.base_radius, edge, parameters.base_sigma_space, last)
    else:
        detail = np.empty((*light_field.grid, 0, *light_field.shape), np.int16)
    return BaseDetail(
        # as they are in memory: nothing is copied
        views.transpose(0, 1, 4, 2, 3),
        np.float32(1 / full_scale(views.dtype)),
        detail,
        np.float32(DETAIL_UNIT),
        light_field.present,
        *light_field.reference_position,
        light_field.baselines,
        residual_variance(guide),
        guide,
    )


@contextmanager
def shared_detail() -> Iterator[None]:
    """Stages that run inside, in this thread, on one light field share its detail; it is freed at the end.

    The views must not change meanwhile.
    """
    token = _shared.set({})
    try:
        yield
    finally:
        _shared.reset(token)


def _detail_of_views(
    light_field: LightField, radius: int, edge: float, width: float, last: bool
) -> npt.NDArray[np.int16]:
    """Each view without its edge-preserving mean; shape (T, S, 3, H, W)."""
    shared = _shared.get()
    key = (id(light_field.views), light_field.present.tobytes(), radius, edge, width)
    if shared is not None and key in shared:
        return shared.pop(key)[1] if last else shared[key][1]
    detail = np.zeros((*light_field.grid, 3, *light_field.shape), np.int16)
    for t, s in np.argwhere(light_field.present):
        view = as_unit_float(light_field.rgb_views[t, s])
        base = cv2.bilateralFilter(view, 2 * radius + 1, edge, width)
        detail[t, s] = np.rint(np.clip(view - base, -1, 1) / DETAIL_UNIT).astype(np.int16).transpose(2, 0, 1)
    if shared is not None and not last:
        # with the views, so that no other array gets their id meanwhile
        shared[key] = light_field.views, detail
    return detail
