"""A rectified view's results at the pixels of the picture that its camera took, with rotation and distortion."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from sepi.camera import Camera
from sepi.camera.rig import Floats, Rectified, Rig

if TYPE_CHECKING:
    from sepi.lightfield import FloatMap

# adjacent pixels whose disparities differ by more belong to two surfaces, with nothing between them
_ONE_SURFACE = 0.25


def as_taken(
    disparity: FloatMap,
    camera: Camera,
    rig: Rig,
    position: tuple[int, int],
    from_centre: tuple[float, float],
) -> tuple[FloatMap, FloatMap]:
    """Disparity and depth at the pixels of the picture that was taken.

    Parameters
    ----------
    disparity : ndarray, shape (H, W), float32
        Disparity of the rectified view, pixels per view step.
    camera : Camera
        Camera of the light field.
    rig : Rig
        With any rectified view at its origin.
    position : (int, int)
        Position of the view in the grid.
    from_centre : (float, float)
        Baseline (down, across) from the grid's centre view to the view, in view steps.

    Returns
    -------
    disparity : ndarray, shape (height, width of the picture), float32
        That of the rectified view there, interpolated within a surface; NaN where the rectified view has no pixels.
    depth : ndarray, of the same shape, float32
        Along the camera's optical axis, units of the world; infinite at and beyond infinity.
    """
    view = rig.views[position]
    lens = view.shot.lens
    own, rays = _rays(view, rig)
    found = _sampled(disparity, _places(disparity.shape, camera, view, rays, from_centre))
    # depth from the camera itself: along the viewing direction of rectified views, then along its own
    along = camera.depth(found).astype(np.float64) - _ahead(view, rig)
    depth = np.where(np.isfinite(found), along * own[:, 2] / rays[:, 2], np.nan)
    shape = lens.height, lens.width
    return found.reshape(shape), depth.astype(np.float32).reshape(shape)


def sigma_as_taken(
    sigma: FloatMap,
    camera: Camera,
    rig: Rig,
    position: tuple[int, int],
    from_centre: tuple[float, float],
) -> FloatMap:
    """Standard deviation of the disparity at the pixels of the picture that was taken; arguments as :func:`as_taken`.

    Returns
    -------
    ndarray, shape (height, width of the picture), float32
        That of the nearest pixel of the rectified view, not interpolated; NaN where the rectified view has no pixels.
    """
    view = rig.views[position]
    _, rays = _rays(view, rig)
    inside, within = _inside(sigma.shape, _places(sigma.shape, camera, view, rays, from_centre))
    found = np.where(inside, _nearest(sigma, within), np.float32(np.nan))
    return found.astype(np.float32).reshape(view.shot.lens.height, view.shot.lens.width)


def _rays(view: Rectified, rig: Rig) -> tuple[Floats, Floats]:
    """Ray directions of a camera's pixels, row by row, (N, 3): in its own axes, and in those of the rectified views."""
    lens = view.shot.lens
    pixels = np.stack(np.meshgrid(np.arange(lens.width), np.arange(lens.height)), axis=-1).reshape(-1, 2)
    own = lens.rays(pixels.astype(np.float64))
    return own, own @ (view.shot.rotation @ rig.rotation.T)


def _places(
    shape: tuple[int, ...], camera: Camera, view: Rectified, rays: Floats, from_centre: tuple[float, float]
) -> Floats:
    """Positions ``(x, y)`` of rays in a rectified view of ``shape``, (N, 2); NaN for rays backwards."""
    with np.errstate(divide="ignore", invalid="ignore"):
        flat = np.where(rays[:, 2:] > 0, rays[:, :2] / rays[:, 2:], np.nan)
    return _principal(shape, camera, from_centre) + camera.focal_px * view.zoom * flat


def _principal(shape: tuple[int, ...], camera: Camera, from_centre: tuple[float, float]) -> Floats:
    """Principal point ``(x, y)`` of a rectified view of ``shape``."""
    (height, width), (down, across) = shape, from_centre
    x = (width - 1) / 2 + camera.right + across * camera.offset
    y = (height - 1) / 2 + camera.down + down * camera.offset
    return np.array([x, y])


def _ahead(view: Rectified, rig: Rig) -> float:
    """Distance of a camera in front of the plane of the views."""
    return float((view.shot.centre - rig.origin) @ rig.rotation[2])


def _sampled(values: FloatMap, at: Floats) -> FloatMap:
    """Values at positions ``(x, y)``, (N, 2): linear within a surface, else of the nearest pixel; NaN outside."""
    height, width = values.shape
    inside, within = _inside(values.shape, at)
    left, top = np.floor(within).astype(int).T
    right, below = np.minimum(left + 1, width - 1), np.minimum(top + 1, height - 1)
    four = np.stack([values[y, x] for y in (top, below) for x in (left, right)]).astype(np.float64)
    across, down = within.T - (left, top)
    above, beneath = (four[n] + across * (four[n + 1] - four[n]) for n in (0, 2))
    linear = above + down * (beneath - above)
    found = np.where(np.ptp(four, axis=0) <= _ONE_SURFACE, linear, _nearest(values, within))
    return np.where(inside, found, np.float32(np.nan)).astype(np.float32)


def _inside(shape: tuple[int, ...], at: Floats) -> tuple[npt.NDArray[np.bool_], Floats]:
    """Mask of positions ``(x, y)``, (N, 2), inside a picture, and positions limited to its outer pixels' middles."""
    height, width = shape
    # positions beyond the middle of a border pixel belong to it
    with np.errstate(invalid="ignore"):
        inside = np.asarray(((at > -0.5) & (at < np.array([width, height]) - 0.5)).all(axis=1))
    return inside, np.clip(np.where(inside[:, None], at, 0), 0, (width - 1, height - 1))


def _nearest(values: FloatMap, within: Floats) -> FloatMap:
    """Values of the pixels nearest to positions in the picture, (N,)."""
    return np.asarray(values[tuple(np.rint(within).astype(int).T[::-1])])
