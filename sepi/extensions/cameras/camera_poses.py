"""Poses and intrinsics of a light field's views as pinhole cameras, for other programs.

All cameras have the same viewing direction. Axes are those of computer vision: x to the right, y down, z forward; the
origin is the camera of the reference view. A view ``n`` view steps to the right of the reference view and ``m`` below
it is taken from ``(n b, m b, 0)`` with the baseline ``b``.

Cameras are sheared (:mod:`sepi.camera`): their sensors are shifted so that a point at the focus distance is at the same
pixel in all views. So each view has its own principal point. With the focal length ``f`` in pixels and the camera's
``offset`` (``b f / F``), a view ``N`` steps to the right of the *grid's centre view* has it at
``(W - 1) / 2 + N offset`` across, and likewise down. Projection into a view ``n`` steps from the reference view, itself
``n0`` from the centre view, then agrees with the conventions of :mod:`sepi.lightfield`::

    x' = (W - 1) / 2 + (n0 + n) offset + f (X - n b) / Z = x - n (b f / Z - offset) = x - n d

If the camera is unknown, focal length and focus distance are free: all choices give the same pixels, and shapes that
differ by a projective map. :func:`nominal_camera` makes one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from sepi.camera import Camera
from sepi.lightfield import BoolMap, FloatMap, LightField

Points = npt.NDArray[np.float64]

FOCAL_FACTOR = 1.2
"""Nominal focal length as a multiple of the picture's longer side, COLMAP's default."""

NEAREST, FARTHEST = 1.0, 2.0
"""Depth of the nearest and the farthest surface for a nominal camera, in its own units."""

# share of the pixels beyond each end of a map's range, so that a few wrong ones do not widen it
_BEYOND = 0.005


@dataclass(frozen=True)
class CameraPoses:
    """Pinhole cameras of the views that are present, row by row.

    Attributes
    ----------
    positions : ndarray, shape (N, 2), int64
        Grid position of each view, ``(t, s)``.
    baselines : ndarray, shape (N, 2), float64
        ``(down, across)`` from the reference view, in view steps.
    centres : ndarray, shape (N, 3), float64
        Position of each camera, x right, y down, z forward, from the reference view's; metres, or units of a nominal
        camera.
    principal_points : ndarray, shape (N, 2), float64
        ``(x, y)`` in pixels, the middle of the top left pixel being (0, 0).
    focal_px : float
        Common focal length in pixels.
    shape : (int, int)
        Height and width of a view.
    reference : int
        Number of the reference view.
    """

    positions: npt.NDArray[np.int64]
    baselines: Points
    centres: Points
    principal_points: Points
    focal_px: float
    shape: tuple[int, int]
    reference: int

    def __len__(self) -> int:
        return len(self.positions)

    @property
    def from_corner(self) -> Points:
        """Principal points ``(x, y)`` from the picture's corner, as in COLMAP and nerfstudio."""
        return self.principal_points + 0.5

    def project(self, points: Points, view: int) -> Points:
        """Pixels ``(y, x)`` at which a view sees points, shape (P, 2).

        Parameters
        ----------
        points : ndarray, shape (P, 3), float64
            In front of the cameras, with positive z.
        view : int
            Number of the camera.
        """
        seen = points - self.centres[view]
        across_down = self.principal_points[view] + self.focal_px * seen[:, :2] / seen[:, 2:]
        return np.asarray(across_down[:, ::-1], np.float64)

    def points_at(self, pixels: Points, depth: npt.NDArray[np.floating]) -> Points:
        """Points (P, 3) that the reference view sees at pixels ``(y, x)``, shape (P, 2), at depths of shape (P,)."""
        from_axis = (pixels[:, ::-1] - self.principal_points[self.reference]) / self.focal_px
        return np.column_stack([from_axis, np.ones(len(pixels))]) * np.asarray(depth, np.float64)[:, None]


def camera_poses(light_field: LightField, camera: Camera) -> CameraPoses:
    """The cameras of the views that are present, in the order of their rows.

    Parameters
    ----------
    light_field : LightField
    camera : Camera
        The light field's own, or a nominal one.
    """
    positions = np.argwhere(light_field.present)
    baselines = light_field.baselines[light_field.present]
    baseline = camera.scale / camera.focal_px
    height, width = light_field.shape
    from_centre = baselines + light_field.from_centre
    return CameraPoses(
        positions=positions,
        baselines=baselines,
        centres=np.column_stack([baselines[:, ::-1] * baseline, np.zeros(len(baselines))]),
        principal_points=np.array([width - 1, height - 1]) / 2
        + (camera.right, camera.down)
        + from_centre[:, ::-1] * camera.offset,
        focal_px=camera.focal_px,
        shape=(height, width),
        reference=int(np.flatnonzero((positions == light_field.reference_position).all(axis=1))[0]),
    )


def nominal_camera(disparity: FloatMap, known: BoolMap) -> Camera:
    """A nominal camera for a map without a known one.

    Its focal length is :data:`FOCAL_FACTOR` times the longer side of the picture. Baseline and focus distance put the
    nearest surface of the map at depth :data:`NEAREST` and the farthest at :data:`FARTHEST`, without half a per cent of
    the pixels at either end. So depth is neither in metres nor to scale.

    Parameters
    ----------
    disparity : ndarray, shape (H, W), float32
        Pixels per view step.
    known : ndarray, shape (H, W), bool
        Pixels that count.
    """
    values = disparity[known & np.isfinite(disparity)].astype(np.float64)
    low, high = np.quantile(values, (_BEYOND, 1 - _BEYOND)) if values.size else (0.0, 0.0)
    # any range for a single plane
    width = float(high - low) or 1.0
    # scale / (low + offset) is the farthest, scale / (low + width + offset) the nearest
    scale = width / (1 / NEAREST - 1 / FARTHEST)
    return Camera(scale, scale / FARTHEST - float(low), FOCAL_FACTOR * max(disparity.shape))
