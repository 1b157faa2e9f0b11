"""Plane and frame of rectified views, and pictures in it, rotated and undistorted with a single interpolation.

The plane goes through the cameras: their common axes, and their positions in view steps and on a grid. The frame is
one pinhole, and the rectangle of pixels that the reference view fills. Pixels of the frame that another camera does not
show are marked as missing.

A camera at ``dz`` in front of the reference camera, with the focal length ``f (1 - dz / Z0)``, sees a point at depth
``Z`` at ``k = (1 - dz / Z0) / (1 - dz / Z)`` times the distance from the principal point that a camera in the plane
sees. This factor is 1 at the depth ``Z0`` in the middle of the scene, and close to 1 near it.
"""

from typing import Any, NamedTuple

import cv2
import numpy as np
import numpy.typing as npt

from sepi.camera.rig import Floats
from sepi.errors import SepiError
from sepi.extensions.cameras.model import CameraModel, require_sideways
from sepi.io.images import read_picture
from sepi.lightfield import MIN_SIZE, BoolMap, FloatMap, as_unit_float

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


# samples along the longer side for a first check, before single pixels
_LATTICE = 80
# largest distance of a sample outside a picture by rounding, pixels
_OUTSIDE = 1e-3
# least share of the frame that a view must show
_LEAST_SHOWN = 0.1
# largest growth of a picture by rectification; very wide fisheyes grow by a few times
_MOST_LARGER = 16.0
# least share of the reference picture's sides in the frame
_LEAST_PART = 0.1


class Frame(NamedTuple):
    """Pixels of the rectified views.

    Attributes
    ----------
    principal : (float, float)
        Principal point ``(x, y)`` of the reference view in the frame.
    shape : (int, int)
        Height and width.
    """

    principal: tuple[float, float]
    shape: tuple[int, int]


class Seeing:
    """Positions of rectified views' pixels in the original pictures.

    Attributes
    ----------
    model : CameraModel
    plane : Plane
    inverse_depths : (float, float) or None
        Of the farthest and the nearest surface, if known.
    zoom : ndarray, shape (N,), float64
        Focal length of each view as a multiple of ``focal``.
    focal : float
        Focal length of the reference view, pixels.
    principal : (float, float)
        Principal point ``(x, y)`` of the reference's original picture.
    offset : float
        Shift of a view's principal point to the right for each view step to the right, pixels: the shear that aligns
        the middles of the pictures, by least squares.
    """

    def __init__(self, model: CameraModel, plane: Plane, inverse_depths: tuple[float, float] | None) -> None:
        self.model, self.plane, self.inverse_depths = model, plane, inverse_depths
        self.zoom = 1 - plane.places[:, 2] * sum(inverse_depths or (0.0, 0.0)) / 2
        self.focal = float(np.median([sum(shot.lens.focal) / 2 for shot in model.shots]))
        self.principal = model.shots[plane.reference].lens.principal
        sizes = np.array([(shot.lens.width, shot.lens.height) for shot in model.shots])
        middles = [self.from_picture(n, middle[None])[0] for n, middle in enumerate((sizes - 1) / 2)]
        at = plane.baselines[:, ::-1]
        apart = at - at.mean(axis=0)
        self.offset = -float((apart * np.array(middles)).sum() / (apart**2).sum())

    def pixels(self, view: int, pixels: Floats) -> Floats:
        """Positions ``(x, y)`` in the view's original picture, (N, 2), of pixels ``(x, y)`` in the reference's original
        picture; NaN outside.
        """
        shot = self.model.shots[view]
        shifted = pixels - self.principal - self.offset * self.plane.baselines[view, ::-1]
        rays = np.column_stack([shifted / (self.focal * self.zoom[view]), np.ones(len(pixels))])
        seen = shot.lens.project(rays @ (shot.rotation @ self.plane.rotation.T).T)
        size = np.array([shot.lens.width, shot.lens.height])
        with np.errstate(invalid="ignore"):
            inside = ((seen >= -_OUTSIDE) & (seen <= size - 1 + _OUTSIDE)).all(axis=1)
        return np.where(np.asarray(inside)[:, None], np.clip(seen, 0, size - 1), np.nan)

    def has(self, view: int, pixels: Floats) -> npt.NDArray[np.bool_]:
        """Mask of the pixels that a view shows."""
        return np.isfinite(self.pixels(view, pixels)[:, 0])

    def from_picture(self, view: int, pixels: Floats) -> Floats:
        """Pixels ``(x, y)`` from the principal point, without shear, of pixels in the view's original picture."""
        shot = self.model.shots[view]
        rays = shot.lens.rays(pixels) @ (shot.rotation @ self.plane.rotation.T)
        return self.focal * rays[:, :2] / np.maximum(rays[:, 2:], 1e-3)

    def errors(self, frame: Frame) -> Floats:
        """Greatest disparity error from a camera's distance to the reference camera's plane, (N,), pixels per view
        step; 0 for unknown depths.
        """
        plane, (height, width), (x, y) = self.plane, frame.shape, frame.principal
        corners = np.array([(v - y, u - x) for v in (0, height - 1) for u in (0, width - 1)], np.float64)
        worst = np.zeros(len(plane.places))
        for inverse in self.inverse_depths or ():
            scaled = self.zoom / np.maximum(1 - plane.places[:, 2] * inverse, 1e-9)
            moved = self.focal * plane.step * inverse * plane.baselines
            off = np.abs(scaled - 1) * np.linalg.norm(corners[:, None] - moved, axis=2).max(axis=0)
            worst = np.maximum(worst, off)
        return np.asarray(worst / np.maximum(1, np.abs(plane.baselines).max(axis=1)), np.float64)


