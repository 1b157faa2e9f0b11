"""Pictures of a sensor from rendered light: photon and read noise, vignetting, exposure, tone curve, bits."""

import math
import zlib
from pathlib import Path
from typing import Literal

import numpy as np
import numpy.typing as npt
from pydantic import Field

from sepi.camera import camera_from
from sepi.extensions.rendered.patterns import srgb_encoded
from sepi.extensions.rendered.render_file import Render, masks_in, read_render
from sepi.extensions.rendered.render_file import read_truth as read_truth
from sepi.extensions.rendered.shapes import Points
from sepi.extensions.rendered.world import Share
from sepi.lightfield import DisparityRange, LightField
from sepi.validation.models import CheckedModel, Positive, validated
from sepi.workflow.rendered_scenes import NoiseLevel, RenderedScene

# standard deviations of 3 and 9 of 255 in grey of 18 %
WHITE: dict[NoiseLevel, float] = {"low": 2000.0, "high": 250.0}
"""Noise level to electrons of a white pixel."""
READ = 4.0
"""Standard deviation of the read noise in electrons."""


class Exposure(CheckedModel):
    """Options of the sensor."""

    noise: NoiseLevel = Field("off", description="of a sensor that holds 2,000 (low) or 250 (high) electrons at white")
    noise_seed: int = Field(1, ge=1, lt=2**31, description="of the noise, and of what differs from view to view")
    vignetting: float = Field(0.0, ge=0, le=1, description="part of the light that the corners lack")
    exposure_spread: Share = Field(0.0, description="standard deviation of exposures but the reference view's, stops")
    bits: Literal[8, 16] = Field(8, description="of each value")
    gamma: Positive | None = Field(None, description="values are light to the power 1 / gamma; 1: linear; null: sRGB")


def read_scene(path: Path, noise: str = "off", seed: int = 1) -> LightField:
    """The light field of a render at a noise level.

    Parameters
    ----------
    path : Path
        File that :func:`sepi.extensions.rendered.rendering.render_world` wrote.
    noise : str
        One of :data:`sepi.workflow.rendered_scenes.NOISE_LEVELS`.
    seed : int
        Seed of the noise.

    Returns
    -------
    LightField
        From :func:`exposed`.

    Raises
    ------
    SepiError
        If the file is not a render, or there is no such level or seed.
    """
    return exposed(read_render(path), validated(Exposure, {"noise": noise, "noise_seed": seed}, "noise"))


def exposed(render: Render, exposure: Exposure) -> LightField:
    """The light field that a sensor takes of a rendered scene.

    Parameters
    ----------
    render : Render
    exposure : Exposure

    Returns
    -------
    LightField
        Views uint8 or uint16 RGB, with disparity range, camera, and ground truth and masks of the centre view. Equal
        arguments give equal bytes. It has no true positions of the views, like a camera's.
    """
    rows, columns = render.views.shape[:2]
    views = np.empty(render.views.shape, np.uint8 if exposure.bits == 8 else np.uint16)
    # seeded by scene, level and seed, so that no two pictures share their noise
    key = zlib.crc32(f"{render.name} {exposure.noise}".encode())
    rng = np.random.default_rng([exposure.noise_seed, key])
    factors = np.exp2(exposure.exposure_spread * rng.standard_normal((rows, columns)))
    factors[render.centre] = 1
    down, across = (np.linspace(-1, 1, length) for length in render.views.shape[2:4])
    # falling with the squared distance from the middle
    shade = (1 - exposure.vignetting * (down[:, None] ** 2 + across[None, :] ** 2) / 2)[..., None]
    for t, s in np.ndindex(rows, columns):
        light = np.maximum(render.views[t, s].astype(np.float64), 0) * (factors[t, s] * shade)
        rng = np.random.default_rng([exposure.noise_seed, key, t * columns + s])
        views[t, s] = _taken(light, exposure, render.light, rng)
    return LightField(
        views=views,
        name=RenderedScene(render.name, exposure.noise, exposure.noise_seed).name,
        source="rendered",
        disparity_range=_range_of(render.disparity),
        ground_truth=render.disparity[render.centre],
        masks=masks_in(render.masks[render.centre]),
        camera=camera_from(**render.settings, shape=render.views.shape[2:4], crop_of=None),
    )


def _taken(light: Points, exposure: Exposure, share: float, rng: np.random.Generator) -> Points:
    """Pixel values before their type: with photon noise and read noise, cut off at white, through the curve."""
    if exposure.noise in WHITE:
        white = WHITE[exposure.noise] * share
        # a full well is white
        light = (rng.poisson(np.minimum(light, 1) * white) + READ * rng.standard_normal(light.shape)) / white
    light = np.clip(light, 0, 1)
    curve = srgb_encoded(light.astype(np.float32)) if exposure.gamma is None else light ** (1 / exposure.gamma)
    return np.asarray(np.round(np.float64(curve) * (2**exposure.bits - 1)))


def _range_of(disparity: npt.NDArray[np.float32]) -> DisparityRange:
    """Disparity range of all views, rounded outwards to tenths as in the benchmark."""
    # rounded first, so that a bound at a tenth, up to the last bits, stays there
    low, high = (round(10 * float(value), 3) for value in (disparity.min(), disparity.max()))
    low, high = math.floor(low) / 10, math.ceil(high) / 10
    # a scene of one plane still needs a range
    return DisparityRange(low, max(high, low + 0.2), "parameters")
