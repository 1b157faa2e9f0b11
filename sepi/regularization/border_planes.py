"""Planes of regions, from the disparities on their border, among planes through three pixels each (RANSAC [1]_).

An edge moves with the nearer of the two surfaces that meet there, so a region is nowhere nearer than its border: the
plane sought agrees with as much of the border as possible, while border that would lie *behind* it counts against it.
Border that is nearer belongs to what stands before the region.

References
----------
.. [1] Fischler, Bolles: Random Sample Consensus. CACM 1981. doi:10.1145/358669.358692
"""

import math
from dataclasses import dataclass
from typing import Self

import numpy as np
from pydantic import Field

from sepi.kernels import planes as kernels
from sepi.lightfield import BoolMap, FloatArray, FloatMap
from sepi.regularization.regions import Plane, basis_of
from sepi.stage import Parameters

_PIXELS_OF_A_PLANE = 12  # least to fit one to


def support(
    positions: FloatArray, values: FloatArray, planes: FloatArray, tolerance: float, behind_penalty: float
) -> FloatArray:
    """How many of N pixels agree with each of P planes, less a weight for each that lies behind it; (P,)."""
    places, levels, tried = (np.ascontiguousarray(each) for each in (positions.T, values, planes))
    found = np.empty(len(planes))
    kernels.support_of(places, levels, tried, tolerance, behind_penalty, found)
    return found


def _residuals(positions: FloatArray, values: FloatArray, plane: Plane) -> FloatArray:
    """By how much each of N values is above a plane, (N,)."""
    # term by term: the rounding of a matrix product depends on the number of threads
    return np.asarray(values - (plane[0] + plane[1] * positions[:, 1] + plane[2] * positions[:, 2]))


KNOWN_BORDER = 2.0
"""Pixels of border for each pixel of the side of a square of the region's area, from which it tells a plane: a quarter
of the shortest way round, two pixels wide."""


class BorderPlaneParameters(Parameters):
    """Parameters of planes by borders."""

    tolerance: float = Field(0.07, gt=0, description="largest distance of an inlier, pixels per view step")
    behind_penalty: float = Field(2.0, ge=0, description="penalty on border behind the plane, relative to inliers")
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
        """The plane that most of a border agrees with and little of it lies behind.

        The triples of pixels that planes are tried through do not depend on other regions, nor on which way the picture
        is mirrored.

        Parameters
        ----------
        border : ndarray, shape (h, w), bool
        disparity : ndarray, shape (h, w), float32
        parameters : BorderPlaneParameters

        Returns
        -------
        BorderPlane or None
            None where too little of the border agrees.
        """
        positions, values = basis_of(border), disparity[border].astype(np.float64)
        if len(values) < _PIXELS_OF_A_PLANE:
            return None
        # in the same order in a mirrored picture
        order = np.lexsort(((positions[:, 1:] ** 2).sum(axis=1), values))
        positions, values = positions[order], values[order]
        triples = np.random.default_rng(0).integers(len(values), size=(parameters.ransac_iterations, 3))
        triples = triples[np.abs(np.linalg.det(positions[triples])) > 1e-9]
        if not len(triples):
            return None
        planes = np.linalg.solve(positions[triples], values[triples, None])[..., 0]
        plane = planes[support(positions, values, planes, parameters.tolerance, parameters.behind_penalty).argmax()]
        agreeing = np.abs(_residuals(positions, values, plane)) < parameters.tolerance
        if agreeing.sum() < max(3, parameters.min_inlier_ratio * values.size):
            return None
        plane = np.asarray(np.linalg.lstsq(positions[agreeing], values[agreeing], rcond=None)[0], np.float64)
        agreeing = np.abs(_residuals(positions, values, plane)) < parameters.tolerance
        return cls(plane, values.size, float(agreeing.mean()))
