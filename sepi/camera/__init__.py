"""From disparity to metric depth, by the camera's geometry.

Cameras stand a baseline ``b`` apart, and views are sheared so that a point at the focus distance ``F`` has disparity
zero. With the focal length ``f`` in pixels, a point at depth ``Z`` has the disparity ``d = b f (1 / Z - 1 / F)``, so

    Z = b f / (d + b f / F).

This is the formula of the HCI 4D light field benchmark [1]_, whose ``beta`` is ``b f F``. The benchmark gives the focal
length and the sensor size in millimetres; the size is that of the longer side of the whole picture. Views that were cut
out of it have its focal length, and a principal point away from their middle.

Disparities are in pixels per view step, so ``b`` is the distance from one column of cameras to the next; if there is
only one column, from one row to the next.

References
----------
.. [1] K. Honauer, O. Johannsen, D. Kondermann, B. Goldluecke, "A dataset and evaluation methodology for depth
       estimation on 4D light fields", ACCV 2016. doi:10.1007/978-3-319-54187-7_2
"""

from __future__ import annotations

from dataclasses import astuple, dataclass
from numbers import Real

import numpy as np
import numpy.typing as npt

from sepi.errors import SepiError, warn
from sepi.validation import described, is_finite, whole_pair

Map = npt.NDArray[np.float32]
Flags = npt.NDArray[np.bool_]

# least share of a map beyond infinity for a warning; by how many standard deviations, or if unknown by how many pixels
# per view step, a pixel must lie beyond
_BEYOND, _SIGMAS, _UNSURE = 0.05, 3.0, 0.2

Part = tuple[int, int, int, int]
"""Width and height of a whole picture, and column and row in it of a part's first pixel."""


@dataclass(frozen=True)
class Camera:
    """Geometry of a light field's cameras, which turns disparity into depth.

    Depth is ``scale / (disparity + offset)``, the formula of the HCI 4D light field benchmark [1]_;
    :func:`sepi.camera.camera_from` makes a camera from focal length, baseline, focus distance and sensor size.

    Attributes
    ----------
    scale : float
        ``b f``, metres times pixels per view step.
    offset : float
        ``b f / F``, pixels per view step; disparity ``-offset`` lies at infinity.
    focal_px : float
        Focal length in pixels.
    right, down : float
        How far the principal point of the grid's centre view lies to the right of the picture's middle, and below it,
        in pixels.

    Raises
    ------
    SepiError
        If ``scale`` or ``focal_px`` is not a positive number, or ``offset`` not finite.

    References
    ----------
    .. [1] K. Honauer, O. Johannsen, D. Kondermann, B. Goldluecke, "A dataset and evaluation methodology for depth
           estimation on 4D light fields", ACCV 2016. doi:10.1007/978-3-319-54187-7_2

    Examples
    --------
    Cameras 10 mm apart with a focal length of 800 pixels, focused at 4 m:

    >>> import numpy as np
    >>> from sepi import Camera
    >>> camera = Camera(scale=8.0, offset=2.0, focal_px=800.0)
    >>> camera.depth(np.array([-2, 0, 2], np.float32)).tolist()  # infinity, the focus distance, half of it
    [inf, 4.0, 2.0]
    """

    scale: float
    offset: float
    focal_px: float
    right: float = 0.0
    down: float = 0.0

    def __post_init__(self) -> None:
        positive = all(is_finite(value) and value > 0 for value in (self.scale, self.focal_px))
        if not (positive and all(map(is_finite, (self.offset, self.right, self.down)))):
            raise SepiError("camera: expected positive focal length, baseline, focus distance and sensor size")

    def depth(self, disparity: Map) -> Map:
        """Depth of disparities.

        Parameters
        ----------
        disparity : ndarray, of any shape, float32
            Pixels per view step.

        Returns
        -------
        ndarray, of the same shape, float32
            Metres, along the viewing direction; infinite where ``disparity <= -offset``.
        """
        above = np.asarray(disparity, np.float64) + self.offset
        with np.errstate(divide="ignore"):
            return np.where(above > 0, self.scale / np.where(above > 0, above, 1), np.inf).astype(np.float32)

    def depth_sigma(self, disparity: Map, sigma: Map) -> Map:
        """Standard deviation of the depth, from that of the disparity by the derivative.

        Parameters
        ----------
        disparity : ndarray, of any shape, float32
            Pixels per view step.
        sigma : ndarray, of the same shape, float32
            Its standard deviation, pixels per view step.

        Returns
        -------
        ndarray, of the same shape, float32
            ``scale / (disparity + offset)^2 * sigma`` in metres; infinite where the depth is.

        Examples
        --------
        Twice as far away, the same error of the disparity is four times the error of the depth:

        >>> import numpy as np
        >>> from sepi import Camera
        >>> camera = Camera(scale=8.0, offset=2.0, focal_px=800.0)
        >>> camera.depth_sigma(np.array([2, 0, -2], np.float32), np.full(3, 0.5, np.float32)).tolist()
        [0.25, 1.0, inf]
        """
        above = np.asarray(disparity, np.float64) + self.offset
        within = np.where(above > 0, above, 1)
        # a plain product would be NaN at infinity where sigma is 0
        return np.where(above > 0, self.scale / within**2 * sigma, np.inf).astype(np.float32)


