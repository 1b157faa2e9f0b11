"""Planes of regions, from the disparities on their border.

An edge moves with the nearer of the two surfaces that meet there, so a region is nowhere nearer than its border: the
plane sought agrees with as much of the border as possible, while border that would lie *behind* it counts against it.
Border that is nearer belongs to what stands before the region.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Self

import numpy as np
from pydantic import Field

from sepi.lightfield import BoolMap, FloatMap
from sepi.regularization.plane_search import fitted, pixels_in_order, planes_through, residuals_of, support
from sepi.regularization.regions import Plane, basis_of
from sepi.stage import Parameters

KNOWN_BORDER = 2.0
"""Pixels of border for each pixel of the side of a square of the region's area, from which it tells a plane: a quarter
of the shortest way round, two pixels wide."""


class BorderPlaneParameters(Parameters):
    """Parameters of planes by borders."""

    tolerance: float = Field(0.05, gt=0, description="largest distance of an inlier, pixels per view step")
    behind_penalty: float = Field(
        2.0, ge=0, description="penalty on border pixels behind the plane, relative to inliers"
    )
    min_inlier_ratio: float = Field(0.25, ge=0, le=1, description="least share of inliers in the border")
    ransac_iterations: int = Field(500, ge=1, description="number of planes that are tried for each region")


@dataclass(frozen=True)
class BorderPlane:
    """Plane that a region's border supports.

    Attributes
    ----------
    plane : Plane
    pixels : int
        Of the border.
    share : float
        Of them that agree with the plane.
    """

    plane: Plane
    pixels: int
    share: float

    def is_known(self, area: int) -> bool:
        """Whether it is on enough of the way round a region of so many pixels: from one side it leads anywhere."""
        return self.pixels >= KNOWN_BORDER * math.sqrt(area)

    def is_one_plane(self, area: int) -> bool:
        """Whether most of a border agrees that is known on enough of the way round."""
        return self.is_known(area) and self.share >= 0.5

    @classmethod
    def of(cls, border: BoolMap, disparity: FloatMap, parameters: BorderPlaneParameters) -> Self | None:
        """That of :func:`ransac_plane`, and how much of the border agrees."""
        plane = ransac_plane(border, disparity, parameters)
        if plane is None:
            return None
        residuals = residuals_of(basis_of(border), disparity[border].astype(np.float64), plane[None])[0]
        return cls(plane, residuals.size, float((np.abs(residuals) < parameters.tolerance).mean()))


def ransac_plane(border: BoolMap, disparity: FloatMap, parameters: BorderPlaneParameters) -> Plane | None:
    """Plane that most of a border agrees with and little of it lies behind.

    The triples of pixels that planes are tried through do not depend on other regions, nor on which way the picture is
    mirrored.

    Parameters
    ----------
    border : ndarray, shape (h, w), bool
    disparity : ndarray, shape (h, w), float32
    parameters : BorderPlaneParameters

    Returns
    -------
    Plane or None
        None where too little of the border agrees.
    """
    positions, values = pixels_in_order(border, disparity)
    planes = planes_through(positions, values, parameters.ransac_iterations)
    if not len(planes):
        return None
    plane = planes[support(positions, values, planes, parameters.tolerance, parameters.behind_penalty).argmax()]
    agreeing = abs(residuals_of(positions, values, plane[None])[0]) < parameters.tolerance
    if agreeing.sum() < max(3, parameters.min_inlier_ratio * values.size):
        return None
    return fitted(positions, values, plane, parameters.tolerance)
