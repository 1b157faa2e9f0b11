"""Cost curves of a single pixel, whose minimum the sweep finds (Eq. 3-5 of [1]_).

:func:`sepi.matching.plane_sweep.sweep` keeps no cost curves. This module computes those of one pixel again, in NumPy,
from the few samples in its aggregation window.

References
----------
.. [1] Zhou, Shi, Liu, Jin, Zhang, Hou: Light Field Depth Estimation via Stitched Epipolar Plane Images.
"""

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import map_coordinates

from sepi.errors import SepiError
from sepi.image.noise import residual_variance
from sepi.image.texture import variance_within_surface
from sepi.lightfield import FloatMap, LightField, as_unit_float, full_scale
from sepi.matching.expected_costs import expected_costs
from sepi.matching.plane_sweep import TEXTURE_SHARE, SweepParameters
from sepi.matching.softening import softened
from sepi.matching.sweep_arrays import sampled_candidates
from sepi.matching.view_subsets import halves_and_quarters


@dataclass(frozen=True)
class Curves:
    """Cost of every candidate at one pixel, for all views and for the halves and quarters of the view grid.

    Attributes
    ----------
    disparities : ndarray, shape (K,), float32
        Candidates, uniform, pixels per view step.
    names : tuple of str, length N
        Subsets of the views, as :func:`sepi.matching.view_subsets.halves_and_quarters` names them.
    costs : ndarray, shape (N, K), float32
        Aggregated mean of the robust photo-consistency (Eq. 3), 0..1 (or slightly below 0 with the correction for
        noise); 1 if no view of the subset sees the pixel.

    Examples
    --------
    An occluder on the right of a pixel hides it from views on the right; views on the left see it well:

    >>> from sepi import initial
    >>> from sepi.extensions.page.curves import Curves, cost_curves
    >>> from sepi.scenes import render
    >>> light_field = render("curved_occluders", size=96, views=5)
    >>> found = cost_curves(light_field, 24, 6, initial.CHOICES["sepi"].parameters(num_disparities=61))
    >>> isinstance(found, Curves), found.names[:5]
    (True, ('full', 'left', 'right', 'up', 'down'))
    >>> lowest = {name: found.minimum(name)[1] for name in ("full", "left", "right")}
    >>> lowest["left"] < lowest["full"] < lowest["right"]
    True
    """

    disparities: FloatMap
    names: tuple[str, ...]
    costs: FloatMap

    def minimum(self, name: str = "full") -> tuple[float, float]:
        """Disparity of a subset's lowest cost (Eq. 4), and that cost.

        As in the sweep, the first of equal minima counts, and the ends and perfect matches are not refined.

        Parameters
        ----------
        name : str
            Name of the subset.

        Returns
        -------
        disparity : float
            Refined by a parabola, pixels per view step.
        cost : float
            Lowest cost.
        """
        costs = self.costs[self.names.index(name)].astype(np.float64)
        best = int(costs.argmin())
        offset = 0.0
        if costs[best] != 0 and 0 < best < len(costs) - 1:
            before, lowest, after = costs[best - 1 : best + 2]
            curvature = before - 2 * lowest + after
            offset = 0.5 * (before - after) / curvature if curvature > 0 else 0.0
        step = float(self.disparities[-1] - self.disparities[0]) / (len(costs) - 1)
        return float(self.disparities[best]) + offset * step, float(costs[best])

    def best_subset(self) -> str:
        """Name of the subset with the lowest cost; the first of equal ones.

        Returns
        -------
        str
        """
        return self.names[int(self.costs.min(axis=1).argmin())]


