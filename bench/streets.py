"""Streets drawn at random: what error bars must hold on, and built-in scenes lack.

A bare sky that only its light tells, houses of repeated windows, boards and prints with edges too sharp for
interpolation, and wires thinner than two pixels.
"""

from __future__ import annotations

import numpy as np

from sepi.lightfield import DisparityRange, LightField
from sepi.scenes.definitions import Plane, Surface, everywhere, noise, rectangle, shading, thread
from sepi.scenes.rendering import drawing, render_view, visible

SIZE, VIEWS = 192, 9
"""Pixels of the pictures; rows and columns of views."""


def street(seed: int) -> LightField:
    """The street of a seed, with exact ground truth; 9x9 views of 192x192 pixels, named ``street:SEED``."""
    rng = np.random.default_rng(seed)
    sky = Plane(rng.uniform(-2, -0.8))
    surfaces = [Surface([everywhere()], sky, shading((0.65, 0.72, 0.8), rng.uniform(0.02, 0.15)), textureless=True)]
    right = 0.02
    while right < 0.9:
        left, right = right, right + rng.uniform(0.15, 0.26)
        surfaces += _house(rng, left, right)
    ground = noise(seed, (0.4, 0.4, 0.38), 0.1)
    surfaces.append(Surface([rectangle(-3, 0.85, 4, 4)], Plane(0.2, down=2.0), ground))
    for y in rng.uniform(0.05, 0.4, 2):
        wire = thread((-0.2, y), (1.2, y + rng.uniform(-0.1, 0.1)), rng.uniform(0.8, 2.2) / SIZE)
        surfaces.append(Surface([wire], Plane(rng.uniform(0, 1)), shading((0.15, 0.15, 0.17), 0.0)))
    scene = drawing(surfaces, SIZE)
    truth, _ = visible(scene, SIZE)
    views, deviation = np.empty((VIEWS, VIEWS, SIZE, SIZE, 3), np.uint8), rng.uniform(0.004, 0.015)
    for t, s in np.ndindex(VIEWS, VIEWS):
        picture = render_view(scene, SIZE, t - VIEWS // 2, s - VIEWS // 2)
        grain = deviation * rng.standard_normal(picture.shape)
        views[t, s] = np.round(255 * np.clip(picture + grain, 0, 1))
    known = DisparityRange(float(truth.min()) - 0.5, float(truth.max()) + 0.5, "given")
    return LightField(views, f"street:{seed}", disparity_range=known, ground_truth=truth.astype(np.float32))


def _house(rng: np.random.Generator, left: float, right: float) -> list[Surface]:
    """A wall of one colour with a pattern of a few pixels, on a plane that turns away."""
    top, plane = rng.uniform(0.25, 0.65), Plane(rng.uniform(-0.6, 0.7), across=rng.uniform(-0.6, 0.6))
    colour, dark = rng.uniform(0.3, 0.8, 3), rng.uniform(0.4, 0.7)
    wall = rectangle(left, top, right, 0.9)
    period = rng.uniform(3, 12) / SIZE
    across, down = np.arange(left, right - period, period), np.arange(top, 0.9 - period, period)
    kind = rng.integers(4)
    if kind == 0:
        return [Surface([wall], plane, (colour * rng.uniform(0.5, 1, (256, 256, 1))).astype(np.float32))]
    patterns = [
        [rectangle(x, top, x + period / 2, 0.9) for x in across],
        [rectangle(left, y, right, y + period / 2) for y in down],
        [rectangle(x, y, x + period / 2, y + period / 2) for x in across for y in down],
    ]
    # in front of the wall by nothing that can be seen
    front = plane._replace(at_centre=plane.at_centre + 1e-4)
    return [
        Surface([wall], plane, shading(tuple(colour.tolist()), 0.05)),
        Surface(patterns[kind - 1], front, shading(tuple((dark * colour).tolist()), 0.05)),
    ]
