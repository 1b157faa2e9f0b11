"""Views with poses and intrinsics as pinhole cameras, depth and points, for COLMAP and nerfstudio.

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

from collections.abc import Callable
from functools import cached_property

import numpy as np
import numpy.typing as npt

from sepi.camera import Camera
from sepi.errors import SepiError
from sepi.lightfield import BoolMap, FloatMap, LightField, as_unit_float
from sepi.matching.carried_map import carried_map, carried_values

Points = npt.NDArray[np.float64]

FOCAL_FACTOR = 1.2
"""Nominal focal length as a multiple of the picture's longer side, COLMAP's default."""

NEAREST, FARTHEST = 1.0, 2.0
"""Depth of the nearest and the farthest surface for a nominal camera, in its own units."""

# share of the pixels beyond each end of a map's range, so that a few wrong ones do not widen it
_BEYOND = 0.005


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


Colours = npt.NDArray[np.uint8]

Surfaces = Callable[[tuple[int, int]], FloatMap]
"""Function from a grid position to that view's disparity, (H, W) float32, NaN where unknown."""

MAX_POINTS = 10000
"""Default of the most points; each has a track through all views that see it."""

# largest difference of one surface's positions in a view, pixels
_APART = 1.0


class PosedViews:
    """A light field as single pictures with pinhole cameras, row by row, and the known geometry of the scene.

    Parameters
    ----------
    light_field : LightField
    disparity : ndarray, shape (H, W), float32
        Disparity of its reference view, pixels per view step.
    confidence : ndarray, shape (H, W), float32, optional
        0..1; default: 1.
    unknown : ndarray, shape (H, W), bool, optional
        Pixels without depth.
    camera : Camera, optional
        Default: the light field's own, or a nominal one.
    min_confidence : float, optional
        Least confidence of points. Default: points at the surer half of all pixels with a depth, by ``sigma`` if given,
        else by the confidence.
    max_points : int
        Most points, on every n-th row and column.
    surfaces : callable, optional
        Disparity of the other views; default: the map, warped to them.
    sigma : ndarray, shape (H, W), float32, optional
        Standard deviation of the disparity, pixels per view step.
    sigmas : callable, optional
        Standard deviation of the other views; needed with ``surfaces`` for the error of their depth.

    Attributes
    ----------
    light_field, surfaces, sigma, sigmas
        As given.
    camera : Camera
        The given camera, the light field's own, or a nominal one.
    metric : bool
        Whether positions and depth are in metres; False with a nominal camera.
    disparity : ndarray, shape (H, W), float32
        Of the reference view, pixels per view step; NaN where unknown.
    chosen : ndarray, shape (H, W), bool
        Pixels of the reference view that have a point.
    rig : Rig or None
        Poses in the world of the calibrated cameras; None: poses in the reference view's axes.
    units : str
        Units of positions and depth, in a few words.
    positions : list of (int, int)
        Grid position ``(t, s)`` of each view that is present.
    names : tuple of str
        Name of each view by its row and column, such as ``view_04_04``.
    reference : int
        Number of the reference view.
    baselines : ndarray, shape (N, 2), float64
        ``(down, across)`` of each view from the reference view, in view steps.
    centres : ndarray, shape (N, 3), float64
        Position of each camera from the reference view's: x right, y down, z forward.
    principal_points : ndarray, shape (N, 2), float64
        Principal points ``(x, y)`` in pixels, the middle of the top left pixel being (0, 0).
    sure : bool
        Whether all views have a :meth:`depth_sigma`.
    """

    def __init__(
        self,
        light_field: LightField,
        disparity: FloatMap,
        confidence: FloatMap | None = None,
        *,
        unknown: BoolMap | None = None,
        camera: Camera | None = None,
        min_confidence: float | None = None,
        max_points: int = MAX_POINTS,
        surfaces: Surfaces | None = None,
        sigma: FloatMap | None = None,
        sigmas: Surfaces | None = None,
    ) -> None:
        if min_confidence is not None and not 0 <= min_confidence <= 1:
            raise SepiError(f"{light_field.name}: expected a least confidence within 0..1, got {min_confidence:g}")
        known = np.isfinite(disparity) & (True if unknown is None else ~unknown)
        own = camera or light_field.camera
        self.light_field, self.surfaces, self.sigma, self.sigmas = light_field, surfaces, sigma, sigmas
        self.sure = sigma is not None and (surfaces is None or sigmas is not None)
        self.camera, self.metric = own or nominal_camera(disparity, known), own is not None
        self.rig = light_field.reference_rig if camera is None else None
        told = "metres" if self.metric else "nominal units, not to scale, since the camera is unknown"
        self.units = told if self.rig is None else self.rig.units
        self.positions = [(t, s) for t, s in np.argwhere(light_field.present).tolist()]
        digits = max(2, *(len(str(size - 1)) for size in light_field.grid))
        self.names = tuple(f"view_{t:0{digits}d}_{s:0{digits}d}" for t, s in self.positions)
        self.reference = self.positions.index(light_field.reference_position)
        self.baselines, (height, width) = light_field.baselines[light_field.present], light_field.shape
        baseline = self.camera.scale / self.camera.focal_px
        self.centres = np.column_stack([self.baselines[:, ::-1] * baseline, np.zeros(len(self.baselines))])
        sheared = (self.baselines + light_field.from_centre)[:, ::-1] * self.camera.offset
        middle = np.array([width - 1, height - 1]) / 2 + (self.camera.right, self.camera.down)
        self.principal_points: Points = middle + sheared
        known &= np.isfinite(self.camera.depth(disparity))
        self.disparity = np.where(known, disparity, np.float32(np.nan))
        self.chosen = _thinned(_surer(known, confidence, min_confidence, sigma), max_points)

    @cached_property
    def points(self) -> Points:
        """The points (P, 3): x right, y down, z forward, from the reference view's camera."""
        depth = self.camera.scale / (self.disparity[self.chosen].astype(np.float64) + self.camera.offset)
        pixels = np.argwhere(self.chosen)[:, ::-1].astype(np.float64)
        from_axis = (pixels - self.principal_points[self.reference]) / self.camera.focal_px
        return np.column_stack([from_axis, np.ones(len(pixels))]) * depth[:, None]

    @property
    def colours(self) -> Colours:
        """Colours of the points, (P, 3) RGB."""
        return self.picture(self.reference)[self.chosen]

    def project(self, points: Points, view: int) -> Points:
        """Pixels ``(x, y)``, shape (P, 2), at which a view sees points (P, 3) in front of the cameras."""
        seen = points - self.centres[view]
        return np.asarray(self.principal_points[view] + self.camera.focal_px * seen[:, :2] / seen[:, 2:], np.float64)

    def picture(self, view: int) -> Colours:
        """A view as RGB of 8 bits, which all programs read; shape (H, W, 3)."""
        unit = np.clip(as_unit_float(self.light_field.rgb_views[self.positions[view]]), 0, 1)
        return np.rint(255 * unit).astype(np.uint8)

    def carried(self, view: int) -> FloatMap:
        """Disparity of a view, (H, W) float32; NaN at unknown and missing pixels."""
        missing = self.light_field.missing
        found = self._seen(view, self.disparity, self.surfaces, lambda *where: carried_map(self.disparity, *where))
        return found if missing is None else np.where(missing[self.positions[view]], np.float32(np.nan), found)

    def depth(self, carried: FloatMap) -> FloatMap:
        """Depth of a view, (H, W) float32, from its :meth:`carried` disparity; 0 where unknown."""
        depth = self.camera.depth(carried)
        return np.where(np.isfinite(depth) & ~np.isnan(carried), depth, np.float32(0))

    def depth_sigma(self, view: int, carried: FloatMap) -> FloatMap:
        """Standard deviation of the depth of a view, (H, W) float32, given its :meth:`carried` disparity; 0 without
        depth. For views that are :attr:`sure`.
        """
        assert self.sigma is not None
        own = self.sigma
        sigma = self._seen(view, own, self.sigmas, lambda *where: carried_values(self.disparity, own, *where))
        return np.where(self.depth(carried) > 0, self.camera.depth_sigma(carried, sigma), np.float32(0))

    def _seen(self, view: int, own: FloatMap, others: Surfaces | None, warped: Callable[..., FloatMap]) -> FloatMap:
        """A map of a view: the reference view's own, that of ``others``, else the own one ``warped``."""
        if view == self.reference:
            return own
        if others is not None:
            return others(self.positions[view])
        return warped(tuple(self.baselines[view].tolist()), ~np.isnan(self.disparity))

    def pixel_errors(self, sees: npt.NDArray[np.bool_]) -> npt.NDArray[np.float64]:
        """Expected reprojection error of the points, mean over views, (P,), pixels; 0 where unknown.

        Parameters
        ----------
        sees : ndarray, shape (N, P), bool
            Whether a view sees a point.
        """
        if self.sigma is None:
            return np.zeros(sees.shape[1])
        # an error of sigma per view step grows with the view's distance
        steps = np.linalg.norm(self.baselines, axis=1)
        mean = (sees * steps[:, None]).sum(axis=0) / np.maximum(sees.sum(axis=0), 1)
        return np.asarray(self.sigma[self.chosen].astype(np.float64) * mean)

    def normals(self, view: int, carried: FloatMap) -> FloatMap:
        """Unit normals of a view's surfaces in its camera's axes, towards it, (3, H, W) float32; 0 without depth.

        Inverse depth, and so disparity, is linear on a plane, so its slopes give the normal exactly.
        """
        down, across = (_slopes(carried, axis) for axis in (0, 1))
        x, y = self.principal_points[view]
        row, column = np.indices(carried.shape)
        ahead = carried + self.camera.offset - across * (column - x) - down * (row - y)
        facing = -np.stack([self.camera.focal_px * across, self.camera.focal_px * down, ahead])
        known = (self.depth(carried) > 0) & np.isfinite(facing).all(axis=0)
        length = np.linalg.norm(facing, axis=0)
        return np.where(known, facing / np.where(known, length, 1), 0).astype(np.float32)

    def sees(self, view: int, carried: FloatMap) -> npt.NDArray[np.bool_]:
        """Points that a view sees, (P,), given its :meth:`carried` disparity: those inside it that nothing nearer
        occludes.
        """
        baseline, disparity = self.baselines[view], self.disparity[self.chosen].astype(np.float64)
        there = np.argwhere(self.chosen) - disparity[:, None] * baseline
        inside = ((there > -0.5) & (there < np.array(carried.shape) - 0.5)).all(axis=1)
        # positions outside may exceed integers
        rows, columns = np.rint(np.where(inside[:, None], there, 0)).astype(np.int64).T
        # comparison with NaN is false, so unknown pixels see no points
        nearer = (carried[rows, columns] - disparity) * float(np.abs(baseline).max())
        return np.asarray(inside & (nearer <= _APART), bool)


