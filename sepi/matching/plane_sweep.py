"""The plane sweep: photo-consistency of every candidate disparity over all views or over groups of them (Eq. 3).

The straight line through a SEPI meets one sample of every view, so Eq. 3 of [1]_ is a plane sweep: for a candidate
``d`` the reference-view pixel ``(y, x)`` is compared with the bilinear sample of the view of baseline ``(v, u)`` at
``(y - d v, x - d u)``. One ``(d, view)`` has one sub-pixel weight for the whole image, so a row is a run
of contiguous multiply-adds that vectorises. Views are summed in *groups* (all of them for a SEPI; the parts from which
half-SEPIs are put together), so one pass serves full and half SEPIs alike.
The compiled loops are in ``kernels/plane_sweep.cpp``.

References
----------
.. [1] Zhou, Shi, Liu, Jin, Zhang, Hou: Light Field Depth Estimation via Stitched Epipolar Plane Images.
"""

import math
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt
from pydantic import Field

from sepi.image.noise import reference_residual_variance
from sepi.image.texture import variance_within_surface
from sepi.kernels import LANES
from sepi.kernels import plane_sweep as kernels
from sepi.lightfield import BoolMap, FloatMap, LightField, full_scale
from sepi.matching.candidates import CandidateParameters, CandidateRule, number_field
from sepi.matching.denoising import sure_noise
from sepi.matching.expected_costs import expected_costs
from sepi.matching.nearest_surfaces import shown_columns
from sepi.matching.softening import Softening, softened
from sepi.matching.sweep_arrays import ViewStack, Window, sampled_candidates
from sepi.matching.view_noise import ViewNoise
from sepi.matching.view_subsets import ViewSubsets
from sepi.process.threads import threads_used
from sepi.stage import Progress, no_progress

CANDIDATES = CandidateRule(usual=181, finest=0.02, coarsest=0.5)
"""The paper's number, for light fields like the paper's."""

TILE_WIDTH = 128
"""Columns computed at a time, which bounds the memory of a thread for any image width, and keeps it in the cache."""

TEXTURE_SHARE = 0.05
"""Of the texture around a pixel, that widens its window; more would join thin structures to what is behind them."""

NOISE_LEFT_OUT = 0.9
"""Largest share of the cost of noise alone that confidence leaves out: with all of it, Eq. 5 would be 0 / 0 in pure
noise."""


