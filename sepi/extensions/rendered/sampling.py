"""Number of paths for each pixel of a view, by the surface that it shows.

Views share the light on matte surfaces (:mod:`sepi.extensions.rendered.shared_light`), so a few paths in each view are
enough. Pixels with several surfaces need more, and specular surfaces (gloss, mirrors and glass) all.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from sepi.extensions.rendered.surfaces import FirstSurface
from sepi.extensions.rendered.tracing import SPREAD, Position, Tiles, Tracer
from sepi.extensions.rendered.world import FloatArray
from sepi.lightfield import BoolMap, FloatMap

# number of paths that take as long as making a camera for a tile
_CAMERA = 16
# largest side of a tile in pixels, a power of two
_WIDEST = 64
# rays per pixel, across and down, to find the things in it
_FINE = 4
# largest second difference of one surface, pixels per view step
_BEND = 0.005
# least linear albedo from which the light can be computed
_DARKEST = 1e-3


def shared_samples(samples: int, views: int) -> int:
    """Paths of a pixel on a matte surface; over all views about three times ``samples``."""
    return min(samples, math.ceil(3 * samples / views))


def mixed_samples(samples: int, few: int) -> int:
    """Paths of a pixel with several surfaces: so many that those after the first ``few`` are spread evenly."""
    return max(samples // 6, min(samples, few + SPREAD))


def gloss_samples(samples: int, part: float) -> int:
    """Paths of a glossy pixel, for a share ``part`` of all: so many that they are spread evenly."""
    return max(round(part * samples), min(samples, SPREAD))


@dataclass(frozen=True)
class Plan:
    """Plan of a view's samples.

    Attributes
    ----------
    tiles : list of (Tiles, int)
        Tiles in order, with the number of earlier paths of their pixels.
    albedo : ndarray, shape (H, W, 3), float32
        Linear albedo; 0 where unknown.
    whole : ndarray, shape (H, W), bool
        Pixels of known albedo that show one matte, nearly flat surface.
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
    """The plan of a view's samples.

    Parameters
    ----------
    tracer : Tracer
    position : Position
        Position of the view, without a turn.
    seen : FirstSurface
        Surfaces seen from there.
    disparity : ndarray, shape (H, W), float32
        Disparity of these, pixels per view step.
    samples : int
        Largest number of paths of a pixel.
    views : int
        Number of views that share light.
    seed : int
        First seed of the paths; some that follow are used, too.
    gloss : float, optional
        Share of ``samples`` that glossy pixels need (:class:`sepi.extensions.rendered.world.World`).
    """
    # things narrower than a pixel may lie between the rays through middles
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
    """Number of true values among each pixel's rays, ``(H, F, W, F)``; shape (H, W)."""
    fine, found = rays.shape[1], np.zeros(rays.shape[::2], np.uint8)
    for n in range(fine**2):
        found += rays[:, n // fine, :, n % fine]
    return found


def pictured(tracer: Tracer, plan: Plan) -> FloatArray:
    """The picture of a view, linear, 1 is white; shape (H, W, 3), float32."""
    picture = np.zeros_like(plan.albedo)
    for tiles, taken in plan.tiles:
        rows, columns = tiles.pixels[..., 0], tiles.pixels[..., 1]
        more = tiles.paths * tracer.seen(tiles)
        picture[rows, columns] = (taken * picture[rows, columns] + more) / np.float32(taken + tiles.paths)
    return picture


def _tiles(asked: BoolMap, paths: int) -> list[npt.NDArray[np.int64]]:
    """Squares that contain all pixels of a mask in the least time; an array ``(N, side, side, 2)`` for each side.

    Four squares become one if its further paths take less time than the cameras that it saves.
    """
    height, width = asked.shape
    needed = np.pad(asked, ((0, -height % _WIDEST), (0, -width % _WIDEST)))
    cost, side = np.where(needed, paths + _CAMERA, 0), 1
    # for each side: whether a square is one tile, or made of smaller ones
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
        # the last tiles overlap those before
        corners = np.minimum(corners, np.array([height, width]) - side)
        found.append(corners[:, None, None] + np.moveaxis(np.mgrid[:side, :side], 0, -1))
        taken = (taken | squares).repeat(2, axis=0).repeat(2, axis=1)
        side //= 2
    return [tiles for tiles in found if len(tiles)]


def _flat(disparity: FloatMap, things: npt.NDArray[np.int64]) -> BoolMap:
    """Pixels with a nearly flat surface: in each direction across them, or on one side at the surface's end."""
    # no surface continues beyond the border
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
