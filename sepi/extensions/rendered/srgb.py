"""Conversion between sRGB and linear values."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from sepi.extensions.rendered.world import FloatArray


def srgb_encoded(values: FloatArray) -> FloatArray:
    """Values in sRGB of linear ones, both 0..1."""
    found: FloatArray = np.where(
        values <= 0.0031308, 12.92 * values, 1.055 * np.maximum(values, 1e-9) ** (1 / 2.4) - 0.055
    )
    return found


def srgb_decoded(values: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """Linear values of sRGB ones, both 0..1."""
    found: npt.NDArray[Any] = np.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4)
    return found
