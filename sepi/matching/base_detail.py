"""Base-detail decomposition: the colours of each view, and its fine detail without smooth shading.

Photo-consistency assumes that a surface looks alike from everywhere. Shading does not: a glossy wall or floor changes
its brightness smoothly from view to view. Where texture is weak, that change outweighs it, and the colours alone bias
the depth over whole regions. Detail is a view minus its edge-preserving mean (the bilateral filter of [1]_). It keeps
texture but no smooth changes. Edges stay in the base, so a surface's detail does not show its neighbour's colours.
Colours with a wide scale decide at edges, detail with a narrow one inside surfaces.

References
----------
.. [1] Tomasi, Manduchi: Bilateral filtering for gray and color images. ICCV 1998. doi:10.1109/ICCV.1998.710815
"""

from typing import Annotated, Any, NamedTuple

import numpy as np
import numpy.typing as npt
from pydantic import Field

from sepi.image.noise import noise_of_reference_view, variance_of_residuals
from sepi.kernels import base_detail as kernels
from sepi.lightfield import BoolMap, FloatMap, LightField, full_scale
from sepi.matching.denoising import LEFT, DenoisedLightField
from sepi.matching.row_bands import Rows
from sepi.matching.softening import SofteningParameters
from sepi.process.workspace import forget, kept

DETAIL_UNIT = 1 / 32000
"""Unit of the detail, which is stored as int16: colours differ by at most 1."""

# bilateral window of 2 r + 1 pixels that takes the detail out, its width in pixels, and the sum of RGB differences at
# an edge of the base, colours in 0..1
_RADIUS, _WIDTH, _EDGE = 4, 4.0, 0.05

ColourScale = Annotated[float, Field(ge=1e-6, le=2, description="residual at which colours cost half; RGB distance")]
"""A parameter whose default is not the same for every sweep."""


class BaseDetailParameters(SofteningParameters):
    """Parameters of the decomposition, and of how well colours and detail must fit."""

    colour_scale: ColourScale = 0.0316
    detail_scale: float = Field(0.0038, ge=1e-6, le=2, description="residual at which detail costs half; RGB distance")
    use_detail: bool = Field(True, description="whether the detail is compared, or colours alone")
    detail_share: float = Field(0.6, gt=0, le=1, description="share of the detail in the cost")

    @property
    def shares(self) -> FloatMap:
        """Shares of colours and detail in the cost; shape (2,), float32."""
        share = self.detail_share if self.use_detail else 0.0
        return np.array([1 - share, share], np.float32)


class BaseDetail(NamedTuple):
    """Colours and detail of all views.

    Attributes
    ----------
    colours : ndarray, shape (T, S, H, W, 3), uint8, uint16 or float32
        The views as stored in memory; grey views repeat their channel three times.
    colour_unit : float32
        What a colour value is multiplied with to span 0..1.
    detail : ndarray, shape (T, S, n or 0, W), int16
        Mean over the channels; rows from ``low`` on; empty where the detail has no share.
    detail_unit : float32
        What a detail value is multiplied with.
    low : int
        First row of the detail.
    present : ndarray, shape (T, S), bool
        The views that are compared.
    t0, s0 : int
        Position of the reference view.
    noise : float
        Expected squared residual, summed over RGB, by noise alone.
    guide : ndarray, shape (H, W, 3), float32
        Colours that the views are compared with, 0..1: those of the reference view.
    reference_detail : ndarray, shape (n or 0, W), int16
        Detail of these.
    edge : float
        Sum of the RGB differences that counts as an edge in the base of all of them.
    """

    colours: npt.NDArray[Any]
    colour_unit: np.float32
    detail: npt.NDArray[np.int16]
    detail_unit: np.float32
    low: int
    present: BoolMap
    t0: int
    s0: int
    noise: float
    guide: FloatMap
    reference_detail: npt.NDArray[np.int16]
    edge: float

    def scales2(self, parameters: BaseDetailParameters) -> FloatMap:
        """Squares of the robust scales of colours and of detail, widened by the noise; shape (2,), float32."""
        scales = parameters.colour_scale, parameters.detail_scale
        return np.array([scale**2 + self.noise for scale in scales], np.float32)


