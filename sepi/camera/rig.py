"""Calibrated cameras: lenses, poses, and the rectified views made from their pictures.

Axes are those of computer vision: x to the right, y down, z forward. The middle of a picture's first pixel is (0, 0).
A camera at ``C`` with rotation ``R`` sees the world point ``P`` at ``R (P - C)`` in its own axes.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from sepi.errors import SepiError

Floats = npt.NDArray[np.float64]

PINHOLE, FISHEYE = "pinhole", "fisheye"
METRES = "metres"

WORLD = "axes and origin of the calibrated cameras' world"
"""Description of coordinates in files of points from a rig."""

LENSES = (PINHOLE, FISHEYE)
"""Kinds of lenses: OpenCV's model with radial and tangential distortion, and OpenCV's fisheye model."""

MOST_COEFFICIENTS = {PINHOLE: 8, FISHEYE: 4}
"""Largest number of coefficients: ``k1 k2 p1 p2 k3 k4 k5 k6`` (pinhole), ``k1 k2 k3 k4`` (fisheye); others are 0."""

# rays farther outside the picture's field than this factor are not seen: the polynomial may bend them back into it
_BEYOND = 1.02
_BORDER_POINTS = 33
_ROUNDS, _CLOSELY = 30, 1e-12


@dataclass(frozen=True)
class Lens:
    """Lens of a camera: size of its pictures, focal length, principal point, distortion.

    Attributes
    ----------
    width, height : int
        Pixels of its pictures.
    focal : (float, float)
        Focal lengths ``(fx, fy)``, pixels.
    principal : (float, float)
        Principal point ``(x, y)``, pixels; the middle of the first pixel is (0, 0).
    kind : str
        One of :data:`LENSES`.
    distortion : tuple of float
        Coefficients of OpenCV's model, at most :data:`MOST_COEFFICIENTS`.

    Raises
    ------
    SepiError
        If a number is not finite, a length not positive, or the kind unknown.

    Examples
    --------
    >>> import numpy as np
    >>> from sepi.camera.rig import Lens
    >>> lens = Lens(640, 480, (500.0, 500.0), (319.5, 239.5), distortion=(-0.1,))
    >>> pixels = lens.project(np.array([[0.2, 0.1, 1.0]]))
    >>> pixels.round(2).tolist()
    [[419.0, 289.25]]
    >>> lens.rays(pixels).round(6).tolist()
    [[0.2, 0.1, 1.0]]
    """

    width: int
    height: int
    focal: tuple[float, float]
    principal: tuple[float, float]
    kind: str = PINHOLE
    distortion: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        if self.kind not in LENSES:
            raise SepiError(f"lens: expected one of {', '.join(LENSES)}, got {self.kind!r}")
        if not np.isfinite([*self.focal, *self.principal, *self.distortion]).all():
            raise SepiError("lens: expected finite numbers")
        if not (min(self.focal) > 0 and self.width >= 2 and self.height >= 2):
            raise SepiError(
                f"lens: expected positive focal lengths and at least 2x2 pixels, got {self.focal[0]:g}, "
                f"{self.focal[1]:g} and {self.width}x{self.height}"
            )
        if len(self.distortion) > MOST_COEFFICIENTS[self.kind]:
            got = f"{len(self.distortion)} coefficients of distortion"
            raise SepiError(f"lens: a {self.kind} has at most {MOST_COEFFICIENTS[self.kind]}, got {got}")

    def scaled(self, width: int, height: int) -> Lens:
        """The lens for pictures scaled to another size.

        Parameters
        ----------
        width, height : int
            Pixels; each side may be rounded by one.

        Returns
        -------
        Lens

        Raises
        ------
        SepiError
            If the two sides have different scales.

        Examples
        --------
        >>> from sepi.camera.rig import Lens
        >>> half = Lens(640, 480, (500.0, 500.0), (319.5, 239.5)).scaled(320, 240)
        >>> half.focal, half.principal
        ((250.0, 250.0), (159.5, 119.5))
        """
        x, y = width / self.width, height / self.height
        # the smaller picture is the rounded one
        if abs(x - y) >= max(1, x) / self.width + max(1, y) / self.height:
            raise SepiError(
                f"the picture is {width}x{height}, but its camera has {self.width}x{self.height}; expected the size of "
                "the calibrated pictures, or the same scale both ways; for crops of them, give --crop-of "
                f"{self.width}x{self.height}+X+Y"
            )
        (fx, fy), (cx, cy) = self.focal, self.principal
        principal = (cx + 0.5) * x - 0.5, (cy + 0.5) * y - 0.5
        return replace(self, width=width, height=height, focal=(fx * x, fy * y), principal=principal)

    @property
    def matrix(self) -> Floats:
        """OpenCV's camera matrix, (3, 3)."""
        (fx, fy), (cx, cy) = self.focal, self.principal
        return np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1]], np.float64)

    @property
    def _coefficients(self) -> Floats:
        # OpenCV takes 4, 5, 8, ... coefficients
        return np.array([*self.distortion, *[0.0] * (MOST_COEFFICIENTS[self.kind] - len(self.distortion))], np.float64)

    def project(self, rays: Floats) -> Floats:
        """Pixels at which the camera sees rays.

        Parameters
        ----------
        rays : ndarray, shape (N, 3), float64
            In the camera's own axes, of any length.

        Returns
        -------
        ndarray, shape (N, 2), float64
            ``(x, y)``; NaN for rays that no pixel sees.
        """
        with np.errstate(divide="ignore", invalid="ignore"):
            flat = rays[:, :2] / rays[:, 2:]
        ahead = (rays[:, 2] > 0) & ((flat**2).sum(axis=1) <= self._field)
        pixels = np.full((len(rays), 2), np.nan)
        if ahead.any():
            pixels[ahead] = self._seen_at(flat[ahead])
        return pixels

    @np.errstate(over="ignore", invalid="ignore")
    def rays(self, pixels: Floats) -> Floats:
        """Rays that the camera sees at pixels.

        Parameters
        ----------
        pixels : ndarray, shape (N, 2), float64
            ``(x, y)``.

        Returns
        -------
        ndarray, shape (N, 3), float64
            In the camera's own axes; z is 1.
        """
        import cv2

        if self.kind == PINHOLE and not any(self.distortion):
            return np.column_stack([(pixels - np.array(self.principal)) / self.focal, np.ones(len(pixels))])
        points, flat = np.asarray(pixels, np.float64)[:, None], np.eye(3)
        undistort = cv2.undistortPoints if self.kind == PINHOLE else cv2.fisheye.undistortPoints
        found = undistort(points, self.matrix, self._coefficients, R=flat, P=flat)[:, 0]
        # OpenCV's iterations end early, depending on its version
        for _ in range(_ROUNDS if self.kind == PINHOLE else 0):
            missed = (points[:, 0] - self._seen_at(np.asarray(found, np.float64))) / np.array(self.focal)
            found = np.asarray(found, np.float64) + missed
            if np.abs(missed).max() < _CLOSELY:
                break
        return np.column_stack([found, np.ones(len(found))])

    # absurd distortions overflow, and no pixel sees such rays
    @np.errstate(over="ignore", invalid="ignore", divide="ignore")
    def _seen_at(self, flat: Floats) -> Floats:
        """Pixels of rays with z = 1, given by (x, y), by OpenCV's formulas in a tenth of its time."""
        square = (flat**2).sum(axis=1)
        if self.kind == PINHOLE:
            k1, k2, p1, p2, k3, k4, k5, k6 = self._coefficients
            below = 1 + square * (k4 + square * (k5 + square * k6))
            scale = (1 + square * (k1 + square * (k2 + square * k3))) / below
            x, y = flat.T
            bent = np.column_stack(
                [2 * p1 * x * y + p2 * (square + 2 * x * x), p1 * (square + 2 * y * y) + 2 * p2 * x * y]
            )
            return np.asarray((flat * scale[:, None] + bent) * self.focal + self.principal)
        radius = np.maximum(np.sqrt(square), 1e-12)
        angle = np.arctan(radius)
        powers = angle[:, None] ** np.arange(3, 10, 2)
        bent = flat * ((angle + powers @ self._coefficients) / radius)[:, None]
        return np.asarray(bent * self.focal + self.principal)

    def border(self) -> Floats:
        """Pixels along the edge of the picture.

        Returns
        -------
        ndarray, shape (N, 2), float64
            ``(x, y)``.
        """
        along = np.linspace(0, 1, _BORDER_POINTS)
        return np.concatenate([[(a, 0), (a, 1), (0, a), (1, a)] for a in along]) * (self.width - 1, self.height - 1)

    @cached_property
    def _field(self) -> float:
        """Largest squared distance from the axis, at z = 1, of a ray that the picture shows."""
        return _BEYOND**2 * float((self.rays(self.border())[:, :2] ** 2).sum(axis=1).max())


