"""Paths for each pixel of a view, by the surface that it shows, and the light that views share.

A matte surface sends the same light to all views. A pixel's colour divided by its albedo is the light that falls on it.
The mean over the views that see the same point, by the exact disparity, replaces each view's light; 81 views have a
ninth of the noise. This mean is averaged again over nearby pixels whose light is the same within the spread of the
views. So a few paths in each view are enough. Pixels with several surfaces keep their own light and need more paths;
specular surfaces (gloss, mirrors and glass), which look different from view to view, need all.
"""

import math
from collections.abc import Callable

import cv2
import numpy as np
import numpy.typing as npt
from numpy.lib.stride_tricks import sliding_window_view

from sepi.extensions.rendered.shapes import Points
from sepi.extensions.rendered.surfaces import FirstSurface
from sepi.extensions.rendered.tracing import SPREAD, Pixels, Tracer
from sepi.extensions.rendered.world import FloatArray, Position
from sepi.kernels import reprojection as kernels
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


Pass = tuple[Pixels, int, int, Callable[[], FloatArray]]
"""Paths of some pixels of a view: their rows and columns in square tiles (N, T, T, 2), the number of their earlier
paths, that of these, and a function that traces them and returns linear pictures of the tiles, (N, T, T, 3)."""


def planned(
    tracer: Tracer, position: Position, seen: FirstSurface, samples: int, seed: int
) -> tuple[list[Pass], FloatArray, BoolMap]:
    """The plan of a view's samples.

    Parameters
    ----------
    tracer : Tracer
    position : Position
        Position of the view, without a turn.
    seen : FirstSurface
        Surfaces seen from there.
    samples : int
        Largest number of paths of a pixel.
    seed : int
        First seed of the paths; some that follow are used, too.

    Returns
    -------
    passes : list of Pass
        In order.
    albedo : ndarray, shape (H, W, 3), float32
        Linear albedo; 0 where unknown.
    whole : ndarray, shape (H, W), bool
        Pixels of known albedo that show one matte, nearly flat surface.
    """
    # things narrower than a pixel may lie between the rays through middles
    beside = tracer.surfaces.things(position, _FINE)
    matte = tracer.surfaces.matte[beside].sum(axis=(1, 3))
    same = (beside == seen.thing[:, None, :, None]).all(axis=(1, 3))
    disparity = tracer.rig.disparity(seen.depth).astype(np.float32)
    whole = (matte == _FINE**2) & same & _flat(disparity, seen.thing)
    albedo = tracer.surfaces.albedo(position, seen.face, whole)
    whole &= albedo.min(axis=-1) > _DARKEST
    albedo[~whole] = 0
    differs = 2 * matte < _FINE**2
    # on a matte surface, over all views about three times the samples
    few = min(samples, math.ceil(3 * samples / math.prod(tracer.rig.grid)))
    # with several surfaces, so many that those after the first few are spread evenly; as on gloss
    mixed = max(samples // 6, min(samples, few + SPREAD))
    glossy = max(few, round(tracer.world.light.gloss * samples), min(samples, SPREAD))
    kinds = ((~differs, 0, few), (~differs & ~whole, few, mixed - few), (differs, 0, glossy))
    passes: list[Pass] = []
    for asked, taken, paths in kinds:
        for pixels in _tiles(asked, paths) if paths > 0 else ():
            passes.append((pixels, taken, paths, tracer.tiles(position, pixels, paths, seed + 4096 * len(passes))))
    return passes, albedo, whole


def pictured(passes: list[Pass], size: int) -> FloatArray:
    """The picture of a view of ``size`` pixels a side, linear, 1 is white; shape (H, W, 3), float32."""
    picture = np.zeros((size, size, 3), np.float32)
    for pixels, taken, paths, pictures in passes:
        where = pixels[..., 0], pixels[..., 1]
        picture[where] = (taken * picture[where] + paths * pictures()) / np.float32(taken + paths)
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


Things = npt.NDArray[np.int16]
# largest difference between disparities of one point, pixels per view step
_ONE_POINT = 0.02
# half width in pixels of the window of nearby pixels
_REACH = 3
# largest difference of the same light, as a multiple of that by noise
_DOUBT = 2.0
# half width in pixels of the window that limits the light at bends and corners of a surface
_BESIDE = 2


def with_shared_light(
    pictures: FloatArray, albedo: FloatArray, things: Things, whole: BoolMap, disparities: FloatArray, positions: Points
) -> FloatArray:
    """The pictures of all views with shared light on matte surfaces.

    Parameters
    ----------
    pictures : ndarray, shape (N, H, W, 3), float32
        Path-traced pictures, linear.
    albedo : ndarray, shape (N, H, W, 3), float32
        Albedo of matte surfaces; 0 where unknown.
    things : ndarray, shape (N, H, W), int16
        Number of each pixel's thing.
    whole : ndarray, shape (N, H, W), bool
        Pixels that show, with their neighbours, one matte surface.
    disparities : ndarray, shape (N, H, W), float32
        Pixels per view step.
    positions : ndarray, shape (N, 2), float64
        Positions of the views, ``(down, across)`` in view steps.

    Returns
    -------
    ndarray, shape (N, H, W, 3), float32
    """
    # irradiance over pi
    light = (pictures / np.where(whole[..., None], albedo, 1)).astype(np.float32)
    surface = np.where(whole, things, np.int16(-1))
    shown = np.empty_like(light)
    mean, variance = np.empty_like(light[0]), np.empty_like(disparities[0])
    for view, own in enumerate(surface):
        baselines = positions - positions[view]
        kernels.gathered_light(light, disparities, surface, baselines, view, _ONE_POINT, mean, variance)
        alike = alike_light(mean, variance, own)
        shown[view] = np.where(whole[view][..., None], alike * albedo[view], pictures[view])
        limit_bent(things[view], whole[view], shown[view])
    return shown


def limit_bent(things: Things, whole: BoolMap, shown: FloatArray) -> None:
    """Limit pixels (H, W, 3) that are not whole, within one thing, to the range of nearby whole ones."""
    bent = ~whole & (cv2.erode(things, np.ones((3, 3))) == cv2.dilate(things, np.ones((3, 3))))
    side, around = 2 * _BESIDE + 1, ((_BESIDE, _BESIDE), (_BESIDE, _BESIDE))
    surface, light = np.pad(np.where(whole, things, -1), around, constant_values=-1), np.pad(shown, (*around, (0, 0)))
    same = sliding_window_view(surface, (side, side))[bent] == things[bent][:, None, None]
    beside = sliding_window_view(light, (side, side), (0, 1))[bent]
    low = np.where(same[:, None], beside, np.float32(np.inf)).min(axis=(2, 3))
    high = np.where(same[:, None], beside, np.float32(-np.inf)).max(axis=(2, 3))
    known = same.any(axis=(1, 2))[:, None]
    shown[bent] = np.where(known, np.clip(shown[bent], low, high), shown[bent])


def alike_light(light: FloatArray, variance: FloatArray, surface: Things) -> FloatArray:
    """Mean light over the pixels near each whole one whose 3x3 patches differ by noise only.

    Parameters
    ----------
    light : ndarray, shape (H, W, 3), float32
    variance : ndarray, shape (H, W), float32
        Variance of the sum of its colours.
    surface : ndarray, shape (H, W), int16
        Thing of each whole pixel; pixels with -1 keep their light.

    Returns
    -------
    ndarray, shape (H, W, 3), float32
    """
    height, width = surface.shape
    whole = surface >= 0
    # sums over a patch: grey, its variance, and number of pixels in the picture
    patches = np.pad([light.sum(axis=2), variance, whole], ((0, 0), (_REACH + 1,) * 2, (_REACH + 1,) * 2))
    colours = np.pad([*np.moveaxis(light, 2, 0), np.ones_like(variance)], ((0, 0), (_REACH,) * 2, (_REACH,) * 2))
    things = np.pad(surface, _REACH, constant_values=-1)
    own, total = patches[:, _REACH:-_REACH, _REACH:-_REACH], np.zeros((4, height, width), np.float32)
    for y, x in np.ndindex(2 * _REACH + 1, 2 * _REACH + 1):
        other = patches[:, y : y + height + 2, x : x + width + 2]
        # difference beyond that by noise
        apart = own[2] * other[2] * (np.square(own[0] - other[0]) - np.float32(_DOUBT) * (own[1] + other[1]))
        rows = apart[:-2] + apart[1:-1] + apart[2:]
        alike = rows[:, :-2] + rows[:, 1:-1] + rows[:, 2:] <= 0
        alike &= things[y : y + height, x : x + width] == surface
        total += colours[:, y : y + height, x : x + width] * alike
    mean = np.moveaxis(total[:3] / np.maximum(total[3], 1), 0, 2)
    return np.where(whole[..., None], mean, light)
