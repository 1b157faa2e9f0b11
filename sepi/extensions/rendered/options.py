"""Options of path-traced scenes: cameras, and sensors."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

from pydantic import Field

from sepi.validation.models import CheckedModel
from sepi.workflow.rendered_scenes import NoiseLevel

_Share = Annotated[float, Field(ge=0, allow_inf_nan=False)]
_Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
_Rows = Annotated[int, Field(ge=1, le=33)]
_Seed = Annotated[int, Field(ge=0, lt=2**31)]


class RenderOptions(CheckedModel):
    """Options of rendering."""

    size: int = Field(512, ge=32, le=4096, description="height and width of a view in pixels; disparities stay")
    grid: tuple[_Rows, _Rows] = Field((9, 9), description="rows and columns of views")
    samples: int = Field(64, ge=1, le=65536, description="paths of light for each pixel; few leave their own noise")
    baseline: _Positive = Field(1.0, description="distance of views, and so disparity, as part of the scene's own")
    lens: _Share = Field(
        0.0, description="radius of the lens in view steps; 0: a pinhole. Disparity d is a disc 2 lens |d| pixels wide"
    )
    position_error: _Share = Field(
        0.0, description="standard deviation of where views but the reference view stand, in view steps"
    )
    rotation_error: _Share = Field(
        0.0, description="standard deviation of how they are turned about each axis, in degrees"
    )
    seed: _Seed = Field(0, description="of the light's paths and of these errors")

    @property
    def shares_light(self) -> bool:
        """Whether views share the light of matte surfaces, which needs sharp views without turns."""
        return not (self.lens or self.rotation_error)


@dataclass(frozen=True)
class Electrons:
    """A sensor: electrons of a white pixel, and standard deviation of the read noise in electrons."""

    white: float
    read: float


NOISE: dict[NoiseLevel, Electrons | None] = {
    "off": None,
    # standard deviations of 3 and 9 of 255 in grey of 18 %
    "low": Electrons(2000.0, 4.0),
    "high": Electrons(250.0, 4.0),
}
"""Noise level to sensor; None without noise."""


class Exposure(CheckedModel):
    """Options of the sensor."""

    noise: NoiseLevel = Field(
        "off", description="photons and reading of a sensor that holds 2,000 (low) or 250 (high) electrons at white"
    )
    noise_seed: int = Field(1, ge=1, lt=2**31, description="of the noise, and of what differs from view to view")
    vignetting: float = Field(0.0, ge=0, le=1, description="part of the light that the corners lack")
    exposure_spread: _Share = Field(
        0.0, description="standard deviation of the exposures of views but the reference view, in stops"
    )
    bits: Literal[8, 16] = Field(8, description="of each value")
    gamma: _Positive | None = Field(
        None, description="exponent of the curve from light to values is 1 / gamma; 1: linear; null: sRGB"
    )
