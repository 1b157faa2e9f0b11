"""Planes of regions without texture, from how their light changes.

What no window of some pixels tells, a whole region may: where light falls off along a wall by a tenth of a level per
pixel, views that are shifted against each other by a wrong disparity differ by as little everywhere, and tens of
thousands of pixels of all views add up to hundredths of a pixel. The sums are those of Gauss-Newton
(:mod:`sepi.matching.gauss_newton`), for the three coefficients of a plane in place of each pixel's disparity, and with
the slopes of the light fitted in windows within the region: slopes between neighbours would be noise.

How sure a plane is follows from the noise and from what is left between whole views: that one is brighter than another
looks like a shift of a slope. Whether a region is a plane at all, parts of it tell, which must not ask for another
disparity by more than noise explains.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import cv2
import numpy as np
import numpy.typing as npt

from sepi.lightfield import BoolMap, DisparityRange, FloatMap, LightField, full_scale
from sepi.regularization.regions import Plane, Region, basis_of

if TYPE_CHECKING:
    from sepi.matching.gauss_newton import GaussNewton

UNLIKE = 0.01 / 255
"""Standard deviation by which a whole view is brighter than another, at least; colours in 0..1."""

_STEPS = 4
"""Gauss-Newton steps: light changes so slowly that few are enough from anywhere in the range."""

_SLOPE_RADIUS = 8
"""Slopes are fitted in windows of 2 r + 1 pixels."""

_BEYOND = 0.1
"""Distance by which a plane may leave the range, on average, pixels per view step."""

_MOST_SQUEEZED = 0.5
"""Of its width, by which a view may see a plane narrower than the reference does: at 1 it is seen from behind."""

_PART = 24
"""Width of the parts that are asked, pixels."""


@dataclass(frozen=True)
class LitPlane:
    """A plane and how well the views know it.

    Attributes
    ----------
    plane : Plane
    covariance : ndarray, shape (3, 3), float64
    misfit : float
        Mean square of what parts of the region ask for, in units of its variance by noise: 1 on a plane.
    """

    plane: Plane
    covariance: npt.NDArray[np.float64]
    misfit: float

    def deviation(self, basis: npt.NDArray[np.float64]) -> float:
        """Standard deviation of the disparity over points ``basis`` (N, 3), root mean square."""
        mean = _weighted(basis, np.full(len(basis), 1 / len(basis)))
        return float(np.sqrt(np.maximum(np.sum(self.covariance * mean), 0)))

    def distance(self, plane: Plane) -> float:
        """Standard deviations that another plane is away, over the three coefficients."""
        difference = plane - self.plane
        return float(np.sqrt(np.maximum(difference @ np.linalg.solve(self.covariance, difference), 0)))


def lit_planes(
    light_field: LightField,
    matching: GaussNewton,
    disparity: FloatMap,
    regions: list[Region],
    starts: list[Plane],
    variance: FloatMap,
) -> list[LitPlane | None]:
    """Planes of some regions, by all views.

    Parameters
    ----------
    light_field : LightField
        With a known disparity range.
    matching : GaussNewton
        Of its views, colours alone.
    disparity : ndarray, shape (H, W), float32
        Outside the regions, what hides them in some views.
    regions : list of Region
        That no pixel belongs to twice.
    starts : list of Plane
        To begin with.
    variance : ndarray, shape (H, W), float32
        Of the noise of one channel of a view, colours in 0..1.

    Returns
    -------
    list of LitPlane or None
        None where nothing can be told, or what is told lies beyond the range or is no surface that all views see.
    """
    known = light_field.require_disparity_range()
    planes: list[Plane | None] = [start.copy() for start in starts]
    found: list[LitPlane | None] = [None] * len(regions)
    disparity = disparity.copy()
    for step in range(_STEPS + 1):
        for n, (region, plane) in enumerate(zip(regions, planes, strict=True)):
            if plane is not None:
                planes[n], disparity[region.place][region.pixels] = _within(region, plane, known)
        mean = matching.mean(disparity)
        slopes = np.zeros((2, *mean.shape), np.float32)
        inner = [_slopes(pixels, mean[place], slopes[:, *place]) for place, pixels in regions]
        gradient, curvature = matching.gradient_and_hessian(mean, disparity, (slopes[0], slopes[1]))
        for n, (region, pixels) in enumerate(zip(regions, inner, strict=True)):
            plane, place = planes[n], region.place
            if plane is None:
                continue
            sums = _Sums.of(pixels, gradient[place], curvature[place])
            moved = None if sums is None else sums.plane()
            if sums is None or moved is None:
                planes[n] = None
            elif step < _STEPS:
                planes[n] = plane + moved
            else:
                unlike = _unlike(light_field, matching, place, pixels, disparity[place], mean[place], variance[place])
                spread = sums.spread(variance[place], slopes[:, *place], unlike, light_field, matching)
                asked = region.basis @ (plane + moved)
                beyond = asked - np.clip(asked, known.minimum, known.maximum)
                if np.abs(beyond).mean() < _BEYOND and _squeezed(plane, light_field) < _MOST_SQUEEZED:
                    found[n] = LitPlane(plane, *spread)
    return found


def _within(region: Region, plane: Plane, known: DisparityRange) -> tuple[Plane, npt.NDArray[np.float64]]:
    """A plane whose middle is brought back into the range, where the next step begins, and its disparities there."""
    basis = region.basis
    middle = float(np.mean(basis @ plane))
    plane = plane + np.array([np.clip(middle, known.minimum, known.maximum) - middle, 0, 0])
    return plane, np.clip(basis @ plane, known.minimum, known.maximum)


def _squeezed(plane: Plane, light_field: LightField) -> float:
    """Largest share of its width by which a view sees a plane narrower than the reference does, by ``p - d(p) v``."""
    _, across, down = plane
    return float(np.abs(light_field.baselines[light_field.present] @ np.array([down, across])).max())


def _unlike(
    light_field: LightField,
    matching: GaussNewton,
    place: tuple[slice, slice],
    region: BoolMap,
    disparity: FloatMap,
    mean: FloatMap,
    variance: FloatMap,
) -> float:
    """Variance by which whole views are brighter than others, over a region where noise has the rest to itself."""
    y, x = (
        axis + np.float32(side.start) for axis, side in zip(np.indices(region.shape, np.float32), place, strict=True)
    )
    scale, most = np.float32(1 / full_scale(light_field.views.dtype)), 16 * variance[..., None]
    offsets: list[npt.NDArray[np.float64]] = []
    for (v, u), view in zip(
        light_field.baselines[matching.present].astype(np.float32), light_field.rgb_views[matching.present], strict=True
    ):
        samples = cv2.remap(
            view.astype(np.float32), x - disparity * u, y - disparity * v, cv2.INTER_LINEAR, borderValue=(-1e3,) * 3
        )
        residual = (samples * scale - mean[..., :3])[region]
        like = (np.square(residual) < most[region]).all(axis=1)
        if like.sum() > 0.5 * like.size:
            offsets.append(residual[like].mean(axis=0, dtype=np.float64))
    noise = float(variance[region].mean() / region.sum())
    left = float(np.var(offsets, axis=0).mean()) if offsets else 0.0
    return max(left - noise, UNLIKE**2)


@dataclass(frozen=True)
class _Sums:
    """Gauss-Newton sums of the pixels of one region."""

    region: BoolMap
    basis: npt.NDArray[np.float64]
    gradient: npt.NDArray[np.float64]
    curvature: npt.NDArray[np.float64]
    information: npt.NDArray[np.float64]

    @classmethod
    def of(cls, region: BoolMap, gradient: FloatMap, curvature: FloatMap) -> _Sums | None:
        """Of the pixels ``region`` (h, w); None where there are too few."""
        terms = basis_of(region)
        if len(terms) < _PART**2 // 4:
            return None
        h = curvature[region].astype(np.float64)
        return cls(region, terms, gradient[region].astype(np.float64), h, _weighted(terms, h))

    def plane(self) -> Plane | None:
        """By how much the plane changes; None where the views say nothing of one of its coefficients."""
        if np.linalg.cond(_scaled(self.information)) > 1e6:
            return None
        return np.asarray(np.linalg.solve(self.information, np.einsum("ni,n->i", self.basis, self.gradient)))

    def spread(
        self, variance: FloatMap, slopes: FloatMap, unlike: float, field: LightField, matching: GaussNewton
    ) -> tuple[npt.NDArray[np.float64], float]:
        """Covariance of the plane, and its misfit; ``unlike`` is the variance between whole views."""
        varied = self.curvature * variance[self.region] / matching.colour_variance
        sums = _weighted(self.basis, varied)
        # a view's offset changes each gradient by itself times the slope that is seen from there
        down, across = (np.einsum("ni,nc->ic", self.basis, slope[self.region][:, :3]) for slope in slopes)
        for v, u in field.baselines[matching.present]:
            pull = (v * down + u * across) / matching.colour_variance
            sums += unlike * pull @ pull.T
        inverse = np.linalg.inv(self.information)
        return inverse @ sums @ inverse, self._misfit(varied)

    def _misfit(self, varied: npt.NDArray[np.float64]) -> float:
        # squares side by side from the middle of the region: it lies in the same ones when it is turned
        down, across = (
            (2 * at + 1 - size) // (2 * _PART) + size
            for at, size in zip(np.nonzero(self.region), self.region.shape, strict=True)
        )
        part = down * 2 * self.region.shape[1] + across
        asked, expected = (np.bincount(part, values) for values in (self.gradient, varied))
        many = np.bincount(part) >= _PART**2 // 2
        if not many.any():
            return np.nan
        return float(np.mean(asked[many] ** 2 / np.maximum(expected[many], 1e-30)))


def _weighted(terms: npt.NDArray[np.float64], weights: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Sum of the products of terms (N, 3) with each other, (3, 3); a product of matrices rounds as threads have it."""
    return np.asarray(np.einsum("ni,n,nj->ij", terms, weights, terms))