def camera_from(
    *,
    focal_length_mm: float,
    baseline_mm: float,
    focus_distance_m: float,
    sensor_size_mm: float,
    shape: tuple[int, int],
    crop_of: Part | None = None,
) -> Camera:
    """Camera from focal length, baseline, focus distance and sensor size, as in the HCI 4D benchmark.

    Parameters
    ----------
    focal_length_mm : float
        Focal length in millimetres.
    baseline_mm : float
        Distance between neighbouring columns of cameras in millimetres; between rows if there is one column.
    focus_distance_m : float
        Depth at which the disparity is zero, in metres; infinite for parallel cameras.
    sensor_size_mm : float
        Longer side of the sensor that took the whole picture, in millimetres.
    shape : (int, int)
        Height and width of a view in pixels.
    crop_of : (int, int, int, int), optional
        If the views are parts of the sensor's picture: width and height of that picture, and column and row in it of
        the views' first pixel.

    Returns
    -------
    Camera

    Raises
    ------
    SepiError
        If a number is not positive, or the views do not fit into the whole picture.

    Examples
    --------
    A light field without a camera gets one, and depth in metres:

    >>> from dataclasses import replace
    >>> from sepi.camera import camera_from
    >>> from sepi.scenes import render
    >>> light_field = render("fronto_parallel", size=64, views=3)
    >>> camera = camera_from(
    ...     focal_length_mm=50, baseline_mm=20, focus_distance_m=4, sensor_size_mm=32, shape=light_field.shape
    ... )
    >>> camera.focal_px, camera.scale, camera.offset
    (100.0, 2.0, 0.5)
    >>> light_field = replace(light_field, camera=camera)
    >>> round(float(camera.depth(light_field.ground_truth).mean()), 3)  # 2 / (1 + 0.5)
    1.333
    """
    numbers = (focal_length_mm, baseline_mm, focus_distance_m, sensor_size_mm)
    if not all(isinstance(value, Real) and value > 0 for value in numbers):
        focal_length, baseline, distance, size = map(described, numbers)
        raise SepiError(
            f"camera: expected positive numbers, got focal length {focal_length} mm, baseline {baseline} mm, "
            f"focus distance {distance} m, sensor size {size} mm"
        )
    height, width = whole_pair("camera: shape", shape, "height and width of a view")
    part = crop_of or (width, height, 0, 0)
    require_part(part, (height, width))
    focal_px = focal_length_mm / sensor_size_mm * max(part[:2])
    scale = baseline_mm / 1000 * focal_px
    right, down = (part[0] - width) / 2 - part[2], (part[1] - height) / 2 - part[3]
    return Camera(scale, scale / focus_distance_m, focal_px, right, down)


def require_part(part: Part, shape: tuple[int, ...]) -> None:
    """Raise unless a part of this height and width fits into its whole picture."""
    (width, height, x, y), (rows, columns) = part, shape
    if min(x, y) < 0 or x + columns > width or y + rows > height:
        part_of_it = f"{columns}x{rows} pixels (width x height) from column {x}, row {y}"
        raise SepiError(f"{part_of_it} do not fit into {width}x{height}")


def warn_of_infinity(where: object, camera: Camera, disparity: Map, sigma: Map | None, unknown: Flags) -> None:
    """Warn if the camera puts more of a map beyond infinity than the map's error explains.

    Parameters
    ----------
    where : object
        Name or path for the message.
    camera : Camera
    disparity : ndarray, shape (H, W), float32
        Pixels per view step.
    sigma : ndarray, shape (H, W), float32, or None
        Its standard deviation, if known.
    unknown : ndarray, shape (H, W), bool
        Pixels that do not count.
    """
    farthest = disparity + (_UNSURE if sigma is None else _SIGMAS * sigma)
    share = float(np.mean(farthest[~unknown] < -camera.offset)) if not unknown.all() else 0.0
    if share > _BEYOND:
        warn(
            f"{where}: {100 * share:.0f} % of the pixels lie beyond infinity, below a disparity of "
            f"{0.0 - camera.offset:.3g} with this camera; check --baseline (millimetres), --focus-distance (metres; "
            "inf if no disparity is below 0), and whether near and far are exchanged (sepi check)",
            up=2,
        )


def numbers_of(camera: Camera) -> tuple[float, ...]:
    """Arguments of :class:`Camera` as files keep them: three, or five if the principal point is off the middle."""
    return astuple(camera)[: 5 if camera.right or camera.down else 3]