class SweepParameters(CandidateParameters):
    """Parameters of a plane sweep."""

    rule: ClassVar[CandidateRule] = CANDIDATES

    num_disparities: int | None = number_field(CANDIDATES, "docs/method/paper.md")
    scale: float = Field(
        0.0165,
        ge=1e-6,
        le=2,
        description="residual at which the robust photo-consistency is one half; RGB distance, colours in 0..1",
    )
    window_radius: int = Field(3, ge=0, le=10, description="cost window of 2 r + 1 pixels, in pixels; 0: none")
    window_sigma: float = Field(
        0.02, ge=1e-6, le=10, description="RGB distance at which a window pixel's weight falls, colours in 0..1"
    )
    correct_noise: bool = Field(
        True,
        description="whether costs are corrected for the effect of interpolation on noise, and confidence for most of "
        "the cost of noise",
    )
    softening: Softening = 0.7

    @property
    def groups(self) -> int:
        """Largest number of view groups whose costs are summed separately."""
        return 1

    def noise_to_correct(self, light_field: LightField) -> ViewNoise | None:
        """Noise whose costs are corrected; None if it may be texture, which the correction would harm."""
        return sure_noise(light_field) if self.correct_noise else None

    def sweep_bytes(self, light_field: LightField, threads: int) -> int:
        """Bytes that :func:`sweep` takes beside views and maps: the views by channel, and each thread's arrays."""
        height, width = light_field.shape
        busy = min(threads, -(-height // _rows_at_a_stretch(height, threads)))
        views = light_field.views.dtype.itemsize * 3 * math.prod((*light_field.grid, height, width + LANES))
        return views + busy * self.thread_bytes(self.number(light_field), width)

    def thread_bytes(self, number: int, width: int) -> int:
        """Bytes that a thread of :func:`sweep` holds, by number of candidates and image width.

        It holds, for every candidate and group, the costs and the numbers of samples in the rows of a window, and
        their sums over the windows of a block of pixels.
        """
        size, vectors = 2 * self.window_radius + 1, -(-number // LANES)
        columns = min(width, TILE_WIDTH) + 2 * self.window_radius + LANES
        return 4 * 2 * (size * columns + kernels.BLOCK) * self.groups * vectors * LANES


@dataclass(frozen=True)
class SweepResult:
    """Best candidate of each pixel for each of N subsets of the views.

    Attributes
    ----------
    disparity, cost, mean : ndarray, shape (N, H, W), float32
        Disparity at the minimum, refined below the disparity sampling by a parabola; the cost there (0..1, or a little
        below 0 where noise is corrected); the mean cost over all candidates. NaN outside the mask.
    of_noise : ndarray, shape (H, W), float32
        Cost that noise alone makes; 0 where it is not corrected.
    """

    disparity: FloatMap
    cost: FloatMap
    mean: FloatMap
    of_noise: FloatMap

    def confidence(self) -> FloatMap:
        """Eq. 5, mean over minimum, brought from 1..inf to 0..1 as ``1 - min / mean``; 0 where all costs are zero.

        Where noise is corrected, both leave out the share :data:`NOISE_LEFT_OUT` of the cost of noise alone.
        """
        # the mean keeps at least what it has in pure noise
        of_noise = np.minimum(NOISE_LEFT_OUT * self.of_noise, self.mean - (1 - NOISE_LEFT_OUT) * self.of_noise)
        with np.errstate(divide="ignore", invalid="ignore"):
            confidence = np.where(self.mean > of_noise, 1 - (self.cost - of_noise) / (self.mean - of_noise), 0)
        return np.clip(confidence, 0, 1).astype(np.float32)


def planar(light_field: LightField) -> npt.NDArray[Any]:
    """Views as ``(T, S, 3, H, W + LANES)``, each channel's rows contiguous, in their own number type."""
    views = light_field.rgb_views
    T, S, H, W, _ = views.shape
    planes = np.zeros((T, S, 3, H, W + LANES), views.dtype)
    planes[..., :W] = np.moveaxis(views, -1, 2)
    return planes


def sweep(
    light_field: LightField,
    parameters: SweepParameters,
    *,
    subsets: ViewSubsets | None = None,
    mask: BoolMap | None = None,
    progress: Progress = no_progress,
) -> SweepResult:
    """Sweep the candidate disparities and keep the best one of each pixel and subset of views.

    The noise of the reference view widens scale and window, so that noise alone looks neither like a mismatch nor like
    another surface. Costs are corrected for interpolated noise (:mod:`sepi.matching.expected_costs`).

    Parameters
    ----------
    light_field : LightField
        With a known disparity range.
    parameters : SweepParameters
    subsets : ViewSubsets, optional
        Default: all views.
    mask : ndarray, shape (H, W), bool, optional
        Pixels to compute. Default: all.
    progress : callable, optional

    Returns
    -------
    SweepResult

    Raises
    ------
    SepiError
        If the disparity range is unknown.
    """
    H, W = light_field.shape
    all_views = ViewSubsets(np.zeros(light_field.grid, np.int64), np.ones((1, 1), bool), ("full",))
    among = subsets or all_views
    groups = np.where(light_field.present, among.groups, -1)
    groups[light_field.reference_position] = -1  # the reference view agrees with itself at every candidate
    groups, chosen = _without_empty(groups, among.subsets)
    mask = np.ones((H, W), bool) if mask is None else mask
    compared = softened(light_field, parameters.softening)
    colours = planar(compared)
    noise = reference_residual_variance(light_field)
    squared_scale = parameters.scale**2 + noise
    scale2 = np.float32(squared_scale * full_scale(colours.dtype) ** 2)
    shown = shown_columns(light_field)
    views = ViewStack(colours, *light_field.reference_position, groups, chosen, scale2, shown)
    disparities = parameters.candidates(light_field)
    candidates = sampled_candidates(disparities, light_field.baselines)
    # noise of views that a blur has changed in part is seldom sure, and then nothing is corrected
    to_correct = parameters.noise_to_correct(compared)
    expected = expected_costs(compared, to_correct, candidates, groups, chosen, squared_scale, LANES)
    guide = np.ascontiguousarray(light_field.reference_view.transpose(2, 0, 1))
    # where texture repeats, a window of one of its colours would hold all aliases alike
    variance = variance_within_surface(light_field.reference_view, parameters.window_sigma**2 + noise, TEXTURE_SHARE)
    window = Window(guide, parameters.window_radius, variance)
    best, cost, mean = maps = np.full((3, len(chosen), H, W), np.nan, np.float32)
    height = _rows_at_a_stretch(H, threads_used())
    strip = height * threads_used()
    for begin in range(0, H, strip):
        end = min(H, begin + strip)
        kernels.sweep_plane_rows(views, candidates, window, expected, mask, begin, end, height, TILE_WIDTH, maps)
        progress(end / H)
    return SweepResult(best, cost, mean, expected.anywhere)


def _rows_at_a_stretch(height: int, threads: int) -> int:
    """Rows of one task: two tasks for each thread, so that all have work and progress shows.

    Neighbouring tasks repeat the window's rows above and below a task, so tasks must not have too few rows.
    """
    return max(16, min(128, -(-height // (2 * threads))))


def _without_empty(groups: npt.NDArray[np.int64], subsets: BoolMap) -> tuple[npt.NDArray[np.int64], BoolMap]:
    """Groups renumbered without empty ones, and the subsets of them."""
    used = np.unique(groups[groups >= 0])
    numbers = np.full(subsets.shape[1] + 1, -1)
    numbers[used] = np.arange(len(used))
    # -1, no group, picks the last number, which is -1
    return numbers[groups], np.ascontiguousarray(subsets[:, used])