@dataclass(frozen=True)
class Shot:
    """A calibrated camera: a picture's name, its lens, and its pose.

    Attributes
    ----------
    name : str
        Name of the picture's file.
    lens : Lens
    rotation : ndarray, shape (3, 3), float64
        From the world's axes to the camera's.
    centre : ndarray, shape (3,), float64
        Position in the world.

    Examples
    --------
    A point two metres in front of a camera at the origin without rotation:

    >>> import numpy as np
    >>> from sepi.camera.rig import Lens, Shot
    >>> shot = Shot("left.png", Lens(640, 480, (500.0, 500.0), (319.5, 239.5)), np.eye(3), np.zeros(3))
    >>> shot.lens.project((np.array([[0.2, 0.1, 2.0]]) - shot.centre) @ shot.rotation.T).tolist()
    [[369.5, 264.5]]
    """

    name: str
    lens: Lens
    rotation: Floats
    centre: Floats


@dataclass(frozen=True)
class Rectified:
    """A view of a rectified light field: its camera, and its zoom.

    Attributes
    ----------
    shot : Shot
    zoom : float
        Focal length of the view as a multiple of the light field's, for a camera in front of or behind the plane.
    """

    shot: Shot
    zoom: float = 1.0


@dataclass(frozen=True)
class Rig:
    """Pose of a rectified light field in the world, and the cameras that it was made from.

    Attributes
    ----------
    rotation : ndarray, shape (3, 3), float64
        From the world's axes to those that all rectified views share.
    origin : ndarray, shape (3,), float64
        World point of the position (0, 0), the origin of points.
    step : float
        Length of a view step in units of the world.
    units : str
        ``"metres"``, or ``"units of the model"``.
    views : mapping of (int, int) to Rectified
        Grid position to the view.

    Examples
    --------
    >>> import numpy as np
    >>> from sepi.camera.rig import Rig
    >>> rig = Rig(np.eye(3), np.array([5.0, 0.0, 0.0]), 0.1, "metres", {})
    >>> rig.centre((0, 2)).tolist()
    [5.2, 0.0, 0.0]
    >>> rig.seen_from((0, 2)).to_world(np.array([[0.0, 0.0, 3.0]])).tolist()
    [[5.2, 0.0, 3.0]]
    """

    rotation: Floats
    origin: Floats
    step: float
    units: str
    views: Mapping[tuple[int, int], Rectified]

    def centre(self, position: npt.ArrayLike) -> Floats:
        """World points of view positions.

        Parameters
        ----------
        position : array-like, shape (..., 2)
            ``(down, across)`` in view steps.

        Returns
        -------
        ndarray, shape (..., 3), float64
        """
        down, across = np.moveaxis(np.asarray(position, np.float64), -1, 0)
        along = across[..., None] * self.rotation[0] + down[..., None] * self.rotation[1]
        return np.asarray(self.origin + self.step * along, np.float64)

    def seen_from(self, position: npt.ArrayLike) -> Rig:
        """The same rig with another origin.

        Parameters
        ----------
        position : array-like, shape (2,)
            Position of the new origin, ``(down, across)`` in view steps.

        Returns
        -------
        Rig
        """
        return replace(self, origin=self.centre(position))

    def to_world(self, points: Floats) -> Floats:
        """World coordinates of points.

        Parameters
        ----------
        points : ndarray, shape (N, 3), float64
            In the axes of a rectified view that stands at the origin.

        Returns
        -------
        ndarray, shape (N, 3), float64
        """
        return points @ self.rotation + self.origin

    def to_text(self) -> str:
        """The rig as JSON.

        Returns
        -------
        str
        """
        views = [[*at, {**asdict(view.shot), "zoom": view.zoom}] for at, view in self.views.items()]
        return json.dumps({**vars(self), "views": views}, default=np.ndarray.tolist)

    @staticmethod
    def from_text(text: str) -> Rig:
        """A rig from the text that :meth:`to_text` returns.

        Parameters
        ----------
        text : str

        Returns
        -------
        Rig

        Raises
        ------
        SepiError
            If it is another text.
        """
        try:
            told = json.loads(text)
            views = {(int(t), int(s)): _rectified(view) for t, s, view in told["views"]}
            step = float(told["step"])
            if not 0 < step < np.inf:
                raise ValueError("no length")
            return Rig(*_pose(told, "origin"), step, str(told["units"]), views)
        except (ValueError, KeyError, TypeError, AttributeError, RecursionError, OverflowError) as error:
            raise SepiError("damaged: it does not tell the poses of its cameras") from error


def _pose(told: Mapping[str, Any], place: str) -> tuple[Floats, Floats]:
    rotation, at = (np.array(told[key], np.float64) for key in ("rotation", place))
    if not (np.isfinite(rotation).all() and np.isfinite(at).all()):
        raise ValueError("no rotation and place")
    return rotation.reshape(3, 3), at.reshape(3)


def _rectified(told: Mapping[str, Any]) -> Rectified:
    lens = told["lens"]
    pairs = {key: tuple(map(float, lens[key])) for key in ("focal", "principal", "distortion")}
    known = Lens(int(lens["width"]), int(lens["height"]), kind=str(lens["kind"]), **pairs)  # type: ignore[arg-type]
    return Rectified(Shot(str(told["name"]), known, *_pose(told, "centre")), float(told["zoom"]))
