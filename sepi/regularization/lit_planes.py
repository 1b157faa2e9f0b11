"""Planes of regions without texture, from the gradient of their light.

Light may fall off along a wall by a tenth of a level per pixel. A window of some pixels cannot match this in noise, but
the tens of thousands of pixels of a region, over all views, give its disparity to hundredths of a pixel. The sums are
those of Gauss-Newton (:mod:`sepi.matching.gauss_newton`), with the three coefficients of a plane as unknowns. Slopes of
the light are fitted in windows within the region, since differences of neighbours are mostly noise.

The plane's covariance follows from the noise and from the differences of brightness between whole views, which look
like a shift of a slope. A misfit tells whether the region is a plane: on a plane, the parts of the region ask for the
same disparity within their noise.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from sepi.lightfield import BoolMap, DisparityRange, FloatArray, FloatMap, LightField, full_scale
from sepi.matching.gauss_newton import GaussNewton
from sepi.regularization.regions import Plane, Region, basis_of

UNLIKE = 0.01 / 255
"""Least standard deviation of the brightness of whole views; colours in 0..1."""

_STEPS = 4
"""Number of Gauss-Newton steps; light changes slowly, so a few reach any disparity of the range."""

_SLOPE_RADIUS = 8
"""Radius r of the windows in which slopes are fitted: 2 r + 1 pixels."""

_BEYOND = 0.1
"""Largest mean distance of a plane beyond the range, pixels per view step."""

_MOST_SQUEEZED = 0.5
"""Largest share of a plane's width that it may lose in a view; beyond 1, the view would see it from behind."""

_PART = 24
"""Width of the region's parts for the misfit, pixels."""


@dataclass(frozen=True)
class LitPlane:
    """A plane, its covariance and its misfit.

    Attributes
    ----------
    plane : Plane
    covariance : ndarray, shape (3, 3), float64
    misfit : float
        Mean squared change that parts of the region ask for, divided by its variance by noise: 1 on a plane.
    """

    plane: Plane
    covariance: FloatArray
    misfit: float

    def deviation(self, basis: FloatArray) -> float:
        """Root mean square of the disparity's standard deviation over points ``basis`` (N, 3)."""
        mean = _weighted(basis, np.full(len(basis), 1 / len(basis)))
        return float(np.sqrt(np.maximum(np.sum(self.covariance * mean), 0)))

    def distance(self, plane: Plane) -> float:
        """Mahalanobis distance of another plane, in standard deviations."""
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
    """Planes of regions from the light in all views.

    Parameters
    ----------
    light_field : LightField
        With a known disparity range.
    matching : GaussNewton
        Comparison of its views by colours alone.
    disparity : ndarray, shape (H, W), float32
        Outside the regions, it tells what occludes them in some views.
    regions : list of Region
        No two of them share a pixel.
    starts : list of Plane
        Initial planes.
    variance : ndarray, shape (H, W), float32
        Variance of the noise of one channel of a view, colours in 0..1.

    Returns
    -------
    list of LitPlane or None
        None if the light tells no plane, or one beyond the range, or one that not all views can see.
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


def _within(region: Region, plane: Plane, known: DisparityRange) -> tuple[Plane, FloatArray]:
    """A plane moved so that its mean disparity lies in the range, and its disparities, cut to the range."""
    basis = region.basis
    middle = float(np.mean(basis @ plane))
    plane = plane + np.array([np.clip(middle, known.minimum, known.maximum) - middle, 0, 0])
    return plane, np.clip(basis @ plane, known.minimum, known.maximum)


def _squeezed(plane: Plane, light_field: LightField) -> float:
    """Largest share of a plane's width that it loses or gains in a view, by ``p - d(p) v``."""
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
    """Variance of the mean brightness of whole views over a region, beyond what noise explains."""
    y, x = (
        axis + np.float32(side.start) for axis, side in zip(np.indices(region.shape, np.float32), place, strict=True)
    )
    scale, most = np.float32(1 / full_scale(light_field.views.dtype)), 16 * variance[..., None]
    offsets: list[FloatArray] = []
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
    basis: FloatArray
    gradient: FloatArray
    curvature: FloatArray
    information: FloatArray

    @classmethod
    def of(cls, region: BoolMap, gradient: FloatMap, curvature: FloatMap) -> _Sums | None:
        """Sums over the pixels ``region`` (h, w); None if there are too few."""
        terms = basis_of(region)
        if len(terms) < _PART**2 // 4:
            return None
        h = curvature[region].astype(np.float64)
        return cls(region, terms, gradient[region].astype(np.float64), h, _weighted(terms, h))

    def plane(self) -> Plane | None:
        """Change of the plane; None if the views do not determine one of its coefficients."""
        if np.linalg.cond(_scaled(self.information)) > 1e6:
            return None
        return np.asarray(np.linalg.solve(self.information, np.einsum("ni,n->i", self.basis, self.gradient)))

    def spread(
        self, variance: FloatMap, slopes: FloatMap, unlike: float, field: LightField, matching: GaussNewton
    ) -> tuple[FloatArray, float]:
        """Covariance of the plane, and its misfit; ``unlike`` is the variance between whole views."""
        varied = self.curvature * variance[self.region] / matching.colour_variance
        sums = _weighted(self.basis, varied)
        # an offset of a view changes each gradient by the offset times the slope along the view's baseline
        down, across = (np.einsum("ni,nc->ic", self.basis, slope[self.region][:, :3]) for slope in slopes)
        for v, u in field.baselines[matching.present]:
            pull = (v * down + u * across) / matching.colour_variance
            sums += unlike * pull @ pull.T
        inverse = np.linalg.inv(self.information)
        return inverse @ sums @ inverse, self._misfit(varied)

    def _misfit(self, varied: FloatArray) -> float:
        # squares are laid from the middle of the region, so that a rotated region has the same ones
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


def _weighted(terms: FloatArray, weights: FloatArray) -> FloatArray:
    """Weighted sum of the outer products of terms (N, 3); shape (3, 3).

    einsum, not a matrix product: BLAS rounds depending on the number of threads.
    """
    return np.asarray(np.einsum("ni,n,nj->ij", terms, weights, terms))


def _scaled(matrix: FloatArray) -> FloatArray:
    scale = np.sqrt(np.maximum(np.diag(matrix), 1e-300))
    return np.asarray(matrix / np.outer(scale, scale))


def _slopes(region: BoolMap, mean: FloatMap, slopes: FloatMap) -> BoolMap:
    """Fit smooth colours in a region, into ``mean`` (h, w, 4), and their slopes; returns the mask of fitted pixels."""
    size = (2 * _SLOPE_RADIUS + 1,) * 2

    def window(values: FloatArray) -> FloatArray:
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