def frame_of(seeing: Seeing) -> tuple[Frame, list[int]]:
    """The largest frame that the reference view fills, and the views that show enough of it.

    Raises
    ------
    SepiError
        If hardly anything of the frame is left.
    """
    number, own = len(seeing.model.shots), seeing.plane.reference
    reference = seeing.model.shots[own]
    # least and largest pixel (x, y) of the reference's picture, once rectified
    border = seeing.from_picture(own, reference.lens.border()) + seeing.principal
    low, high = np.ceil(border.min(axis=0) - _OUTSIDE), np.floor(border.max(axis=0) + _OUTSIDE)
    larger = float((high - low).max()) / max(reference.lens.width, reference.lens.height)
    if not larger <= _MOST_LARGER:
        large = f"{larger:.3g} times as large" if np.isfinite(larger) else "without bounds"
        expected = "expected focal lengths and distortion that fit its size, and are much the same for all cameras"
        raise SepiError(f"{seeing.model.path}: {reference.name}: would be {large} once rectified; {expected}")
    stride = max(1.0, float((high - low).max()) / _LATTICE)
    counts = np.maximum(2, np.ceil((high - low) / stride).astype(int) + 1)
    across, down = (np.round(np.linspace(low[n], high[n], counts[n])) for n in (0, 1))
    lattice = _lattice(across, down)
    part = largest_rectangle(seeing.has(own, lattice).reshape(len(down), len(across)))
    if part is not None:
        box = _grown(seeing, np.array([*down[list(part[:2])], *across[list(part[2:])]]), stride)
        height, width = (int(end - begin) + 1 for begin, end in (box[:2], box[2:]))
        within = lattice[((lattice >= (box[2], box[0])) & (lattice <= (box[3], box[1]))).all(axis=1)]
        kept = [n for n in range(number) if n == own or seeing.has(n, within).mean() >= _LEAST_SHOWN]
        share = min(height / reference.lens.height, width / reference.lens.width)
        if len(kept) > 1 and share >= _LEAST_PART and min(height, width) >= MIN_SIZE:
            return Frame((seeing.principal[0] - box[2], seeing.principal[1] - box[0]), (height, width)), kept
    hardly = f"the cameras share hardly anything of the picture of {reference.name}"
    raise SepiError(f"{seeing.model.path}: {hardly}; they look in too different directions, or stand too far apart")


def _lattice(across: npt.NDArray[Any], down: npt.NDArray[Any]) -> Floats:
    """Points ``(x, y)`` of a lattice, row by row, (N, 2)."""
    return np.stack(np.meshgrid(across, down), axis=-1).reshape(-1, 2).astype(np.float64)


