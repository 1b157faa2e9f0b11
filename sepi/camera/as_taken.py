"""A rectified view's results at the pixels of the picture that its camera took, with rotation and distortion."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from sepi.camera import Camera
from sepi.camera.rig import Floats, Rig

if TYPE_CHECKING:
    from sepi.lightfield import FloatMap

# adjacent pixels whose disparities differ by more belong to two surfaces, with nothing between them
_ONE_SURFACE = 0.25


def as_taken(
    disparity: FloatMap,
    sigma: FloatMap | None,
    camera: Camera,
    rig: Rig,
    position: tuple[int, int],
    from_centre: tuple[float, float],
) -> list[FloatMap]:
    """Disparity, depth and, if it is known, the disparity's standard deviation, at the pixels that were taken.

    Parameters
    ----------
    disparity : ndarray, shape (H, W), float32
        Disparity of the rectified view, pixels per view step.
    sigma : ndarray, shape (H, W), float32, optional
        Its standard deviation.
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
    list of ndarray, shape (height, width of the picture), float32
        The disparity of the rectified view there, interpolated within a surface; NaN where the rectified view has no
        pixels. The depth along the camera's optical axis, units of the world; infinite at and beyond infinity. The
        standard deviation at the nearest pixel of the rectified view, not interpolated.
    """
    view, (height, width), (down, across) = rig.views[position], disparity.shape, from_centre
    lens = view.shot.lens
    pixels = np.stack(np.meshgrid(np.arange(lens.width), np.arange(lens.height)), axis=-1).reshape(-1, 2)
    # rays in the camera's own axes, and in those of the rectified views
    own = lens.rays(pixels.astype(np.float64))
    rays = own @ (view.shot.rotation @ rig.rotation.T)
    x = (width - 1) / 2 + camera.right + across * camera.offset
    y = (height - 1) / 2 + camera.down + down * camera.offset
    # NaN for rays backwards
    with np.errstate(divide="ignore", invalid="ignore"):
        flat = np.where(rays[:, 2:] > 0, rays[:, :2] / rays[:, 2:], np.nan)
        at = np.array([x, y]) + camera.focal_px * view.zoom * flat
        # positions beyond the middle of a border pixel belong to it
        inside = np.asarray(((at > -0.5) & (at < np.array([width, height]) - 0.5)).all(axis=1))
    within = np.clip(np.where(inside[:, None], at, 0), 0, (width - 1, height - 1))
    nearest = tuple(np.rint(within).astype(int).T[::-1])
    found = np.where(inside, _sampled(disparity, within, nearest), np.float32(np.nan)).astype(np.float32)
    # depth from the camera itself: along the viewing direction of rectified views, then along its own
    along = camera.depth(found).astype(np.float64) - float((view.shot.centre - rig.origin) @ rig.rotation[2])
    depth = np.where(np.isfinite(found), along * own[:, 2] / rays[:, 2], np.nan)
    maps = [found, depth, *([] if sigma is None else [np.where(inside, sigma[nearest], np.float32(np.nan))])]
    return [values.astype(np.float32).reshape(lens.height, lens.width) for values in maps]


def _sampled(values: FloatMap, within: Floats, nearest: tuple[npt.NDArray[np.int64], ...]) -> Floats:
    """Values at positions ``(x, y)`` in a picture, (N, 2): linear within a surface, else of the nearest pixel."""
    height, width = values.shape
    left, top = np.floor(within).astype(int).T
    right, below = np.minimum(left + 1, width - 1), np.minimum(top + 1, height - 1)
    four = np.stack([values[y, x] for y in (top, below) for x in (left, right)]).astype(np.float64)
    across, down = within.T - (left, top)
    above, beneath = (four[n] + across * (four[n + 1] - four[n]) for n in (0, 2))
    return np.where(np.ptp(four, axis=0) <= _ONE_SURFACE, above + down * (beneath - above), values[nearest])
