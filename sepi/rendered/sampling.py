"""How many paths of light each pixel of a view takes: as many as what it shows asks for.

Light on a matte surface is gathered from all views (:mod:`sepi.rendered.shared_light`), so that a few paths in each
will do. Pixels in which matte surfaces mix take a quarter of the samples, and what depends on where it is seen from
takes all: gloss, mirrors, glass and their rims.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from sepi.lightfield import BoolMap, FloatMap
from sepi.rendered.surfaces import FirstSurface
from sepi.rendered.tracing import Position, Tracer
from sepi.rendered.world import FloatArray

# sides of tiles in pixels: to make a camera for each takes as long as some 30 paths
_NARROW, _WIDE = 2, 4
# rays of a pixel, across and down, that look for things in it
_FINE = 2
# pixels per view step: how far a surface may bend from pixel to pixel to be one
_BEND = 0.005
# linear; on what is darker there is no telling the light
_DARKEST = 1e-3


def shared_samples(samples: int, views: int) -> int:
    """Paths of a pixel of a matte surface: with those of all views eight times ``samples``."""
    return min(samples, -(-8 * samples // views))


def mixed_samples(samples: int) -> int:
    """Paths of a pixel in which matte surfaces mix: a quarter, but not so few that they show."""
    return max(samples // 4, min(samples, 16))


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
    from scipy import ndimage

    matte = tracer.surfaces.matte(seen.face)
    # what is narrower than a pixel may stand between rays through middles
    beside = tracer.things(position, _FINE) == seen.thing[:, None, :, None]
    whole = matte & beside.all(axis=(1, 3)) & _whole(disparity, seen.thing)
    albedo = np.zeros((*matte.shape, 3), np.float32)
    albedo[whole] = tracer.albedo(position, seen.face[whole], np.argwhere(whole))
    whole &= albedo.min(axis=-1) > _DARKEST
    few = shared_samples(samples, views)
    picture = tracer.picture(position, seed, few)
    # what is beside gloss may show some of it
    own = ~whole & ~ndimage.binary_erosion(matte, np.ones((3, 3)), border_value=1)
    mixed = ~whole & ~own
    for number, (asked, side, paths) in enumerate(
        ((mixed, _WIDE, max(few, mixed_samples(samples))), (own, _NARROW, samples)), start=1
    ):
        if paths > few:
            tiles = _tiles(asked, side)
            picture[tiles[..., 0], tiles[..., 1]] = tracer.tiles(position, tiles, seed + 4096 * number, paths)
    return picture, np.where(whole[..., None], albedo, 0), whole


def _tiles(asked: BoolMap, side: int) -> npt.NDArray[np.int64]:
    """Pixels of the tiles in which any is asked for, ``(N, side, side, 2)``: rows and columns."""
    height, width = asked.shape
    padded = np.pad(asked, ((0, -height % side), (0, -width % side)))
    corners = side * np.argwhere(padded.reshape(-(-height // side), side, -1, side).any(axis=(1, 3)))
    # the last ones reach over those before
    corners = np.minimum(corners, np.array([height, width]) - side)
    tiles: npt.NDArray[np.int64] = corners[:, None, None] + np.moveaxis(np.mgrid[:side, :side], 0, -1)
    return tiles


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
