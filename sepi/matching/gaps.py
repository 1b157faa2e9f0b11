"""Gaps between near surfaces, through which a farther surface shows.

A gap between two things shows another part of the wall behind in each view. If the wall's colours hardly change, all
views agree with a patch of such colours that fills the gap and moves with its borders. Once a map has that patch, it
occludes the wall in every view, and no later sweep can find the wall. So before a map is used for occlusion, patches
with the colours of something farther nearby are tried at its depth. They must fit much better there than at their own,
in the views in which nothing else occludes them.

Both depths are compared in the same views and pixels, so noise and slow colour changes count alike on either side.
"""

import cv2
import numpy as np
from pydantic import Field

from sepi.kernels import gaps as kernels
from sepi.lightfield import BoolMap, FloatMap, LightField, full_scale, without_reference
from sepi.matching.denoising import guide_of
from sepi.matching.nearest_surfaces import SeenViews
from sepi.matching.row_bands import row_bands
from sepi.stage import OcclusionMarginParameters

# of a pixel of a view: the z-buffer
_BYTES_PER_PIXEL = 4
# both depths are compared over so many pixels across and down, of which so many have to be asked: one may fit by chance
_WINDOW, _ASKED = 7, 9
# share of those pixels that has to fit better at the farther one, and of the views that have to see it
_MOST, _SEEING = 3 / 4, 1 / 8


class GapParameters(OcclusionMarginParameters):
    """Parameters of what is seen through gaps."""

    gaps: bool = Field(True, description="whether surfaces seen through gaps get a depth of their own")
    gap_step: float = Field(
        0.6, gt=0, description="least depth step from the gap's border to the surface behind, pixels per view step"
    )
    gap_reach: int = Field(
        32, ge=1, le=200, description="distance within which a farther surface of the same colour is searched, pixels"
    )
    gap_colour: float = Field(0.06, gt=0, le=2, description="largest RGB distance of the same colour, colours in 0..1")
    gap_gain: float = Field(0.5, gt=0, lt=1, description="share of squared residual that the farther depth may leave")


def with_open_gaps(
    light_field: LightField, disparity: FloatMap, present: BoolMap, parameters: GapParameters
) -> FloatMap:
    """Disparity map with the surfaces seen through gaps moved back to their depth.

    Parameters
    ----------
    light_field : LightField
    disparity : ndarray, shape (H, W), float32
        Pixels per view step.
    present : ndarray, shape (T, S), bool
        The views that are compared.
    parameters : GapParameters

    Returns
    -------
    ndarray, shape (H, W), float32
    """
    guide, reach = np.ascontiguousarray(guide_of(light_field)), parameters.gap_reach
    lowest = np.asarray(cv2.erode(disparity, np.ones((2 * reach + 1, 1), np.uint8)), np.float32)
    lowest = np.asarray(cv2.erode(lowest, np.ones((1, 2 * reach + 1), np.uint8)), np.float32)
    farther = np.empty_like(disparity)
    kernels.farther_alike(disparity, lowest, guide, reach, parameters.gap_step, parameters.gap_colour**2, farther)
    asked = farther != disparity
    if not asked.any():
        return disparity
    others = without_reference(light_field, present)
    there, here, seeing = compared_depths(light_field, disparity, farther, others, parameters.occlusion_margin)
    better = there < np.float32(parameters.gap_gain) * here
    # only in uniform colours: at edges, residuals come from interpolation
    voters = asked & _plain(guide, parameters.gap_colour)
    return np.where(asked & _outvoted(voters, better, seeing, int(others.sum())), farther, disparity)


def compared_depths(
    light_field: LightField,
    disparity: FloatMap,
    other: FloatMap,
    others: BoolMap,
    occlusion_margin: float,
    most: float = np.inf,
    occluders: FloatMap | None = None,
) -> FloatMap:
    """Squared residuals at two depths, in the views in which nothing occludes the second.

    Parameters
    ----------
    light_field : LightField
    disparity, other : ndarray, shape (H, W), float32
        Pixels per view step; where they are equal nothing is compared.
    others : ndarray, shape (T, S), bool
        The views that are asked; not the reference view.
    occlusion_margin : float
        By how much an occluder must be nearer, pixels per view step.
    most : float
        That the squared residual of one view counts.
    occluders : ndarray, shape (H, W), float32, optional
        The map of what may occlude the second; ``other`` unless given.

    Returns
    -------
    ndarray, shape (3, H, W), float32
        Sums of the squared residuals at ``other`` and at ``disparity``, colours in 0..1, each by the variance of its
        noise in units of a pixel's, and of how many views they are.
    """
    views = light_field.rgb_views
    depths, unit = (disparity, other, guide_of(light_field)), 1 / full_scale(views.dtype)
    sums = np.zeros((3, *disparity.shape), np.float32)
    farthest = float(max(np.abs(disparity).max(), np.abs(other).max()))
    for begin, end, rows in row_bands(light_field, others, farthest, _BYTES_PER_PIXEL):
        asked = SeenViews.of(light_field, other if occluders is None else occluders, others, rows, occlusion_margin)
        kernels.compare_depths(views, unit, *depths, asked, most, begin, end, sums)
    return sums


def _plain(guide: FloatMap, distance: float) -> BoolMap:
    """Pixels with whose neighbours no channel changes by ``distance``."""
    square = np.ones((3, 3), np.uint8)
    change = cv2.dilate(guide, square) - cv2.erode(guide, square)
    return np.asarray(np.max(cv2.split(change), axis=0) < np.float32(distance))


def _outvoted(voters: BoolMap, better: BoolMap, seeing: FloatMap, others: int) -> BoolMap:
    """Pixels with enough voters around, seen by enough views, most of which prefer the farther depth."""
    # sums of whole numbers: exact, in whatever order
    voting, about, seen = (
        cv2.boxFilter(values.astype(np.float32), -1, (_WINDOW, _WINDOW), normalize=False)
        for values in (voters & better, voters, voters * seeing)
    )
    enough = (about >= _ASKED) & (seen >= _SEEING * others * about)
    return np.asarray(enough & (voting > _MOST * about))
