"""How many paths of light each pixel of a view takes: as many as what it shows asks for.

Light on a matte surface is gathered from all views (:mod:`sepi.rendered.shared_light`), so that a few paths in each
will do. Pixels in which surfaces mix take some, and those that show mostly what depends on where it is seen from take
all: gloss, mirrors and glass.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from sepi.lightfield import BoolMap, FloatMap
from sepi.rendered.surfaces import FirstSurface
from sepi.rendered.tracing import SPREAD, Position, Tiles, Tracer
from sepi.rendered.world import FloatArray

# to make a camera for a tile takes as long as so many paths
_CAMERA = 16
# greatest side of a tile in pixels, a power of two
_WIDEST = 64
# rays of a pixel, across and down, that look for things in it
_FINE = 4
# pixels per view step: how far a surface may bend from pixel to pixel to be one
_BEND = 0.005
# linear; on what is darker there is no telling the light
_DARKEST = 1e-3


def shared_samples(samples: int, views: int) -> int:
    """Paths of a pixel of a matte surface: with those of all views about three times ``samples``."""
    return min(samples, math.ceil(3 * samples / views))


def mixed_samples(samples: int, few: int) -> int:
    """Paths of a pixel in which surfaces mix: few, but those after the first ``few`` are spread evenly."""
    return max(samples // 6, min(samples, few + SPREAD))


def gloss_samples(samples: int, part: float) -> int:
    """Paths of a pixel of gloss where ``part`` of many do: so many that they are spread evenly."""
    return max(round(part * samples), min(samples, SPREAD))


@dataclass(frozen=True)
class Plan:
    """How a view is sampled.

    Attributes
    ----------
    tiles : list of (Tiles, int)
        In turn; and how many paths their pixels have taken before.
    albedo : ndarray, shape (H, W, 3), float32
        Linear; 0 where it is not known.
    whole : ndarray, shape (H, W), bool
        Pixels of known albedo that show one matte surface, about flat there.
    """

    tiles: list[tuple[Tiles, int]]
    albedo: FloatArray
    whole: BoolMap


def planned(
    tracer: Tracer,
    position: Position,
    seen: FirstSurface,
    disparity: FloatMap,
    samples: int,
    views: int,
    seed: int,
    gloss: float = 1.0,
) -> Plan:
    """Which pixels of a view take how many paths.

    Parameters
    ----------
    tracer : Tracer
    position : Position
        Without a turn.
    seen : FirstSurface
        From there.
    disparity : ndarray, shape (H, W), float32
        Of that, in pixels per view step.
    samples : int
        Paths of a pixel that needs all.
    views : int
        That share light.
    seed : int
        Of the paths; with some of those that follow.
    gloss : float, optional
        What part of ``samples`` pixels of gloss need, of many (:class:`sepi.rendered.world.World`).
    """
    # what is narrower than a pixel may stand between rays through middles
    beside = tracer.things(position, _FINE)
    matte = _of_pixels(tracer.surfaces.matte(beside))
    same = _of_pixels(beside == seen.thing[:, None, :, None])
    whole = (matte == _FINE**2) & (same == _FINE**2) & _flat(disparity, seen.thing)
    albedo = np.zeros((*whole.shape, 3), np.float32)
    albedo[whole] = tracer.albedo(position, seen.face[whole], np.argwhere(whole))
    whole &= albedo.min(axis=-1) > _DARKEST
    albedo[~whole] = 0
    few, differs = shared_samples(samples, views), 2 * matte < _FINE**2
    kinds = (
        (~differs, 0, few),
        (~differs & ~whole, few, mixed_samples(samples, few) - few),
        (differs, 0, max(few, gloss_samples(samples, gloss))),
    )
    squares = [(tiles, taken, paths) for asked, taken, paths in kinds if paths > 0 for tiles in _tiles(asked, paths)]
    tiles = [
        (tracer.tiles(position, pixels, paths, seed + 4096 * number), taken)
        for number, (pixels, taken, paths) in enumerate(squares)
    ]
    return Plan(tiles, albedo, whole)


def _of_pixels(rays: npt.NDArray[np.bool_]) -> npt.NDArray[np.uint8]:
    """Of how many rays of each pixel, ``(H, F, W, F)``, something is true."""
    fine, found = rays.shape[1], np.zeros(rays.shape[::2], np.uint8)
    for n in range(fine**2):
        found += rays[:, n // fine, :, n % fine]
    return found


def pictured(tracer: Tracer, plan: Plan) -> FloatArray:
    """The picture of a view, ``(H, W, 3)`` float32: linear, 1 is white."""
    picture = np.zeros_like(plan.albedo)
    for tiles, taken in plan.tiles:
        rows, columns = tiles.pixels[..., 0], tiles.pixels[..., 1]
        more = tiles.paths * tracer.seen(tiles)
        picture[rows, columns] = (taken * picture[rows, columns] + more) / np.float32(taken + tiles.paths)
    return picture


def _tiles(asked: BoolMap, paths: int) -> list[npt.NDArray[np.int64]]:
    """Squares that hold all pixels asked for, and take least time; of each side ``(N, side, side, 2)``.

    Four squares become one where its paths cost less than the cameras that it saves.
    """
    height, width = asked.shape
    needed = np.pad(asked, ((0, -height % _WIDEST), (0, -width % _WIDEST)))
    cost, side = np.where(needed, paths + _CAMERA, 0), 1
    # by side, where each square is one, or made of lesser ones
    whole = [needed]
    while 2 * side <= min(_WIDEST, height, width):
        side *= 2
        apart = cost.reshape(cost.shape[0] // 2, 2, cost.shape[1] // 2, 2).sum(axis=(1, 3))
        together = side**2 * paths + _CAMERA
        whole.append(apart > together)
        cost = np.minimum(apart, together)
    found = []
    taken = np.zeros_like(whole[-1])
    for squares in reversed(whole):
        corners = side * np.argwhere(squares & ~taken)
        # the last ones reach over those before
        corners = np.minimum(corners, np.array([height, width]) - side)
        found.append(corners[:, None, None] + np.moveaxis(np.mgrid[:side, :side], 0, -1))
        taken = (taken | squares).repeat(2, axis=0).repeat(2, axis=1)
        side //= 2
    return [tiles for tiles in found if len(tiles)]


def _flat(disparity: FloatMap, things: npt.NDArray[np.int64]) -> BoolMap:
    """Pixels about which a surface bends little: in each direction across them, or beside them where it ends."""
    # nothing goes on beyond the border
    shown, depth = np.pad(things, 1, constant_values=-2), np.pad(disparity, 1)
    found = np.ones(shown.shape, bool)
    for step in ((0, 1), (1, 0), (1, 1), (1, -1)):
        back = (-step[0], -step[1])
        from_before = shown == np.roll(shown, step, (0, 1))
        to_next = np.roll(from_before, back, (0, 1))
        bend = np.abs(np.roll(depth, step, (0, 1)) - 2 * depth + np.roll(depth, back, (0, 1)))
        across = from_before & to_next & (bend < _BEND)
        beside = (from_before & np.roll(across, step, (0, 1))) | (to_next & np.roll(across, back, (0, 1)))
        found &= np.where(from_before & to_next, across, beside)
    return found[1:-1, 1:-1]
