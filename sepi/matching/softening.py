"""Views for matching: denoised, and slightly blurred where texture is too sharp for interpolation.

Matching interpolates between the pixels of a view, and interpolation loses frequencies above about 0.3 cycles per
pixel. Renderings, prints and downscaled images have such frequencies. Their views differ at the true disparity by more
than the robust scale tolerates, and a disparity that needs no interpolation wins instead. A slight blur of all views
removes these frequencies. It costs detail, so only dense texture of such frequencies is blurred; single edges stay
sharp.
"""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from typing import Annotated, Any

import cv2
import numpy as np
import numpy.typing as npt
from pydantic import Field

from sepi.lightfield import FloatMap, LightField, as_unit_float, full_scale
from sepi.matching.denoising import DenoisingParameters, denoised, measured_noise
from sepi.matching.view_noise import ViewNoise, expected_variance
from sepi.process.threads import threads_used
from sepi.process.workspace import kept

SHARP, SHARPEST = 0.295, 0.32
"""Sharpness at which the blur begins, and at which it is complete. Dots averaged over each pixel have 0.33; most
texture through a lens has 0.2 to 0.27."""

LEAST_SHARE = 0.1
"""Share of the reference view that must be too sharp; below it, no view is blurred."""

_WINDOW = 2.5
_DENSE = 21
"""Standard deviation of the Gaussian over which frequencies are measured, and width of the window over which sharpness
is averaged; pixels."""

_NOISE = 3.0
"""Factor of the noise's energy that is subtracted from second differences."""

_OF_GREY = 0.67
"""Noise of OpenCV's grey, relative to that of a channel. A single channel counts as three equal ones."""

_LEAST_CONTRAST = 3e-3
"""Least difference of neighbours that counts as texture; colours in 0..1."""


Softening = Annotated[
    float, Field(ge=0, le=3, description="blur of texture too sharp for interpolation, in pixels; 0 keeps it")
]
"""A parameter of the sweeps and of what refines their maps."""


class SofteningParameters(DenoisingParameters):
    """Parameters of the views for matching."""

    softening: Softening = 0.7


def compared_views(light_field: LightField, parameters: SofteningParameters, least_noise: float = 0.0) -> LightField:
    """Light field with views denoised where they are noisy, and blurred where they are too sharp.

    Parameters
    ----------
    light_field : LightField
        With a known disparity range.
    parameters : SofteningParameters
    least_noise : float
        As in :func:`sepi.matching.denoising.denoised`.

    Returns
    -------
    LightField
        A :class:`sepi.matching.denoising.DenoisedLightField` if there is noise; the light field itself if nothing
        changes.

    Raises
    ------
    SepiError
        If the disparity range is unknown.
    """
    found = denoised(light_field, parameters.denoising, least_noise)
    if parameters.softening == 0:
        return found
    return softened(found, parameters.softening, measured_noise(light_field))


def softened(light_field: LightField, blur: float, noise: ViewNoise | None = None) -> LightField:
    """Light field with views blurred where they are too sharp.

    Parameters
    ----------
    light_field : LightField
    blur : float
        Standard deviation of the Gaussian, pixels; 0 changes nothing.
    noise : ViewNoise, optional
        Noise of the views; default: measured.

    Returns
    -------
    LightField
        Of the same class; the light field itself if hardly any place is too sharp.

    Raises
    ------
    SepiError
        If the disparity range is unknown.
    """
    if blur == 0:
        return light_field
    told = measured_noise(light_field) if noise is None else noise
    views = kept(light_field, "softened views", lambda: _softened_views(light_field, told, blur), blur)
    return light_field if views is None else replace(light_field, views=views)


