"""Planes of regions by what lies on their border.

An edge moves with the nearer of the two surfaces that meet there, so a region is nowhere nearer than its border: the
plane sought agrees with as much of the border as possible, while border that would lie *behind* it counts against it.
Border that is nearer belongs to what stands before the region.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np
import numpy.typing as npt
from pydantic import Field

from sepi.lightfield import BoolMap, FloatMap
from sepi.regularization.regions import Plane, basis_of
from sepi.stage import Parameters

KNOWN_BORDER = 2.0
"""Pixels of border for each pixel of the side of a square of the region's area, from which it tells whether it is one
plane: a quarter of the shortest way round, two pixels wide."""

# residuals that are computed at once: enough to save calls, few enough for the cache
_AT_ONCE = 2**17
_PIXELS_OF_A_PLANE = 12  # least border to fit one to


class BorderPlaneParameters(Parameters):
    """Parameters of planes by borders."""

    tolerance: float = Field(0.05, gt=0, description="distance from the plane of what agrees, pixels per view step")
    behind_penalty: float = Field(
        2.0, ge=0, description="weight of border behind the plane against border that agrees with it"
    )
    min_inlier_ratio: float = Field(0.25, ge=0, le=1, description="share of the border without which there is no plane")
    ransac_iterations: int = Field(500, ge=1, description="planes tried for each region")


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

    def is_one_plane(self, area: int) -> bool:
        """Whether most of a border agrees that is known on enough of the way round a region of so many pixels."""
        return self.pixels >= KNOWN_BORDER * area**0.5 and self.share >= 0.5

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
    values = disparity[border].astype(np.float64)
    if values.size < _PIXELS_OF_A_PLANE:
        return None
    positions = basis_of(border)
    order = np.lexsort(((positions[:, 1:] ** 2).sum(axis=1), values))
    positions, values = positions[order], values[order]
    triples = np.random.default_rng(0).integers(values.size, size=(parameters.ransac_iterations, 3))
    triples = triples[np.abs(np.linalg.det(positions[triples])) > 1e-9]
    planes = np.linalg.solve(positions[triples], values[triples, None])[..., 0]
    if not len(planes):
        return None
    parts = np.array_split(planes, -(-len(planes) * values.size // _AT_ONCE))
    scores = np.concatenate([_scores(positions, values, part, parameters) for part in parts])
    chosen = abs(residuals_of(positions, values, planes[scores.argmax(), None])[0]) < parameters.tolerance
    if chosen.sum() < max(3, parameters.min_inlier_ratio * values.size):
        return None
    return np.asarray(np.linalg.lstsq(positions[chosen], values[chosen], rcond=None)[0])


def _scores(
    positions: npt.NDArray[np.float64],
    values: npt.NDArray[np.float64],
    planes: npt.NDArray[np.float64],
    parameters: BorderPlaneParameters,
) -> npt.NDArray[np.float64]:
    """How much of a border agrees with each of some planes (P, 3), less what lies behind it."""
    residual = residuals_of(positions, values, planes)
    agreeing = (abs(residual) < parameters.tolerance).sum(axis=1)
    behind = (residual < -parameters.tolerance).sum(axis=1)
    return np.asarray(agreeing - parameters.behind_penalty * behind)


def residuals_of(
    positions: npt.NDArray[np.float64], values: npt.NDArray[np.float64], planes: npt.NDArray[np.float64]
) -> npt.NDArray[np.float64]:
    """By how much each of N values is above each of P planes, (P, N)."""
    a, b, c = planes.T[..., None]
    # term by term: a product of matrices rounds as the number of threads has it
    return np.asarray(values - (a + b * positions[:, 1] + c * positions[:, 2]))