def cost_curves(light_field: LightField, y: int, x: int, parameters: SweepParameters) -> Curves:
    """Cost of every candidate at one pixel, as in the initial depth (:func:`sepi.initial.sepi`; Eq. 3 of [1]_).

    Parameters
    ----------
    light_field : LightField
        With a known disparity range.
    y, x : int
        Pixel of the reference view.
    parameters : SweepParameters

    Returns
    -------
    Curves

    Raises
    ------
    SepiError
        If the pixel lies outside the reference view or the disparity range is unknown.

    References
    ----------
    .. [1] Zhou, Shi, Liu, Jin, Zhang, Hou: Light Field Depth Estimation via Stitched Epipolar Plane Images.
       arXiv:2203.15201.

    Examples
    --------
    >>> from sepi import initial
    >>> from sepi.extensions.page.curves import cost_curves
    >>> from sepi.scenes import render
    >>> light_field = render("fronto_parallel", size=64, views=3)
    >>> found = cost_curves(light_field, 32, 32, initial.CHOICES["sepi"].parameters(num_disparities=41))
    >>> found.disparities.shape, found.costs.shape  # all views, four halves and four quarters
    ((41,), (9, 41))
    >>> disparity, cost = found.minimum("full")
    >>> round(disparity, 2), cost < 0.01
    (1.0, True)
    """
    (t0, s0), (H, W) = light_field.reference_position, light_field.shape
    if not (0 <= y < H and 0 <= x < W):
        raise SepiError(
            f"{light_field.name}: pixel (y, x) = ({y}, {x}) lies outside the reference view; "
            f"rows go from 0 to {H - 1}, columns from 0 to {W - 1}"
        )
    disparities = parameters.candidates(light_field)
    noise = residual_variance(light_field.reference_view)
    r = parameters.window_radius
    rows = np.arange(max(0, y - r), min(H, y + r + 1))
    columns = np.arange(max(0, x - r), min(W, x + r + 1))
    reference_view = as_unit_float(light_field.rgb_views[t0, s0][np.ix_(rows, columns)])
    difference = reference_view - reference_view[y - rows[0], x - columns[0]]
    variance = variance_within_surface(light_field.reference_view, parameters.window_sigma**2 + noise, TEXTURE_SHARE)
    weights = np.exp(-0.5 * (difference**2).sum(axis=2) / variance[y, x])
    weights = (weights / weights.sum()).astype(np.float32)
    scale2 = np.float32(parameters.scale**2 + noise)
    soft = softened(light_field, parameters.softening)
    compared = soft.rgb_views
    reference_view = as_unit_float(compared[t0, s0][np.ix_(rows, columns)])
    views, baselines = halves_and_quarters(light_field), light_field.baselines
    sums, counts = np.zeros((2, views.subsets.shape[1], len(disparities)), np.float32)
    for t, s in np.argwhere(light_field.present):
        if (t, s) == (t0, s0):
            continue
        v, u = baselines[t, s]
        down, across = rows - disparities[:, None] * v, columns - disparities[:, None] * u
        inside = ((down >= 0) & (down <= H - 1))[:, :, None] & ((across >= 0) & (across <= W - 1))[:, None]
        places = np.broadcast_arrays(down[:, :, None], across[:, None])
        colours = [
            map_coordinates(compared[t, s, :, :, c], places, np.float32, order=1, mode="nearest") for c in range(3)
        ]
        squared = ((np.stack(colours, axis=3) / full_scale(compared.dtype) - reference_view) ** 2).sum(axis=3)
        group = views.groups[t, s]
        sums[group] += np.einsum("kyx,yx->k", squared / (squared + scale2) * inside, weights)
        counts[group] += np.einsum("kyx,yx->k", inside, weights)
    total, number = views.subsets.astype(np.float32) @ sums, views.subsets.astype(np.float32) @ counts
    costs = np.divide(total, number, out=np.ones_like(total), where=number > 0)
    sampled = sampled_candidates(disparities, baselines)
    to_correct = parameters.noise_to_correct(soft)
    expected = expected_costs(soft, to_correct, sampled, views.groups, views.subsets, float(scale2), 1)
    costs = 1 - (1 - costs) / (1 - np.tensordot(expected.weights[:, y, x], expected.moments, 1))
    return Curves(disparities, views.names, costs)