def sharpness(picture: FloatMap, variance: FloatMap) -> FloatMap:
    """Sharpness: share of second differences in the sum of first and second differences, averaged over a window.

    Parameters
    ----------
    picture : ndarray, shape (H, W), float32
        Grey, 0..1.
    variance : ndarray, shape (H, W), float32
        Variance of its noise.

    Returns
    -------
    ndarray, shape (H, W), float32
        0..1; 0 where there is no texture beyond the noise.
    """
    first, second = np.array([-0.5, 0, 0.5], np.float32), np.array([0.25, -0.5, 0.25], np.float32)
    along = np.ones(1, np.float32)
    strength = []
    for difference in (first, second):
        squares = [
            np.square(cv2.sepFilter2D(picture, -1, across, down, borderType=cv2.BORDER_REFLECT_101))
            for across, down in ((difference, along), (along, difference))
        ]
        energy = cv2.GaussianBlur(squares[0] + squares[1], (0, 0), _WINDOW)
        times = 2 * float(np.square(difference).sum()) * (1.0 if difference is first else _NOISE)
        strength.append(np.sqrt(np.maximum(energy - np.float32(times) * variance, 0)))
    share = strength[1] / (strength[0] + strength[1] + np.float32(_LEAST_CONTRAST))
    return np.asarray(cv2.blur(share, (_DENSE, _DENSE)), np.float32)


def reference_sharpness(light_field: LightField, noise: ViewNoise) -> FloatMap:
    """:func:`sharpness` of the reference view in this noise; shape (H, W), float32."""
    return sharpness(_grey(light_field.views[light_field.reference_position]), _grey_variance(light_field, noise))


def share_too_sharp(light_field: LightField) -> float:
    """Share of the reference view, 0..1, whose texture is too sharp for interpolation; 0 if views miss pixels.

    Raises
    ------
    SepiError
        If the disparity range is unknown.
    """
    if light_field.missing is not None:
        return 0.0
    return _share_too_sharp(light_field, _grey_variance(light_field, measured_noise(light_field)))


def _grey_variance(light_field: LightField, noise: ViewNoise) -> FloatMap:
    """Variance of the noise in grey; within the window, views are as bright as the reference view."""
    return (_OF_GREY**2 * expected_variance(light_field, noise)).astype(np.float32)


def _share_too_sharp(light_field: LightField, variance: FloatMap) -> float:
    return float(np.mean(_too_sharp(light_field.views[light_field.reference_position], variance) > 0))


def _softened_views(light_field: LightField, noise: ViewNoise, blur: float) -> npt.NDArray[Any] | None:
    """Views blurred where they are too sharp; None if hardly any place is."""
    views = light_field.views
    if light_field.missing is not None:
        # pixels that a view does not show are black; a blur would mix them into their neighbours
        return None
    variance = _grey_variance(light_field, noise)
    if _share_too_sharp(light_field, variance) < LEAST_SHARE:
        return None
    out = np.zeros_like(views)

    def soften(place: tuple[int, int]) -> None:
        view = as_unit_float(views[place])
        blurred = cv2.GaussianBlur(view, (0, 0), blur).reshape(view.shape)
        soft = view + _too_sharp(views[place], variance)[..., None] * (blurred - view)
        out[place] = soft if views.dtype == np.float32 else np.rint(soft * full_scale(views.dtype))

    # OpenCV and NumPy work outside Python's lock
    with ThreadPoolExecutor(threads_used()) as pool:
        list(pool.map(soften, map(tuple, np.argwhere(light_field.present).tolist())))
    return out


def _too_sharp(view: npt.NDArray[Any], variance: FloatMap) -> FloatMap:
    """Degree to which each pixel of a view (H, W, C) is too sharp, 0..1."""
    return np.asarray(np.clip((sharpness(_grey(view), variance) - SHARP) / (SHARPEST - SHARP), 0, 1), np.float32)


def _grey(view: npt.NDArray[Any]) -> FloatMap:
    return as_unit_float(cv2.cvtColor(view, cv2.COLOR_RGB2GRAY) if view.shape[2] == 3 else view[..., 0])
