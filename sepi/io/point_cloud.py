"""A coloured point cloud from a disparity map.

Axes are those of PLY viewers: x to the right, y up, z towards the viewer, so that the scene lies at negative z and
shows upright and the right way round. The origin is the camera of the view that the disparity map belongs to.

Where the camera is known, positions are in metres. Cameras look the same way and stand a baseline apart; their pictures
are shifted so that a point at the focus distance is at the same pixel in all of them (:mod:`sepi.camera`). The shift
moves the principal point: at the grid's centre view it is the middle of the picture ``(cx, cy)``, and in a view ``n``
view steps to its right ``cx + n * offset``, with the camera's ``offset`` in pixels per view step. So pixel ``(y, x)``
at depth ``Z`` is the point ::

    X = (x - cx - n * offset) * Z / focal_px        Y = (y - cy - m * offset) * Z / focal_px

for a view ``n`` view steps to the right of and ``m`` below the centre view; X to the right and Y down, in metres.

Where it is not known, the cloud is a relief: x and y in pixels from the middle, z the disparity, stretched so that its
range is a third of the picture's width. Shape and proportions are then not those of the scene.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from types import NoneType
from typing import Any

import numpy as np
import numpy.typing as npt

from sepi.camera import Camera
from sepi.errors import SepiError
from sepi.lightfield import BoolMap, FloatMap
from sepi.rig import WORLD, Rig
from sepi.validation import require_map, require_type

Positions = npt.NDArray[np.float32]
Colours = npt.NDArray[np.uint8]
View = npt.NDArray[np.generic]

# depth of a relief as part of the picture's width, and the part of the pixels beyond each end of what counts as its
# range, so that a few wrong pixels do not flatten it
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
        Units of the world in whose axes the points are, where calibrated cameras tell; None: axes are as above.
    sigma : ndarray, shape (N,), float32, or None
        Standard deviation of each point's depth, in the unit of a metric cloud, or of its disparity in a relief, pixels
        per view step; None where nothing tells it.

    Examples
    --------
    A cloud put together by hand, of one red point two metres before the camera:

    >>> import numpy as np
    >>> from sepi.io.point_cloud import PointCloud
    >>> cloud = PointCloud(np.float32([[0, 0, -2]]), np.uint8([[255, 0, 0]]), metric=True)
    >>> cloud.comments()
    ('x right, y up, z towards the viewer', 'metres; origin: camera of the view')
    """

    positions: Positions
    colours: Colours
    metric: bool
    stretch: float = 1.0
    units: str | None = None
    sigma: FloatMap | None = None

    def comments(self) -> tuple[str, ...]:
        """What the numbers are, for the file's header.

        Returns
        -------
        tuple of str
            Axes, units, and what ``sigma`` is where there is one.
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

    With a camera ``(f, offset)`` pixel ``(y, x)`` of depth ``Z`` becomes ``X = (x - cx - n offset) Z / f`` and
    ``Y = (y - cy - m offset) Z / f`` metres, for a view ``n`` view steps to the right of the centre view and ``m``
    below it, and the middle ``(cx, cy)`` of the picture; the cloud's axes are ``(X, -Y, -Z)``. Without, x and y are
    pixels from the middle, and z is the disparity, stretched to a third of the picture's width.

    Parameters
    ----------
    picture : ndarray, shape (H, W, C), uint8, uint16 or float
        The view; C is 1 or 3 (RGB), floats are 0..1.
    disparity : ndarray, shape (H, W), float32
        Pixels per view step.
    confidence : ndarray, shape (H, W), float32, optional
        0..1; needed for ``min_confidence``.
    camera : Camera, optional
        Makes the cloud metric; a relief without.
    from_centre : (float, float)
        Baseline (down, across) from the grid's centre view to this view, in view steps.
    min_confidence : float
        Leave out pixels of lower confidence.
    max_depth : float, optional
        Leave out points more distant than this, metres.
    step : int
        Use every so-many-th row and column of pixels.
    unknown : ndarray, shape (H, W), bool, optional
        Pixels to leave out.
    rig : Rig, optional
        Puts a metric cloud into the world of the calibrated cameras.
    sigma : ndarray, shape (H, W), float32, optional
        Standard deviation of the disparity, pixels per view step; that of the depth follows by the derivative.
    max_sigma : float, optional
        Leave out points of a larger standard deviation than this: of the depth in metres with a camera, else of the
        disparity in pixels per view step.

    Returns
    -------
    PointCloud
        In the order of the pixels, row by row.

    Raises
    ------
    SepiError
        If the maps are not of the picture's size, a number is out of bounds, ``max_depth`` is given without a camera,
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
    given = {"disparity": disparity, "confidence": confidence, "unknown": unknown, "sigma": sigma}
    for name, values in given.items():
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
    used = np.zeros(disparity.shape, bool)
    used[::step, ::step] = True
    used &= np.isfinite(disparity)
    if unknown is not None:
        used &= ~unknown
    if min_confidence > 0:
        if confidence is None:
            raise SepiError("point cloud: a least confidence needs a confidence map")
        # comparison with NaN is false: unknown confidence is none
        used &= confidence >= min_confidence
    if camera is not None:
        depth = camera.depth(disparity)
        used &= np.isfinite(depth) & (depth > 0) & (depth <= (max_depth or np.inf))
        sigma = None if sigma is None else camera.depth_sigma(disparity, sigma)
        if sigma is not None and max_sigma is not None:
            # comparison with NaN is false: unknown error is any
            used &= sigma <= max_sigma
        cloud = _metric(picture, disparity, used, camera, from_centre)
        cloud = replace(cloud, sigma=None if sigma is None else sigma[used])
        if rig is None:
            return cloud
        # from right, up, back
        points = rig.to_world(cloud.positions.astype(np.float64) * (1, -1, -1))
        return replace(cloud, positions=points.astype(np.float32), units=rig.units)
    if max_depth is not None:
        raise SepiError("point cloud: a largest depth in metres needs the camera's geometry, which is not known")
    if sigma is not None and max_sigma is not None:
        used &= sigma <= max_sigma
    return replace(_relief(picture, disparity, used), sigma=None if sigma is None else sigma[used].astype(np.float32))


def _metric(
    picture: View, disparity: FloatMap, used: BoolMap, camera: Camera, from_centre: tuple[float, float]
) -> PointCloud:
    across, down = _from_middle(used)
    depth = camera.depth(disparity[used]).astype(np.float64)
    x = (across - camera.right - from_centre[1] * camera.offset) * depth / camera.focal_px
    y = (down - camera.down - from_centre[0] * camera.offset) * depth / camera.focal_px
    return PointCloud(_stacked(x, -y, -depth), _colours(picture[used]), metric=True)


def _relief(picture: View, disparity: FloatMap, used: BoolMap) -> PointCloud:
    across, down = _from_middle(used)
    values = disparity[used].astype(np.float64)
    low, high = np.quantile(values, (_BEYOND, 1 - _BEYOND)) if values.size else (0.0, 0.0)
    stretch = float(_RELIEF * used.shape[1] / (high - low)) if high > low else 1.0
    return PointCloud(_stacked(across, -down, stretch * values), _colours(picture[used]), metric=False, stretch=stretch)


def _from_middle(used: BoolMap) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """Pixels to the right of and below the middle of the picture, of each used pixel."""
    y, x = np.nonzero(used)
    return x - (used.shape[1] - 1) / 2, y - (used.shape[0] - 1) / 2


def _stacked(*axes: npt.NDArray[np.float64]) -> Positions:
    return np.stack(axes, axis=1).astype(np.float32)


def _colours(pixels: npt.NDArray[Any]) -> Colours:
    """Pixels (N, C) as 8-bit RGB (N, 3)."""
    if np.issubdtype(pixels.dtype, np.floating):
        values = 255.0 * np.clip(pixels, 0, 1)
    else:
        values = pixels * (255.0 / np.iinfo(pixels.dtype).max)
    levels = np.rint(values).astype(np.uint8)
    return np.repeat(levels, 3, axis=1) if levels.shape[1] == 1 else levels