def base_detail_decomposition(
    light_field: LightField,
    parameters: BaseDetailParameters,
    rows: Rows | None = None,
    present: BoolMap | None = None,
    *,
    again: bool = False,
) -> BaseDetail:
    """Colours and detail of a light field; missing views stay empty.

    Parameters
    ----------
    light_field : LightField
    parameters : BaseDetailParameters
    rows : Rows, optional
        The rows whose detail is wanted; all unless given.
    present : ndarray, shape (T, S), bool, optional
        The views that are wanted; all that are present unless given.
    again : bool
        The same views will be needed again in other rows: compute and keep all rows if memory allows.

    Returns
    -------
    BaseDetail
    """
    views, guide = light_field.rgb_views, light_field.reference_view
    if rows is None or (again and _all_rows_fit(light_field)):
        rows = Rows(0, light_field.shape[0])
    present = light_field.present if present is None else present
    unit = np.float32(1 / full_scale(views.dtype))
    noise = reference_noise(light_field)
    detail, made = _detail_so_far(light_field, parameters, rows)
    missing = present & ~made
    edge = float(np.hypot(_EDGE, 3 * noise))
    if detail.size and missing.any():
        kernels.detail_of_views(views, float(unit), missing, rows.low, *_window(edge), DETAIL_UNIT, detail)
        made |= missing
    return BaseDetail(
        views,
        unit,
        detail,
        np.float32(DETAIL_UNIT),
        rows.low,
        present,
        *light_field.reference_position,
        variance_of_residuals(noise),
        guide,
        detail[light_field.reference_position],
        edge,
    )


def compared_with(views: BaseDetail, picture: FloatMap, parameters: BaseDetailParameters, rows: Rows) -> BaseDetail:
    """The same views, compared with a picture that has no noise in place of the reference view.

    Parameters
    ----------
    views : BaseDetail
    picture : ndarray, shape (H, W, 3), float32
        Seen from the reference view; colours, 0..1.
    parameters : BaseDetailParameters
    rows : Rows
        That the views' detail has.

    Returns
    -------
    BaseDetail
        Whose residuals have the noise of one view instead of two.
    """
    detail = views.reference_detail
    if parameters.use_detail:
        made, window = np.zeros((1, 1, *detail.shape), np.int16), _window(views.edge)
        kernels.detail_of_views(picture[None, None], 1.0, np.ones((1, 1), bool), rows.low, *window, DETAIL_UNIT, made)
        detail = made[0, 0]
    return views._replace(guide=picture, reference_detail=detail, noise=views.noise / 2)


def _window(edge: float) -> tuple[FloatMap, float]:
    """Weights of the bilateral filter by distance, and what it multiplies squared sums of differences with."""
    squared = np.arange(_RADIUS + 1) ** 2
    nearness = np.exp(-0.5 * (squared[:, None] + squared) / _WIDTH**2)
    return nearness.astype(np.float32), 1 / (64 * edge * edge)


def forget_detail(light_field: LightField) -> None:
    """Free the cached detail; it is recomputed on demand."""
    forget(light_field, "detail")


def _all_rows_fit(light_field: LightField) -> bool:
    """Whether there is memory for the detail of all views."""
    height, width = light_field.shape
    taken = np.dtype(np.int16).itemsize * int(light_field.present.sum()) * height * width
    return light_field.workspace is not None and taken <= light_field.workspace.detail_bytes


def _detail_so_far(
    light_field: LightField, parameters: BaseDetailParameters, rows: Rows
) -> tuple[npt.NDArray[np.int16], BoolMap]:
    """Array for the detail, with what is computed so far, and the views (T, S) that it has; the array may be empty."""
    height, width = light_field.shape
    shape = (*light_field.grid, (rows.high - rows.low) * parameters.use_detail, width)

    def nothing() -> tuple[npt.NDArray[np.int16], BoolMap]:
        # untouched pages take no memory
        return np.zeros(shape, np.int16), np.zeros(light_field.grid, bool)

    return kept(light_field, "detail", nothing) if parameters.use_detail and rows == (0, height) else nothing()


def reference_noise(light_field: LightField) -> float:
    """Noise of the reference view (:func:`sepi.image.noise.noise_of_reference_view`).

    For denoised views, the residue where there was only noise: it is smooth, so the mask would miss it.
    """
    if isinstance(light_field, DenoisedLightField):
        return LEFT * light_field.noise
    return noise_of_reference_view(light_field)
