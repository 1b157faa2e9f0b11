"""Textures of the built-in scenes: periodic rasters, one texel per pixel of the centre view, sampled by cubic splines.

Textures have pixel-scale detail at every image size, so that depth can be estimated; only shapes scale with the image.
The photographs are samples included in scikit-image.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import numpy.typing as npt

from sepi.lightfield import FloatMap

Colour = tuple[float, float, float]
"""Red, green, blue, full range = 1."""

# Texels per period; far longer than any disparity range, so that a repetition is never a false match.
PERIOD = 512
# Shortest wavelength of noise in pixels.
FINEST = 3.0
# Share of a texture's variation that differs between colour channels.
CHROMA = 0.25
# Standard deviation of the noise added to a photograph.
GRAIN = 0.05


def noise(seed: int, colour: Colour, contrast: float, *, coarsest: float = 48.0) -> FloatMap:
    """Smooth noise around a colour with equal energy per octave between two wavelengths in pixels.

    ``contrast`` is the standard deviation of the brightness. No wavelength is below 2 pixels, so that views are sampled
    without aliasing.
    """
    brightness, *chroma = _bands(np.random.default_rng(seed), coarsest)
    variation = brightness[..., None] + CHROMA * np.stack(chroma, axis=-1)
    return _limited(np.array(colour) + contrast * variation)


def photograph(name: str, tint: Colour, *, seed: int) -> FloatMap:
    """A sample image included in scikit-image, mirrored so that it repeats without a seam.

    Its colours are multiplied by ``tint``; fine noise is added so that smooth parts have detail too.
    """
    from skimage import data

    # range reduced, since clipping at black or white would leave no detail to match
    picture = 0.12 + 0.76 * np.asarray(getattr(data, name)(), np.float64) / 255
    if picture.ndim == 2:
        picture = np.repeat(picture[..., None], 3, axis=-1)
    half = PERIOD // 2
    top, left = (picture.shape[0] - half) // 2, (picture.shape[1] - half) // 2
    tile = picture[top : top + half, left : left + half]
    tile = np.concatenate([tile, tile[::-1]])
    tile = np.concatenate([tile, tile[:, ::-1]], axis=1)
    return _limited(tile * np.array(tint) + noise(seed, (0.5, 0.5, 0.5), GRAIN, coarsest=12) - 0.5)


def shading(colour: Colour, amplitude: float) -> FloatMap:
    """One colour with brightness varying only over hundreds of pixels: too smooth to estimate depth."""
    phase = 2 * np.pi * np.arange(PERIOD) / PERIOD
    wave = 0.5 * amplitude * (np.sin(phase)[:, None] + np.sin(phase)[None, :])
    return _limited(np.array(colour) + wave[..., None])


def later(make: Callable[..., FloatMap]) -> Callable[..., Callable[[], FloatMap]]:
    """Wrap a texture function so that calls return a function that makes the texture later."""

    def asked(*given: Any, **named: Any) -> Callable[[], FloatMap]:
        return partial(make, *given, **named)

    return asked


def _bands(rng: np.random.Generator, coarsest: float) -> npt.NDArray[np.float64]:
    """Four independent fields of unit variance, shape (4, PERIOD, PERIOD)."""
    white = rng.standard_normal((4, PERIOD, PERIOD))
    from scipy import fft

    frequency = np.hypot(fft.fftfreq(PERIOD)[:, None], fft.rfftfreq(PERIOD)[None, :])
    # amplitude 1/f gives equal energy per octave; smooth flanks avoid ripples
    with np.errstate(divide="ignore"):
        amplitude = np.where(frequency > 0, 1 / frequency, 0)
    amplitude *= np.exp(-((frequency * FINEST) ** 8)) * (1 - np.exp(-((frequency * coarsest) ** 4)))
    fields = fft.irfft2(fft.rfft2(white) * amplitude, s=(PERIOD, PERIOD))
    normalised: npt.NDArray[np.float64] = fields / fields.std(axis=(1, 2), keepdims=True)
    return normalised


def _limited(values: npt.NDArray[np.float64]) -> FloatMap:
    """Values limited to slightly inside 0..1, so that their spline stays within 0..1."""
    return np.clip(values, 0.02, 0.98).astype(np.float32)
