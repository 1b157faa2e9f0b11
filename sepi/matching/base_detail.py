"""Two layers of each view: its colours, and the fine detail that stays when smooth shading is taken out.

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

import zlib
from dataclasses import dataclass
from typing import Annotated

import cv2
import numpy as np
import numpy.typing as npt
from pydantic import Field

from sepi.image.noise import noise_level, residual_variance
from sepi.lightfield import FloatMap, LightField, as_unit_float, full_scale
from sepi.stage import Parameters

DETAIL_UNIT = 1 / 32000
"""Value of one step of the detail, which is stored as int16: colours differ by at most 1."""

_KEPT: dict[tuple[object, ...], npt.NDArray[np.int16]] = {}


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
    """Parameters of the two layers and of how well they must fit."""

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


@dataclass(frozen=True)
class BaseDetail:
    """The layers of all views, as the kernels want them.

    Attributes
    ----------
    colours : ndarray, shape (T, S, 3, H, W), uint8, uint16 or float32
        In the views' own units; of grey views three times the same.
    colour_unit : float
        What a colour value is multiplied with to span 0..1.
    detail : ndarray, shape (T, S, 3 or 0, H, W), int16
        In units of ``DETAIL_UNIT``; empty where the detail has no share.
    noise : float
        Expected squared residual, summed over RGB, by noise alone.
    guide : ndarray, shape (H, W, 3), float32
        Colours of the reference view, 0..1.
    """

    colours: npt.NDArray[np.generic]
    colour_unit: float
    detail: npt.NDArray[np.int16]
    noise: float
    guide: FloatMap

    def squared_scale(self, scale: float) -> float:
        """Square of a robust scale, widened by the noise."""
        return scale**2 + self.noise


def base_detail_decomposition(light_field: LightField, parameters: BaseDetailParameters) -> BaseDetail:
    """The layers of a light field; missing views stay empty.

    Parameters
    ----------
    light_field : LightField
    parameters : BaseDetailParameters

    Returns
    -------
    Layers
    """
    views, guide = light_field.rgb_views, light_field.reference_view
    edge = float(np.hypot(parameters.base_sigma_colour, 3 * noise_level(guide)))
    if parameters.detail_share > 0:
        detail = _detail_of_views(light_field, parameters.base_radius, edge, parameters.base_sigma_space)
    else:
        detail = np.empty((*light_field.grid, 0, *light_field.shape), np.int16)
    colours = np.ascontiguousarray(views.transpose(0, 1, 4, 2, 3))
    return BaseDetail(colours, 1 / full_scale(views.dtype), detail, residual_variance(guide), guide)


def _detail_of_views(light_field: LightField, radius: int, edge: float, width: float) -> npt.NDArray[np.int16]:
    """Each view without its edge-preserving mean; shape (T, S, 3, H, W).

    The detail of the last light field is kept, since the stages of one run ask for it again.
    """
    views = light_field.rgb_views
    content = zlib.crc32(np.ascontiguousarray(views).data)
    key = (content, views.shape, views.dtype, light_field.present.tobytes(), radius, edge, width)
    if key in _KEPT:
        return _KEPT[key]
    detail = np.zeros((*light_field.grid, 3, *light_field.shape), np.int16)
    for t, s in np.argwhere(light_field.present):
        view = as_unit_float(views[t, s])
        base = cv2.bilateralFilter(view, 2 * radius + 1, edge, width)
        detail[t, s] = np.rint(np.clip(view - base, -1, 1) / DETAIL_UNIT).astype(np.int16).transpose(2, 0, 1)
    forget_layers()
    _KEPT[key] = detail
    return detail


def forget_layers() -> None:
    """Free what is kept of the last light field."""
    _KEPT.clear()