def largest_rectangle(inside: npt.NDArray[np.bool_]) -> tuple[int, int, int, int] | None:
    """First and last row, first and last column of the largest rectangle of true values; None without any."""
    best, area = None, 0
    heights = np.zeros(inside.shape[1] + 1, int)
    for row, line in enumerate(inside):
        heights[:-1] = np.where(line, heights[:-1] + 1, 0)
        open_at: list[tuple[int, int]] = []
        for column, height in enumerate(heights.tolist()):
            begin = column
            while open_at and open_at[-1][1] >= height:
                begin, tall = open_at.pop()
                if tall * (column - begin) > area:
                    area, best = tall * (column - begin), (row - tall + 1, row, begin, column - 1)
            open_at.append((begin, height))
    return best


# how the sides of a box (top, bottom, left, right) move outward
_OUTWARD = np.array([-1, 1, -1, 1])


def _grown(seeing: Seeing, box: Floats, stride: float) -> Floats:
    """A box (top, bottom, left, right) grown or shrunk at its sides to the pixels that the reference view has."""

    def seen(side: int, box: Floats) -> bool:
        down, across = np.arange(box[0], box[1] + 1), np.arange(box[2], box[3] + 1)
        line = _lattice(across, box[[side]]) if side < 2 else _lattice(box[[side]], down)
        return bool(seeing.has(seeing.plane.reference, line).all())

    # for a side that bulges between the samples
    for _ in range(int(2 * stride) + 2):
        whole = np.array([seen(side, box) for side in range(4)])
        if whole.all():
            break
        box = box - _OUTWARD * ~whole
    for _ in range(int(stride) + 1):
        for side in range(4):
            tried = box + _OUTWARD * (np.arange(4) == side)
            box = tried if seen(side, tried) else box
    return box


# order of the splines: the third blurs more, which costs accuracy at silhouettes
_SPLINES = 5
# largest distance of samples that count as exactly on a pixel
_ON_PIXEL = 1e-6


def rectified_view(seeing: Seeing, frame: Frame, view: int) -> tuple[FloatMap, BoolMap]:
    """A view's pixels (H, W, C), float32, in 0..1 except for overshoot, and the mask of missing ones, which are 0.

    Splines of the fifth order blur less than direct weights of as many samples.
    """
    from scipy import ndimage

    height, width = frame.shape
    # the frame's first pixel in the reference's original picture
    first = np.subtract(seeing.principal, frame.principal)
    at = seeing.pixels(view, _lattice(np.arange(width), np.arange(height)) + first)[:, ::-1].T
    absent = np.isnan(at[0])
    at = np.where(absent, 0, at)
    picture, unusable = as_unit_float(read_picture(seeing.model.pictures[view].file)), _masked(seeing, view)
    if np.abs(at - np.rint(at)).max() < _ON_PIXEL:
        row, column = np.rint(at).astype(int)
        found = picture[row, column]
    else:
        # samples between pixels depend mostly on the four around them
        unusable = np.asarray(cv2.dilate(unusable, np.ones((3, 3), np.uint8)), np.uint8)
        parts = np.moveaxis(picture, 2, 0)
        channels = [ndimage.map_coordinates(part, at, np.float32, order=_SPLINES, mode="mirror") for part in parts]
        found = np.clip(np.stack(channels, axis=-1), -0.5, 1.5)
    absent |= unusable[tuple(np.rint(at).astype(int))] > 0
    found = np.where(absent[:, None], 0, found).reshape(height, width, -1)
    return np.asarray(found, np.float32), absent.reshape(height, width)


def completed(view: FloatMap, missing: BoolMap) -> FloatMap:
    """A view (H, W, C) with missing pixels (H, W) replaced by the nearest other one."""
    if missing.all() or not missing.any():
        return view
    from scipy import ndimage

    row, column = ndimage.distance_transform_edt(missing, return_distances=False, return_indices=True)
    return np.asarray(view[row, column])


def _masked(seeing: Seeing, view: int) -> npt.NDArray[np.uint8]:
    """Mask of a picture: 1 where it is not to be used, else 0."""
    lens, path = seeing.model.shots[view].lens, seeing.model.pictures[view].mask
    if path is None:
        return np.zeros((lens.height, lens.width), np.uint8)
    mask = read_picture(path)
    if mask.shape[:2] != (lens.height, lens.width):
        expected = f"expected a mask as large as its picture, {lens.width}x{lens.height}"
        raise SepiError(f"{path}: {mask.shape[1]}x{mask.shape[0]} pixels; {expected}")
    return np.asarray(mask.reshape(lens.height, lens.width, -1)[..., 0] == 0, np.uint8)
