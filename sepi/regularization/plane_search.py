"""The plane that most pixels of a set lie on, among planes through three of them each (RANSAC [1]_).

References
----------
.. [1] Fischler, Bolles: Random Sample Consensus. CACM 1981. doi:10.1145/358669.358692
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from sepi.kernels import planes as kernels
from sepi.lightfield import BoolMap, FloatMap
from sepi.regularization.regions import Plane, basis_of

_PIXELS_OF_A_PLANE = 12  # least to fit one to

_Doubles = npt.NDArray[np.float64]


def pixels_in_order(pixels: BoolMap, disparity: FloatMap) -> tuple[_Doubles, _Doubles]:
    """1, x and y of some pixels, (N, 3), and their disparities; in the same order in a mirrored picture."""
    positions, values = basis_of(pixels), disparity[pixels].astype(np.float64)
    order = np.lexsort(((positions[:, 1:] ** 2).sum(axis=1), values))
    return positions[order], values[order]


def planes_through(positions: _Doubles, values: _Doubles, tried: int) -> _Doubles:
    """At most so many planes through three pixels each, (P, 3); none for too few pixels.

    The same ones every time, whatever else is asked.
    """
    if len(values) < _PIXELS_OF_A_PLANE:
        return np.empty((0, 3))
    triples = np.random.default_rng(0).integers(len(values), size=(tried, 3))
    triples = triples[np.abs(np.linalg.det(positions[triples])) > 1e-9]
    return np.asarray(np.linalg.solve(positions[triples], values[triples, None])[..., 0])


def support(
    positions: _Doubles, values: _Doubles, planes: _Doubles, tolerance: float, behind_penalty: float
) -> _Doubles:
    """How many of N pixels agree with each of P planes, less a weight for each that lies behind it; (P,)."""
    places, levels, tried = (np.ascontiguousarray(each) for each in (positions.T, values, planes))
    found = np.empty(len(planes))
    kernels.support_of(places, levels, tried, tolerance, behind_penalty, found)
    return found


def fitted(positions: _Doubles, values: _Doubles, plane: Plane, tolerance: float) -> Plane:
    """The plane fitted to what agrees with a plane."""
    agreeing = abs(residuals_of(positions, values, plane[None])[0]) < tolerance
    return np.asarray(np.linalg.lstsq(positions[agreeing], values[agreeing], rcond=None)[0])


def residuals_of(positions: _Doubles, values: _Doubles, planes: _Doubles) -> _Doubles:
    """By how much each of N values is above each of P planes, (P, N)."""
    a, b, c = planes.T[..., None]
    # term by term: the rounding of a matrix product depends on the number of threads
    return np.asarray(values - (a + b * positions[:, 1] + c * positions[:, 2]))