def _slopes(disparity: FloatMap, axis: int) -> npt.NDArray[np.float64]:
    """Change of disparity from pixel to pixel along an axis, to the neighbour that differs less; 0 without any."""
    steps = np.diff(disparity.astype(np.float64), axis=axis)
    ends = np.full((1, steps.shape[1]) if axis == 0 else (steps.shape[0], 1), np.nan)
    before, after = np.concatenate([ends, steps], axis), np.concatenate([steps, ends], axis)
    # differences from unknown pixels are infinite
    size_before, size_after = (np.nan_to_num(np.abs(slope), nan=np.inf) for slope in (before, after))
    return np.nan_to_num(np.where(size_before <= size_after, before, after))


def _surer(known: BoolMap, confidence: FloatMap | None, least: float | None, sigma: FloatMap | None) -> BoolMap:
    """The known pixels with enough confidence for a point."""
    if sigma is not None and least is None and known.any():
        # by sigma, since many pixels share the largest confidence
        return known & (sigma <= np.median(sigma[known]))
    if confidence is None or not known.any():
        return known
    # unknown confidence counts as 0
    sureness = np.nan_to_num(confidence, nan=-1.0)
    return known & (sureness >= (np.median(sureness[known]) if least is None else least))


def _thinned(sure: BoolMap, most: int) -> BoolMap:
    """At most this number of the pixels: those on every n-th row and column, with the smallest possible n."""
    step = 1
    while sure[step // 2 :: step, step // 2 :: step].sum() > most:
        step += 1
    chosen = np.zeros_like(sure)
    chosen[step // 2 :: step, step // 2 :: step] = sure[step // 2 :: step, step // 2 :: step]
    return chosen
