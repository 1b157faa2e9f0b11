"""A coloured point cloud from a disparity map, and its PLY file, which all 3-D viewers read.

Axes are those of PLY viewers: x to the right, y up, z towards the viewer, so that the scene lies at negative z and
shows upright and the right way round. The origin is the camera of the view that the disparity map belongs to.

With a camera, positions are in metres. The cameras are parallel and a baseline apart; their images are shifted so that
a point at the focus distance has the same pixel in all of them (:mod:`sepi.camera`). The shift moves the principal
point: in the grid's centre view it is the middle of the image ``(cx, cy)``, and in a view ``n`` view steps to its right
``cx + n * offset``, with the camera's ``offset`` in pixels per view step. So pixel ``(y, x)`` at depth ``Z`` is the
point ::

    X = (x - cx - n * offset) * Z / focal_px        Y = (y - cy - m * offset) * Z / focal_px

for a view ``n`` view steps to the right of and ``m`` below the centre view; X to the right and Y down, in metres.

Without a camera, the cloud is a relief: x and y in pixels from the middle, z the disparity, stretched so that its range
is a third of the image width. A relief does not have the proportions of the scene.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from types import NoneType
from typing import Any

import numpy as np
import numpy.typing as npt

from sepi.camera import Camera
from sepi.camera.rig import WORLD, Rig
from sepi.errors import SepiError
from sepi.io.files import atomic_path
from sepi.lightfield import BoolMap, FloatMap
from sepi.validation import require_map, require_path, require_type

Colours = npt.NDArray[np.uint8]
View = npt.NDArray[np.generic]

# depth of a relief as a share of the image width, and the share of pixels beyond each end of its range, so that a few
# outliers do not flatten it
_RELIEF = 1 / 3
_BEYOND = 0.005

_AXES = "x right, y up, z towards the viewer"


@dataclass(frozen=True)
class PointCloud:
    """Coloured points.

    Attributes
    ----------
    positions : ndarray, shape (N, 3), float32
        x to the right, y up, z towards the viewer.
    colours : ndarray, shape (N, 3), uint8
        RGB.
    metric : bool
        Whether positions are in metres; otherwise x and y are pixels and z is ``stretch`` times the disparity.
    stretch : float
        Pixels per unit of disparity of a relief; 1 for a metric cloud.
    units : str or None
        Units of the world of the calibrated cameras, in whose axes the points are; None: axes are as above.
    sigma : ndarray, shape (N,), float32, or None
        Standard deviation of each point: of its depth in a metric cloud, in the cloud's unit; of its disparity in a
        relief, in pixels per view step. None if unknown.

    Examples
    --------
    A cloud of one red point two metres before the camera:

    >>> import numpy as np
    >>> from sepi.io.point_cloud import PointCloud
    >>> cloud = PointCloud(np.float32([[0, 0, -2]]), np.uint8([[255, 0, 0]]), metric=True)
    >>> cloud.comments()
    ('x right, y up, z towards the viewer', 'metres; origin: camera of the view')
    """

    positions: npt.NDArray[np.float32]
    colours: Colours
    metric: bool
    stretch: float = 1.0
    units: str | None = None
    sigma: FloatMap | None = None

    def comments(self) -> tuple[str, ...]:
        """Axes and units, for the file's header.

        Returns
        -------
        tuple of str
            Axes, units, and the unit of ``sigma`` if there is one.
        """
        sigma = f"sigma: standard deviation of the depth along the viewing direction, {self.units or 'metres'}"
        lines = _AXES, "metres; origin: camera of the view"
        if self.units is not None:
            lines = WORLD, self.units
        elif not self.metric:
            units = f"x and y: pixels from the middle; z: disparity (pixels per view step) times {self.stretch!r}"
            lines, sigma = (_AXES, units), "sigma: standard deviation of the disparity, pixels per view step"
        return lines if self.sigma is None else (*lines, sigma)


def point_cloud(
    picture: View,
    disparity: FloatMap,
    confidence: FloatMap | None = None,
    *,
    camera: Camera | None = None,
    from_centre: tuple[float, float] = (0, 0),
    min_confidence: float = 0.0,
    max_depth: float | None = None,
    step: int = 1,
    unknown: BoolMap | None = None,
    rig: Rig | None = None,
    sigma: FloatMap | None = None,
    max_sigma: float | None = None,
) -> PointCloud:
    """Point cloud of one view; pixels without a finite disparity, and those at or beyond infinity, have no point.

    With a camera, pixel ``(y, x)`` of depth ``Z`` becomes the point ``(X, -Y, -Z)`` in metres, with
    ``X = (x - cx - n offset) Z / focal_px`` and ``Y = (y - cy - m offset) Z / focal_px``. The middle of the image is
    ``(cx, cy)``, and the view is ``n`` view steps to the right of the centre view and ``m`` below it. Without a camera,
    x and y are pixels from the middle, and z is the disparity, stretched to a third of the image width.

    Parameters
    ----------
    picture : ndarray, shape (H, W, C), uint8, uint16 or float
        The view; C is 1 or 3 (RGB), floats are 0..1.
    disparity : ndarray, shape (H, W), float32
        Pixels per view step.
    confidence : ndarray, shape (H, W), float32, optional
        0..1; needed for ``min_confidence``.
    camera : Camera, optional
        Makes the cloud metric; default: a relief.
    from_centre : (float, float)
        Baseline (down, across) from the grid's centre view to this view, in view steps.
    min_confidence : float
        Leave out pixels of lower confidence.
    max_depth : float, optional
        Leave out points farther away than this, in metres.
    step : int
        Use every ``step``-th row and column of pixels.
    unknown : ndarray, shape (H, W), bool, optional
        Pixels to leave out.
    rig : Rig, optional
        Puts a metric cloud into the world of the calibrated cameras.
    sigma : ndarray, shape (H, W), float32, optional
        Standard deviation of the disparity, pixels per view step; that of the depth follows by the derivative.
    max_sigma : float, optional
        Leave out points of a larger standard deviation: of the depth in metres with a camera, else of the disparity in
        pixels per view step.

    Returns
    -------
    PointCloud
        In the order of the pixels, row by row.

    Raises
    ------
    SepiError
        If a map differs in size from the view, a number is out of bounds, ``max_depth`` is given without a camera,
        ``min_confidence`` without a confidence, or ``max_sigma`` without a sigma.

    Examples
    --------
    >>> import sepi
    >>> from sepi.io.point_cloud import point_cloud
    >>> from sepi.scenes import render
    >>> light_field = render("fronto_parallel", size=64, views=3)
    >>> picture = light_field.views[light_field.reference_position]
    >>> camera = sepi.Camera(scale=8.0, offset=1.0, focal_px=800.0)
    >>> cloud = point_cloud(picture, light_field.ground_truth, camera=camera)
    >>> cloud.positions.shape, cloud.colours.shape, cloud.metric
    ((4096, 3), (4096, 3), True)
    >>> float(cloud.positions[0, 2])  # a plane of disparity 1 is 8 / (1 + 1) metres away
    -4.0
    >>> maps = sepi.estimate_depth(light_field)
    >>> sure = point_cloud(picture, maps.disparity, maps.confidence, camera=camera, min_confidence=0.5, step=2)
    >>> len(sure.positions) <= 32 * 32
    True
    >>> near = point_cloud(picture, maps.disparity, camera=camera, sigma=maps.sigma, max_sigma=0.05)
    >>> bool((near.sigma <= 0.05).all())  # metres
    True
    """
    require_type("point cloud: picture", picture, np.ndarray, "a view")
    require_map("point cloud: disparity", disparity)
    for name, values in {"disparity": disparity, "confidence": confidence, "unknown": unknown, "sigma": sigma}.items():
        require_type(f"point cloud: {name}", values, (np.ndarray, NoneType), "an array")
        if values is not None and values.shape != picture.shape[:2]:
            raise SepiError(f"point cloud: {name} is {values.shape}, the view {picture.shape[:2]} (height, width)")
    if step < 1:
        raise SepiError(f"point cloud: expected a step of at least 1 pixel, got {step}")
    if not 0 <= min_confidence <= 1:
        raise SepiError(f"point cloud: expected a least confidence within 0..1, got {min_confidence:g}")
    for name, most in (("depth in metres", max_depth), ("sigma", max_sigma)):
        if most is not None and not most > 0:
            raise SepiError(f"point cloud: expected a positive largest {name}, got {most:g}")
    if max_sigma is not None and sigma is None:
        raise SepiError("point cloud: a largest sigma needs a map of it")
    used: BoolMap = np.zeros(disparity.shape, bool)
    used[::step, ::step] = True
    used &= np.isfinite(disparity)
    if unknown is not None:
        used &= ~unknown
    if min_confidence > 0:
        if confidence is None:
            raise SepiError("point cloud: a least confidence needs a confidence map")
        # a comparison with NaN is false: unknown confidence counts as 0
        used &= confidence >= min_confidence
    if camera is not None:
        depth = camera.depth(disparity)
        used &= np.isfinite(depth) & (depth > 0) & (depth <= (max_depth or np.inf))
        sigma = None if sigma is None else camera.depth_sigma(disparity, sigma)
    elif max_depth is not None:
        raise SepiError("point cloud: a largest depth in metres needs the camera's geometry, which is not known")
    if sigma is not None and max_sigma is not None:
        # a comparison with NaN is false: pixels of unknown error are left out
        used &= sigma <= max_sigma
    y, x = np.nonzero(used)
    across, down = x - (used.shape[1] - 1) / 2, y - (used.shape[0] - 1) / 2
    stretch, units = 1.0, None
    if camera is None:
        near = disparity[used].astype(np.float64)
        low, high = np.quantile(near, (_BEYOND, 1 - _BEYOND)) if near.size else (0.0, 0.0)
        stretch = float(_RELIEF * used.shape[1] / (high - low)) if high > low else 1.0
        points = np.stack([across, -down, stretch * near], axis=1).astype(np.float32)
    else:
        away = depth[used].astype(np.float64)
        right = (across - camera.right - from_centre[1] * camera.offset) * away / camera.focal_px
        below = (down - camera.down - from_centre[0] * camera.offset) * away / camera.focal_px
        points = np.stack([right, -below, -away], axis=1).astype(np.float32)
        if rig is not None:
            # from axes right, up, back to right, down, forward
            points, units = rig.to_world(points.astype(np.float64) * (1, -1, -1)).astype(np.float32), rig.units
    kept = None if sigma is None else sigma[used].astype(np.float32)
    return PointCloud(points, _colours(picture[used]), camera is not None, stretch, units, kept)


def _colours(pixels: npt.NDArray[Any]) -> Colours:
    """Pixels (N, C) as 8-bit RGB (N, 3)."""
    if np.issubdtype(pixels.dtype, np.floating):
        values = 255.0 * np.clip(pixels, 0, 1)
    else:
        values = pixels * (255.0 / np.iinfo(pixels.dtype).max)
    levels = np.rint(values).astype(np.uint8)
    return np.repeat(levels, 3, axis=1) if levels.shape[1] == 1 else levels


def write_ply(path: str | Path, cloud: PointCloud, comments: Sequence[str] | None = None) -> None:
    """Write coloured points as a binary little-endian PLY, whole or not at all; equal content gives equal bytes.

    Parameters
    ----------
    path : str or Path
        MeshLab, CloudCompare, Blender and others open it; comments in its header name the units. If the cloud has a
        sigma, each vertex has a property of that name, which CloudCompare shows as a scalar field.
    cloud : PointCloud
        Or an object that has its arrays.
    comments : sequence of str, optional
        Axes and units; default: those of the cloud.

    Raises
    ------
    SepiError
        If the file cannot be written.

    Examples
    --------
    >>> from pathlib import Path
    >>> from sepi.io.point_cloud import write_ply
    >>> from sepi.io.point_cloud import point_cloud
    >>> from sepi.scenes import render
    >>> light_field = render("pyramids", size=64, views=2)
    >>> picture = light_field.views[light_field.reference_position]
    >>> write_ply(Path("pyramids.ply"), point_cloud(picture, light_field.ground_truth))
    >>> Path("pyramids.ply").read_bytes().splitlines()[4]
    b'element vertex 4096'
    """
    path = require_path("PLY to write", path)
    for name in ("positions", "colours"):
        require_type(f"{path}: {name}", getattr(cloud, name, None), np.ndarray, "an array of the points")
    from plyfile import PlyData, PlyElement

    columns = dict(zip("xyz", np.asarray(cloud.positions, "<f4").T, strict=True))
    columns |= zip(("red", "green", "blue"), np.asarray(cloud.colours, np.uint8).T, strict=True)
    # a user's own class need not have it
    if (sigma := getattr(cloud, "sigma", None)) is not None:
        columns["sigma"] = np.asarray(sigma, "<f4")
    points = np.empty(len(cloud.positions), [(name, values.dtype) for name, values in columns.items()])
    for name, values in columns.items():
        points[name] = values
    told = list(cloud.comments() if comments is None else comments)
    with atomic_path(path) as temporary, temporary.open("wb") as file:
        PlyData([PlyElement.describe(points, "vertex")], byte_order="<", comments=told).write(file)
