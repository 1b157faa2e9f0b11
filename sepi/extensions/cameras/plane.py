"""The plane through the cameras: their common axes, and their positions in view steps and on a grid."""

import numpy as np
import numpy.typing as npt

from sepi.camera.rig import Floats
from sepi.errors import SepiError
from sepi.extensions.cameras.model import CameraModel, require_sideways

# extent of the cameras' positions across a row, relative to that along it, from which the plane's slope is known
_ROW = 0.02


class Plane:
    """The plane through the cameras by least squares, and their positions in the axes of the rectified views.

    Parameters
    ----------
    model : CameraModel
    reference : int or None
        Number of the reference camera; None: the most central one.

    Attributes
    ----------
    rotation : ndarray, shape (3, 3), float64
        From the world's axes to those of the views: x and y in the plane, z along the viewing direction.
    places : ndarray, shape (N, 3), float64
        Positions from the reference camera, in these axes and the world's units.
    reference : int
    step : float
        Median distance from a camera to the next, in the plane.
    baselines : ndarray, shape (N, 2), float64
        ``(down, across)`` of each camera from the reference camera, in view steps.

    Raises
    ------
    SepiError
        If the cameras move along their viewing direction instead of sideways.
    """

    def __init__(self, model: CameraModel, reference: int | None) -> None:
        off = model.centres - model.centres.mean(axis=0)
        looking = _unit(model.axes.mean(axis=0))
        ahead = off @ looking
        beside = off - ahead[:, None] * looking
        # the plane's slope, damped, since cameras in a row do not determine it across the row
        damping = len(off) * (_ROW * np.linalg.norm(np.ptp(off, axis=0))) ** 2
        slope = np.linalg.solve(beside.T @ beside + damping * np.eye(3), beside.T @ ahead)
        # medians, since a single camera off the plane is left out later
        angle = np.degrees(np.arctan2(np.median(np.linalg.norm(beside, axis=1)), np.median(np.abs(ahead))))
        require_sideways(model.path, angle)
        z = _unit(looking - slope)
        right = np.mean([shot.rotation[0] for shot in model.shots], axis=0)
        x = _unit(right - z * (right @ z))
        self.rotation = np.stack([x, np.cross(z, x), z])
        flat = off @ self.rotation.T
        if reference is None:
            centre = (flat[:, :2].max(axis=0) + flat[:, :2].min(axis=0)) / 2
            # the first of equally central ones, up to rounding
            distance = np.linalg.norm(flat[:, :2] - centre, axis=1)
            reference = int(np.flatnonzero(distance <= distance.min() + 1e-6 * float(np.ptp(flat[:, :2])))[0])
        self.reference, self.places, self.step = reference, flat - flat[reference], _median_step(flat[:, :2])
        if self.step <= 0:
            raise SepiError(f"{model.path}: the cameras stand one behind the other; expected them side by side")
        self.baselines = self.places[:, 1::-1] / self.step


def _median_step(places: Floats) -> float:
    """Median distance of cameras along x in a row, along y without rows; to the nearest without a grid."""
    apart = np.linalg.norm(places[:, None] - places[None], axis=2)
    np.fill_diagonal(apart, np.inf)
    step = float(np.median(apart.min(axis=1)))
    if step <= 0:
        return step
    at = grid_of(places[:, ::-1] / step)
    for axis in (1, 0):
        ahead = at[None] - at[:, None]
        here, there = np.nonzero((ahead[..., axis] == 1) & (ahead[..., 1 - axis] == 0))
        along = places[there, 1 - axis] - places[here, 1 - axis]
        if len(along) and np.median(along) > 0:
            return float(np.median(along))
    return step


def _unit(vector: Floats) -> Floats:
    return np.asarray(vector / np.linalg.norm(vector), np.float64)


# least share of a grid's places with a camera
_FULL = 0.55
# largest row spacing in view steps, and sampling of the spacings tried
_SPACINGS = np.geomspace(0.25, 4.0, 161)
# largest mean distance of cameras from a grid's places, relative to its steps; random positions have 0.25
_NEAR = 0.19
_NO_WORSE = 0.02


def grid_of(baselines: Floats) -> npt.NDArray[np.int64]:
    """Row and column (N, 2) of each view, counted from 0, given the baselines ``(down, across)`` in view steps.

    The regular grid near which the cameras stand; without one, a single row in the order of their positions.
    """
    row, column = (_numbers(baselines[:, axis]) for axis in (0, 1))
    if row is not None and column is not None:
        at = np.column_stack([row, column])
        taken = len(np.unique(at, axis=0))
        if taken == len(at) and taken >= _FULL * (at.max(axis=0) + 1).prod():
            return at
    # along the longer axis, or the cameras' path
    down, across = baselines.T
    order = np.lexsort((across, down) if np.ptp(down) > np.ptp(across) else (down, across))
    at = np.zeros((len(order), 2), np.int64)
    at[order, 1] = np.arange(len(order))
    return at


def _numbers(along: Floats) -> npt.NDArray[np.int64] | None:
    """Number of each camera's step along an axis, from 0; None without regular steps."""
    if np.ptp(along) < _SPACINGS[0]:
        return np.zeros(len(along), np.int64)
    angle = 2 * np.pi * along / _SPACINGS[:, None]
    first = np.angle(np.exp(1j * angle).mean(axis=1)) / (2 * np.pi)
    steps = along / _SPACINGS[:, None] - first[:, None]
    stray = np.abs(steps - np.rint(steps)).mean(axis=1)
    padded = np.pad(stray, 1, constant_values=1.0)
    lowest = (stray <= padded[:-2]) & (stray <= padded[2:]) & (stray < min(_NEAR, stray.min() + _NO_WORSE))
    if not lowest.any():
        return None
    # a finer grid fits as well
    numbers = np.rint(steps[np.flatnonzero(lowest)[-1]]).astype(np.int64)
    return numbers - numbers.min() if np.ptp(numbers) else None