def _scaled(matrix: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    scale = np.sqrt(np.maximum(np.diag(matrix), 1e-300))
    return np.asarray(matrix / np.outer(scale, scale))


def _slopes(region: BoolMap, mean: FloatMap, slopes: FloatMap) -> BoolMap:
    """Smooth colours of a region in place of ``mean`` (h, w, 4), their slopes down and across, and where they hold."""
    size = (2 * _SLOPE_RADIUS + 1,) * 2

    def window(values: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
        return np.asarray(cv2.boxFilter(values, -1, size, normalize=False, borderType=cv2.BORDER_CONSTANT))

    height, width = region.shape
    mask = region.astype(np.float64)
    y, x = np.arange(height)[:, None] * mask, np.arange(width) * mask
    count = np.maximum(window(mask), 1)
    my, mx = window(y) / count, window(x) / count
    yy, xx, xy = window(y * y) / count - my**2, window(x * x) / count - mx**2, window(x * y) / count - mx * my
    determinant = yy * xx - xy**2
    inner = region & (count >= _SLOPE_RADIUS**2) & (determinant > _SLOPE_RADIUS**2)
    inner &= cv2.erode(region.astype(np.uint8), np.ones((5, 5), np.uint8), borderValue=1) > 0
    determinant = np.maximum(determinant, 1)
    for c in range(3):
        colour = mean[..., c] * mask
        m = window(colour) / count
        cy, cx = window(colour * y) / count - m * my, window(colour * x) / count - m * mx
        down, across = (xx * cy - xy * cx) / determinant, (yy * cx - xy * cy) / determinant
        smooth = m + down * (np.arange(height)[:, None] - my) + across * (np.arange(width) - mx)
        mean[..., c] = np.where(inner, smooth, mean[..., c])
        slopes[0, ..., c], slopes[1, ..., c] = np.where(inner, down, 0), np.where(inner, across, 0)
    return inner
