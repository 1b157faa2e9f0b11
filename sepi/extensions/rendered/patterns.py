"""Seeded patterns: noise, wood, stone, bricks, tiles, weave, stripes, print; and sRGB.

A pattern has 1024 texels a side by default, and repeats without a seam.
"""

from typing import Any

import numpy as np
import numpy.typing as npt
from scipy import fft

from sepi.extensions.rendered.world import FloatArray, Pattern, Vector
from sepi.lightfield import BoolMap
from sepi.process.threads import threads_used

TEXELS = 1024
Field = npt.NDArray[np.float64]


def field(seed: int, finest: float, coarsest: float, texels: int = TEXELS, stretch: float = 1.0) -> Field:
    """Periodic random field of mean 0 and deviation 1 with equal energy in every octave between two wavelengths.

    Parameters
    ----------
    seed : int
    finest, coarsest : float
        Wavelengths in texels.
    texels : int
        Height and width.
    stretch : float
        Factor by which structures are longer across than down.
    """
    white = np.random.default_rng(seed).standard_normal((texels, texels), np.float32)
    frequency = np.hypot(np.fft.fftfreq(texels)[:, None], stretch * np.fft.rfftfreq(texels))
    fourth = np.square(np.square(frequency))
    with np.errstate(divide="ignore"):
        amplitude = np.where(frequency > 0, 1 / frequency, 0)
    amplitude *= np.exp(-fourth * finest**4) * (1 - np.exp(-fourth * coarsest**4))
    spectrum = fft.rfft2(white, workers=threads_used()) * amplitude.astype(np.float32)
    found: Field = fft.irfft2(spectrum, s=(texels, texels), workers=threads_used()).astype(np.float64)
    found /= found.std()
    return found


def noise(
    seed: int, colour: Vector, contrast: float, size: float, waves: tuple[float, float] = (4, 256), chroma: float = 0.3
) -> Pattern:
    """Noise about a colour.

    ``contrast`` is the deviation of the brightness, ``waves`` the finest and the coarsest wavelength in texels, and
    ``chroma`` the share of colour.
    """
    found = field(seed, *waves)[..., None]
    if chroma:
        colours = [field(seed + 1 + channel, *waves) for channel in range(3)]
        found = found + chroma * np.stack(colours, axis=-1)
    return painted(np.array(colour) + contrast * found, size)


def wood(seed: int, size: float, light: Vector = (0.72, 0.52, 0.34), dark: Vector = (0.42, 0.26, 0.15)) -> Pattern:
    """Grain that runs across."""
    grain = field(seed, 3, 90, stretch=14) + 0.7 * field(seed + 1, 40, 400, stretch=5)
    rings = 0.5 + 0.5 * np.sin(5 * grain)
    share = np.clip(0.65 * rings + 0.35 * (0.5 + 0.3 * field(seed + 2, 2, 16, stretch=20)), 0, 1)
    return painted(_between(light, dark, share), size)


def stone(seed: int, size: float, light: Vector = (0.82, 0.8, 0.77), dark: Vector = (0.4, 0.38, 0.4)) -> Pattern:
    """Veins through clouds."""
    clouds = 0.5 + 0.2 * field(seed, 4, 300)
    veins = np.exp(-18 * np.abs(field(seed + 1, 60, 500) + 0.25 * field(seed + 2, 4, 60)))
    return painted(_between(light, dark, np.clip(0.4 * clouds + 0.7 * veins, 0, 1)), size)


def bricks(seed: int, size: float, rows: int = 10, colour: Vector = (0.6, 0.32, 0.24)) -> Pattern:
    """Courses of bricks, each of its own tone, with mortar between; an even number of rows."""
    y, x = np.mgrid[:TEXELS, :TEXELS] * (rows / TEXELS)
    course = np.floor(y).astype(int)
    along = x / 2 + 0.5 * (course % 2)
    tone = np.random.default_rng(seed).normal(0, 0.07, (rows, rows))[course % rows, np.floor(along).astype(int) % rows]
    to_joint = np.minimum(np.abs(y - np.round(y)), 2 * np.abs(along - np.round(along)))
    face = np.array(colour) * (1 + tone[..., None] + 0.12 * field(seed + 1, 3, 80)[..., None])
    mortar = np.array([0.7, 0.68, 0.64]) + 0.05 * field(seed + 2, 3, 30)[..., None]
    return painted(np.where((to_joint > 0.06)[..., None], face, mortar), size)


