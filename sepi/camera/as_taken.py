"""A rectified view's results at the pixels of the picture that its camera took, with rotation and distortion."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sepi.camera import Camera
from sepi.camera.rig import Floats, Rig

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
    sigma: FloatMap | None = None,
) -> list[FloatMap]:
    """Disparity and depth at the pixels of the picture that was taken, and the error of the disparity if it is given.

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
    sigma : ndarray, shape (H, W), float32, optional
        Standard deviation of the disparity.

    Returns
    -------
    disparity : ndarray, shape (height, width of the picture), float32
        That of the rectified view there, interpolated within a surface; NaN where the rectified view has no pixels.
    depth : ndarray, of the same shape, float32
        Along the camera's optical axis, units of the world; infinite at and beyond infinity.
    sigma : ndarray, of the same shape, float32
        That of the nearest pixel of the rectified view, not interpolated.
    """
    shot, (height, width), (down, across) = rig.views[position], disparity.shape, from_centre
    # rays of the picture's pixels, in the camera's own axes and in those of the rectified views
    pixels = np.stack(np.meshgrid(np.arange(shot.lens.width), np.arange(shot.lens.height)), axis=-1).reshape(-1, 2)
    own = shot.lens.rays(pixels.astype(np.float64))
    rays = own @ (shot.rotation @ rig.rotation.T)
    x = (width - 1) / 2 + camera.right + across * camera.offset
    y = (height - 1) / 2 + camera.down + down * camera.offset
    with np.errstate(divide="ignore", invalid="ignore"):
        flat = np.where(rays[:, 2:] > 0, rays[:, :2] / rays[:, 2:], np.nan)
        at = np.array([x, y]) + camera.focal_px * shot.zoom * flat
        # positions beyond the middle of a border pixel belong to it
        inside = np.asarray(((at > -0.5) & (at < np.array([width, height]) - 0.5)).all(axis=1))
    within = np.clip(np.where(inside[:, None], at, 0), 0, (width - 1, height - 1))
    found = np.where(inside, _sampled(disparity, within), np.float32(np.nan)).astype(np.float32)
    # depth from the camera itself: along the viewing direction of rectified views, then along its own
    along = camera.depth(found).astype(np.float64) - float((shot.centre - rig.origin) @ rig.rotation[2])
    maps = [found, np.where(np.isfinite(found), along * own[:, 2] / rays[:, 2], np.nan)]
    if sigma is not None:
        maps.append(np.where(inside, _nearest(sigma, within), np.nan))
    return [values.astype(np.float32).reshape(shot.lens.height, shot.lens.width) for values in maps]


def _sampled(values: FloatMap, within: Floats) -> Floats:
    """Values at positions ``(x, y)`` in the picture, (N, 2): linear within a surface, else of the nearest pixel."""
    height, width = values.shape
    left, top = np.floor(within).astype(int).T
    right, below = np.minimum(left + 1, width - 1), np.minimum(top + 1, height - 1)
    four = np.stack([values[y, x] for y in (top, below) for x in (left, right)]).astype(np.float64)
    across, down = within.T - (left, top)
    above, beneath = (four[n] + across * (four[n + 1] - four[n]) for n in (0, 2))
    linear = above + down * (beneath - above)
    return np.where(np.ptp(four, axis=0) <= _ONE_SURFACE, linear, _nearest(values, within))


def _nearest(values: FloatMap, within: Floats) -> FloatMap:
    """Values of the pixels nearest to positions in the picture, (N,)."""
    return np.asarray(values[tuple(np.rint(within).astype(int).T[::-1])])
