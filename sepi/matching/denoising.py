"""Denoised views.

A Wiener filter [1]_ scales the detail of up to two pixels of each view (what a binomial mean ``1 2 1`` along both axes
removes): it keeps as much as its energy in a window exceeds that of the noise. Texture and edges stay; where nothing
rises above the noise, its variance falls to a seventh. The residual noise hardly depends on a sample's sub-pixel
position. If it did, faint texture would be drawn to some candidates.

Views with little noise stay unchanged. Cost smoothing takes its colours from a reference view that a bilateral filter
[2]_ denoises at edges, too. Noise would otherwise pass for edges, and smoothing stops at edges.

References
----------
.. [1] Lee: Digital image enhancement and noise filtering by use of local statistics. IEEE TPAMI 2(2), 1980.
   doi:10.1109/TPAMI.1980.4766994
.. [2] Tomasi, Manduchi: Bilateral filtering for gray and color images. ICCV 1998. doi:10.1109/ICCV.1998.710815
"""

from dataclasses import dataclass, fields
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt
from pydantic import Field

from sepi.image.noise import noise_level
from sepi.kernels import denoising as kernels
from sepi.lightfield import FloatMap, LightField, full_scale
from sepi.matching.view_noise import PARTS, ViewNoise, part_of_picture, view_noise
from sepi.process.workspace import kept
from sepi.stage import Parameters

LEAST_NOISE = 1.25 / 255
"""Noise that is worth it: less may be that of rounding, and what is left where texture does not fit at whole pixels."""

LEAST_SURE_NOISE = 0.6 / 255
"""The same where it cannot be else: faint noise takes dark walls to other depths, too."""

LEAST_AGREEMENT = 0.7
"""Of what is told of the noise within a view and between views, from which on it cannot be else."""

LEAST_SHARE = 0.75
"""Of what views differ by that must be noise of each of them: where more is something else, detail is worth more."""

LEFT = 0.375
"""Of the noise's standard deviation, what the binomial mean leaves."""

_NOISIEST = 0.9
"""Part of the parts of a picture that have no more noise than its scales bear with."""

_GUIDE, _GUIDE_OF_MEAN = (7, 3.0, 7.0), (5, 2.0, 2.1)
"""Window and width of the bilateral filter, pixels, and sum of the channels' differences, in units of the noise: of the
reference view, and of the mean of many."""


class DenoisingParameters(Parameters):
    """Parameters of the denoising."""

    denoising: float = Field(
        1.5, ge=0, le=10, description="detail of noisy views below this multiple of its noise is left out; 0 keeps all"
    )


@dataclass(frozen=True, kw_only=True)
class DenoisedLightField(LightField):
    """A light field whose views are denoised.

    Attributes
    ----------
    noise : float
        Standard deviation in one channel of the reference view before, where there is most of it.
    of_views : ViewNoise
        By brightness and place, before.
    """

    noise: float
    of_views: ViewNoise


def denoised(light_field: LightField, least: float, least_noise: float = 0.0) -> LightField:
    """The same light field with denoised views, where they are noisy.

    Parameters
    ----------
    light_field : LightField
        With a known disparity range.
    least : float
        Detail below so many times the noise's energy is left out.
    least_noise : float
        Standard deviation of the noise, colours in 0..1, below which views stay as they are, however sure it is.

    Returns
    -------
    LightField
        The light field itself where there is little noise.

    Raises
    ------
    SepiError
        If the disparity range is unknown.
    """
    if least == 0:
        return light_field
    of_views = measured_noise(light_field)
    if of_views.usual < least_noise:
        return light_field
    views = kept(light_field, "denoised views", lambda: _denoised_views(light_field, of_views, least), least)
    if views is None:
        return light_field
    others = {field.name: getattr(light_field, field.name) for field in fields(LightField) if field.name != "views"}
    noise = _noise_of_parts(light_field.reference_view)
    return DenoisedLightField(views, **others, noise=noise, of_views=of_views)


def measured_noise(light_field: LightField) -> ViewNoise:
    """:func:`sepi.matching.view_noise.view_noise` of the original views; computed once per workspace."""
    return kept(light_field, "noise of views", lambda: view_noise(light_field))


def sure_noise(light_field: LightField) -> ViewNoise | None:
    """:func:`measured_noise` if the views are noisy and what looks like noise can be nothing else; otherwise None."""
    noise = measured_noise(light_field)
    return noise if _is_sure(noise) and not _is_little(noise) else None


def _is_sure(noise: ViewNoise) -> bool:
    return noise.agreement >= LEAST_AGREEMENT


def _is_little(noise: ViewNoise) -> bool:
    sure = _is_sure(noise)
    return noise.usual < (LEAST_SURE_NOISE if sure else LEAST_NOISE) or noise.share < LEAST_SHARE


def _noise_of_parts(image: FloatMap) -> float:
    """Noise of the noisiest parts of an image; a scale that tolerates noise must tolerate theirs."""
    parts = [image[part_of_picture(number, image.shape[:2])] for number in np.ndindex(PARTS, PARTS)]
    return float(np.quantile([noise_level(part) for part in parts], _NOISIEST))


def _denoised_views(light_field: LightField, noise: ViewNoise, least: float) -> npt.NDArray[Any] | None:
    if _is_little(noise):
        return None
    views = light_field.views
    # keeps the bit depth: the residual noise exceeds the rounding
    out = np.zeros_like(views)
    height, width = light_field.shape
    by_place = np.asarray(cv2.resize(np.float32(least) * noise.by_place, (width, height)), np.float32)
    lines = lines_between(noise.brightness, noise.variance)
    kernels.denoise_views(views, light_field.present, full_scale(views.dtype), lines, by_place, out)
    return out


def lines_between(brightness: FloatMap, variance: FloatMap) -> FloatMap:
    """Noise variance by brightness: piecewise linear between known values, constant beyond both ends.

    Parameters
    ----------
    brightness, variance : ndarray, shape (N,), float32
        Brightness rises.

    Returns
    -------
    ndarray, shape (N + 1, 4), float32
        Each line's start brightness, length, start variance, and increase of the variance.
    """
    begins, variances = np.append(np.float32(-1e9), brightness), np.append(variance[:1], variance)
    length, rise = np.append(np.diff(begins), np.float32(1)), np.append(np.diff(variances), np.float32(0))
    return np.stack([begins, length, variances, rise], axis=1)


def guide_of(light_field: LightField, mean: FloatMap | None = None) -> FloatMap:
    """Colours that guide cost smoothing, denoised at edges, too.

    Parameters
    ----------
    light_field : LightField
    mean : ndarray, shape (H, W, 3), float32, optional
        Of many views (:mod:`sepi.matching.aligned_views`), which takes the reference view's place.

    Returns
    -------
    ndarray, shape (H, W, 3), float32
        Colours, 0..1; the reference view as it is where views are not denoised.
    """
    if not isinstance(light_field, DenoisedLightField):
        return light_field.reference_view
    size, space, colour = _GUIDE if mean is None else _GUIDE_OF_MEAN
    picture = np.ascontiguousarray(light_field.reference_view) if mean is None else mean
    return np.asarray(cv2.bilateralFilter(picture, size, colour * light_field.noise, space))
