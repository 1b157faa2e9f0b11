"""Cubic splines of the views, kept from stage to stage: colours are made once for planes and refinement."""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from sepi.kernels import splines as kernels
from sepi.lightfield import BoolMap, FloatMap, LightField
from sepi.matching.base_detail import BaseDetailParameters, base_detail_decomposition, forget_detail
from sepi.matching.row_bands import Rows
from sepi.process.workspace import forget, kept

SPLINE_UNIT = np.float32(1 / 3400)
"""Unit of the spline coefficients, stored as int16; a checkerboard of -0.5 and 1.5 has some of +-9.5."""

MARGIN: int = kernels.MARGIN
"""Coefficients beyond each side of a view."""


class SplineViews(NamedTuple):
    """The data of the views, or of some of their rows, that a Gauss-Newton iteration needs.

    Attributes
    ----------
    splines : ndarray, shape (T, S, n + 4, W + 4, 4), int16
        Spline coefficients of colours and detail (``kernels/splines.cpp``), with a margin; zero where the detail has
        no share.
    unit : float32
        What they are multiplied with.
    reference : ndarray, shape (H, W, 4), float32
        Colours and detail of the reference view.
    scales2, shares : ndarray, shape (2,), float32
        Square of the robust scale, and share in the cost, of colours and of detail.
    """

    splines: npt.NDArray[np.int16]
    unit: np.float32
    reference: FloatMap
    scales2: FloatMap
    shares: FloatMap


def spline_views(
    light_field: LightField, parameters: BaseDetailParameters, rows: Rows, present: BoolMap
) -> SplineViews:
    """Splines of some rows of the views' colours and, where it has a share, detail.

    Parameters
    ----------
    light_field : LightField
    parameters : BaseDetailParameters
    rows : Rows
    present : ndarray, shape (T, S), bool
        The views of which they are wanted.

    Returns
    -------
    SplineViews
    """
    height, width = light_field.shape
    # what the convolution reaches; mirrored at the picture's ends
    reach = MARGIN + kernels.REACH
    wider = Rows(max(0, min(rows.low - reach, height - reach - 1)), min(height, rows.high + reach + 1))
    splines, made = _splines_so_far(light_field, parameters, rows)
    colours, detail = missing = np.stack([present, present & parameters.use_detail]) & ~made
    reference = light_field.reference_position
    wanted = detail.copy()
    # which is compared with the mean
    wanted[reference] = True
    views = base_detail_decomposition(light_field, parameters, wider, wanted, again=True)
    colour_unit, detail_unit = float(views.colour_unit / SPLINE_UNIT), float(views.detail_unit / SPLINE_UNIT)
    kernels.view_splines(
        views.colours, colour_unit, views.detail, detail_unit, views.low, colours, detail, rows.low, splines
    )
    made |= missing
    own = np.zeros((height, width, 4), np.float32)
    own[..., :3] = views.guide
    if views.detail.size:
        own[views.low : views.low + views.detail.shape[2], :, 3] = views.detail[reference] * views.detail_unit
    if rows == (0, height) and parameters.use_detail and (present == light_field.present).all():
        # the splines of all views take its place
        forget_detail(light_field)
    return SplineViews(splines, SPLINE_UNIT, own, views.scales2(parameters), parameters.shares)


def forget_splines(light_field: LightField) -> None:
    """Free the cached splines; they are recomputed on demand."""
    forget(light_field, "splines")


def _splines_so_far(
    light_field: LightField, parameters: BaseDetailParameters, rows: Rows
) -> tuple[npt.NDArray[np.int16], BoolMap]:
    """Array for splines, with those computed so far, and the views (2, T, S) of which it has colours, and detail."""
    height, width = light_field.shape
    shape = (*light_field.grid, rows.high - rows.low + 2 * MARGIN, width + 2 * MARGIN, 4)

    def nothing() -> tuple[npt.NDArray[np.int16], BoolMap]:
        # untouched pages take no memory
        return np.zeros(shape, np.int16), np.zeros((2, *light_field.grid), bool)

    if rows != (0, height):
        return nothing()
    # callers without detail expect its channel to be empty
    if not parameters.use_detail and kept(light_field, "splines", nothing)[1][1].any():
        forget_splines(light_field)
    return kept(light_field, "splines", nothing)
