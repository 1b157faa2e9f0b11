"""How many paths of light each pixel of a view takes: as many as what it shows asks for.

Light on a matte surface is gathered from all views (:mod:`sepi.rendered.shared_light`), so that a few paths in each
will do. Pixels in which matte surfaces mix take a quarter of the samples, and what depends on where it is seen from
takes all: gloss, mirrors and glass.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from sepi.lightfield import BoolMap, FloatMap
from sepi.rendered.surfaces import FirstSurface
from sepi.rendered.tracing import Position, Tracer
from sepi.rendered.world import FloatArray

# to make a camera for a tile takes as long as so many paths
_CAMERA = 16
# greatest side of a tile in pixels, a power of two
_WIDEST = 8
# rays of a pixel, across and down, that look for things in it
_FINE = 4
# pixels per view step: how far a surface may bend from pixel to pixel to be one
_BEND = 0.005
# linear; on what is darker there is no telling the light
_DARKEST = 1e-3


def shared_samples(samples: int, views: int) -> int:
    """Paths of a pixel of a matte surface, a power of two: with those of all views about four times ``samples``."""
    return min(samples, 1 << max(0, round(math.log2(4 * samples / views))))


def mixed_samples(samples: int) -> int:
    """Paths of a pixel in which matte surfaces mix: a quarter, but not so few that they show."""
    return max(samples // 4, min(samples, 12))


def sampled(
    tracer: Tracer, position: Position, seen: FirstSurface, disparity: FloatMap, samples: int, views: int, seed: int
) -> tuple[FloatArray, FloatArray, BoolMap]:
    """Picture of a view, the albedo of what is matte in it, and where that is one surface.

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

    Returns
    -------
    picture : ndarray, shape (H, W, 3), float32
        Linear, 1 is white.
    albedo : ndarray, shape (H, W, 3), float32
        Linear; 0 where it is not known.
    whole : ndarray, shape (H, W), bool
        Pixels of known albedo that show one surface, and whose neighbours do.
    """
    # what is narrower than a pixel may stand between rays through middles
    beside = tracer.things(position, _FINE)
    matte: BoolMap = np.all(tracer.surfaces.matte(beside), axis=(1, 3))
    whole = matte & (beside == seen.thing[:, None, :, None]).all(axis=(1, 3)) & _whole(disparity, seen.thing)
    albedo = np.zeros((*matte.shape, 3), np.float32)
    albedo[whole] = tracer.albedo(position, seen.face[whole], np.argwhere(whole))
    whole &= albedo.min(axis=-1) > _DARKEST
    few = shared_samples(samples, views)
    first = tracer.picture(position, seed, few)
    picture = first.copy()
    mixing = mixed_samples(samples)
    # the number of a tile's seed, whichever kind it is of
    begun = 4096
    for asked, paths, counted in ((matte & ~whole, mixing - few, few), (~matte, samples if samples > few else 0, 0)):
        for tiles in _tiles(asked, paths) if paths > 0 else []:
            rows, columns = tiles[..., 0], tiles[..., 1]
            more = tracer.tiles(position, tiles, seed + begun, paths)
            picture[rows, columns] = (counted * first[rows, columns] + paths * more) / np.float32(counted + paths)
            begun += 4096
    return picture, np.where(whole[..., None], albedo, 0), whole


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
        taken = np.kron(taken | squares, np.ones((2, 2), bool))
        side //= 2
    return [tiles for tiles in found if len(tiles)]


def _whole(disparity: FloatMap, things: npt.NDArray[np.int64]) -> BoolMap:
    """Pixels that show one surface, and whose neighbours do."""
    whole = np.zeros(things.shape, bool)
    middle = (slice(1, -1), slice(1, -1))
    whole[middle] = True
    height, width = things.shape
    for down, across in ((0, 1), (1, 0), (1, 1), (1, -1)):
        before = (slice(1 - down, height - 1 - down), slice(1 - across, width - 1 - across))
        after = (slice(1 + down, height - 1 + down), slice(1 + across, width - 1 + across))
        bend = np.abs(disparity[before] - 2 * disparity[middle] + disparity[after])
        same = (things[before] == things[middle]) & (things[after] == things[middle])
        whole[middle] &= same & (bend < _BEND)
    return whole
