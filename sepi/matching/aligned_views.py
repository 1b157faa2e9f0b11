"""Views aligned with the reference view by a map, sampled in bands of rows; every sum over views uses them.

The mean of other views replaces the reference view in noisy light fields. The noise of that view is in every residual
alike, so no number of views averages it away. The mean of the views that see a pixel according to the current map has
hardly any noise. Views unlike the reference view count less in the mean, so it stays near the reference view where the
map is wrong.

No view is compared with a mean that it is part of. Its own noise would make it fit best at the map's current disparity,
and in strong noise every error would stay.
"""

from collections.abc import Callable

import numpy as np

from sepi.kernels import gauss_newton as kernels
from sepi.lightfield import BoolMap, FloatMap, LightField, without_reference
from sepi.matching.base_detail import BaseDetailParameters, forget_detail
from sepi.matching.nearest_surfaces import SeenViews
from sepi.matching.row_bands import Band, row_bands
from sepi.matching.spline_views import SplineViews, forget_splines, spline_views

LEAST_OTHERS = 8
"""Views that are not compared: with the reference view, their mean has a ninth of the noise's variance."""

BYTES_PER_PIXEL = 2 * 4 + 2 + 4
"""Of a pixel of a view: four coefficients, the detail, and the z-buffer."""


class AlignedViews:
    """Views of a light field, sampled where a disparity map places the pixels of the reference view.

    Parameters
    ----------
    light_field : LightField
    parameters : BaseDetailParameters
        How well colours and detail must fit.
    occlusion_margin : float
        By how much an occluder must be nearer, pixels per view step.
    present : ndarray, shape (T, S), bool, optional
        The views that are compared; all unless given.
    """

    def __init__(
        self,
        light_field: LightField,
        parameters: BaseDetailParameters,
        occlusion_margin: float,
        present: BoolMap | None = None,
    ) -> None:
        self._light_field = light_field
        self._parameters = parameters
        self.present = light_field.present if present is None else present
        self._others = without_reference(light_field, self.present)
        self._margin = occlusion_margin
        # of the whole picture, where there is memory for it
        self._splines: SplineViews | None = None
        self._seen: tuple[FloatMap, SeenViews] | None = None

    def mean(self, disparity: FloatMap) -> FloatMap:
        """Mean of the views that see each pixel.

        Parameters
        ----------
        disparity : ndarray, shape (H, W), float32
            Pixels per view step.

        Returns
        -------
        ndarray, shape (H, W, 4), float32
            Colours, and detail or 0.
        """
        mean = np.empty((*disparity.shape, 4), np.float32)

        def add(views: SplineViews, seen: SeenViews, band: Band) -> None:
            kernels.mean_of_views(views, seen, disparity, band.begin, band.end, mean)

        self.in_bands(disparity, add)
        return mean

    def in_bands(self, disparity: FloatMap, add: Callable[[SplineViews, SeenViews, Band], None]) -> None:
        """Call ``add`` with the splines of the views, and what hides them, for each band of rows."""
        field = self._light_field
        bands = row_bands(field, self.present, float(np.abs(disparity).max()), BYTES_PER_PIXEL)
        if len(bands) == 1:
            if self._splines is None:
                self._splines = spline_views(field, self._parameters, bands[0].rows, self.present)
            if self._seen is None or self._seen[0] is not disparity:
                self._seen = None
                self._seen = disparity, self._seen_views(disparity, bands[0])
            add(self._splines, self._seen[1], bands[0])
            return
        for band in bands:
            if band.rows != (0, field.shape[0]):
                # those of all rows, which another band may need, are kept
                forget_splines(field)
            views = spline_views(field, self._parameters, band.rows, self.present)
            add(views, self._seen_views(disparity, band), band)
            # before the next ones are made
            del views
        forget_splines(field)

    def _seen_views(self, disparity: FloatMap, band: Band) -> SeenViews:
        return SeenViews.of(self._light_field, disparity, self._others, band.rows, self._margin)

    def forget_detail(self) -> None:
        """Free the detail of the views when later steps need only their splines."""
        if self._splines is not None:
            forget_detail(self._light_field)


def mean_reference(
    light_field: LightField,
    disparity: FloatMap,
    compared: BoolMap,
    parameters: BaseDetailParameters,
    occlusion_margin: float,
) -> FloatMap | None:
    """Mean, at each pixel, of the views that see it and are not compared.

    Parameters
    ----------
    light_field : LightField
        Denoised.
    disparity : ndarray, shape (H, W), float32
        By which they are aligned, pixels per view step.
    compared : ndarray, shape (T, S), bool
        The views that are to be compared with it.
    parameters : BaseDetailParameters
        How well colours must fit.
    occlusion_margin : float
        By how much an occluder must be nearer, pixels per view step.

    Returns
    -------
    ndarray, shape (H, W, 3), float32, or None
        Colours, 0..1; None if there are too few other views.
    """
    others = light_field.present & ~compared
    if others.sum() < LEAST_OTHERS:
        return None
    colours_alone = parameters.model_copy(update={"use_detail": False})
    mean = AlignedViews(light_field, colours_alone, occlusion_margin, others).mean(disparity)[..., :3]
    # later steps need the memory
    forget_splines(light_field)
    return np.ascontiguousarray(mean)