def tiles(seed: int, size: float, count: int, light: Vector, dark: Vector) -> Pattern:
    """Squares of two colours in turn, with joints; an even count a side."""
    odd, joint = checks(count, 0.02)
    colour = _between(light, dark, odd[..., 0]) + 0.03 * field(seed, 4, 200)[..., None]
    return painted(np.where(joint, 0.5, colour), size)


def checks(count: int, joint: float) -> tuple[Field, BoolMap]:
    """Which of ``count`` squares a side are odd (1, else 0), and the joints between; both ``(TEXELS, TEXELS, 1)``."""
    y, x = np.mgrid[:TEXELS, :TEXELS, :1][:2] * (count / TEXELS)
    beside = np.minimum(np.abs(y - np.round(y)), np.abs(x - np.round(x)))
    return (np.floor(y) + np.floor(x)) % 2, beside < joint


def stripes(size: float, colours: list[Vector], across: bool = True) -> Pattern:
    """Equal stripes in turn; ``across``: side by side, else one below the other."""
    row = np.array(colours)[np.arange(TEXELS) * len(colours) // TEXELS]
    return painted(np.broadcast_to(row if across else row[:, None], (TEXELS, TEXELS, 3)), size)


def weave(seed: int, size: float, colour: Vector, contrast: float = 0.1, threads: int = 128) -> Pattern:
    """Threads over and under each other, as thick as even yarn is."""
    y, x = np.mgrid[:TEXELS, :TEXELS] * (threads / TEXELS)
    over = (np.floor(y) + np.floor(x)) % 2
    bulge = np.where(over == 0, np.sin(np.pi * (x % 1)), np.sin(np.pi * (y % 1)))
    shade = contrast * (bulge - bulge.mean()) + 0.4 * contrast * field(seed, 3, 120)
    return painted(np.array(colour) * (1 + shade[..., None]), size)


def linen(seed: int, size: float, colour: Vector, contrast: float = 0.06) -> Pattern:
    """Yarn that is thick here and thin there, both ways, with specks."""
    yarn = field(seed, 2, 24, stretch=12) + field(seed + 1, 2, 24, stretch=12).T
    shade = contrast * (0.6 * yarn + 0.4 * field(seed + 2, 3, 200))
    return painted(np.array(colour) * (1 + shade[..., None]), size)


def plaid(seed: int, size: float, ground: Vector, bands: Vector, count: int = 4, depth: float = 0.5) -> Pattern:
    """Bands across and down on linen; ``depth`` is the part of the bands' colour where two cross."""
    position = np.arange(TEXELS) * count / TEXELS % 1
    band = ((position > 0.2) & (position < 0.55)) * 0.8 + ((position > 0.75) & (position < 0.8)) * 1.0
    share = 0.5 * depth * (band[:, None] + band[None, :])
    cloth = linen(seed, size, ground).raster / np.array(ground, np.float32)
    return painted(_between(ground, bands, share) * cloth, size)


def printed(seed: int, size: float, lines: int = 40, paper: Vector = (0.9, 0.89, 0.85), ink: float = 0.12) -> Pattern:
    """Lines of printed words."""
    rng = np.random.default_rng(seed)
    cell = TEXELS // (2 * lines)
    page = np.zeros((TEXELS, TEXELS))
    letters = rng.random((lines, TEXELS // cell, 5, 3)) < 0.55
    spaces = rng.random((lines, TEXELS // cell)) < 0.16
    for line in range(lines):
        for column in np.flatnonzero(~spaces[line]):
            glyph = np.kron(letters[line, column], np.ones((max(cell // 5, 1), max(cell // 4, 1))))
            top, left = line * 2 * cell + cell // 3, column * cell
            part = page[top : top + glyph.shape[0], left : left + glyph.shape[1]]
            part[:] = glyph[: part.shape[0], : part.shape[1]]
    return painted(_between(paper, (ink, ink, ink), page), size)


def painted(colours: npt.ArrayLike, width: float, height: float | None = None) -> Pattern:
    """Colours as a pattern, kept off black and white; default height: the width."""
    return Pattern(np.clip(np.asarray(colours), 0.02, 0.98).astype(np.float32), (width, height or width))


def _between(first: Vector, second: Vector, share: Field) -> Field:
    return np.asarray(first + share[..., None] * np.subtract(second, first))


def srgb_encoded(values: FloatArray) -> FloatArray:
    """Values in sRGB of linear ones, both 0..1."""
    curve = 1.055 * np.maximum(values, 1e-9) ** (1 / 2.4) - 0.055
    return np.asarray(np.where(values <= 0.0031308, 12.92 * values, curve), values.dtype)


def srgb_decoded(values: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """Linear values of sRGB ones, both 0..1."""
    return np.asarray(np.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4))
