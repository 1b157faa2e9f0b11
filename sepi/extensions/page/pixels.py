"""Pixels to show, chosen from the maps of a variant: sure, occluded on each side, textureless, wrong, unsure.

This is for display only; ground truth is used to find the largest error.
"""

from typing import NamedTuple

import cv2
import numpy as np
import numpy.typing as npt

from sepi.lightfield import BoolMap, FloatMap, LightField
from sepi.matching.view_subsets import HALVES_AND_QUARTERS, SIDES
from sepi.stage import StageMaps

APART = 12
"""Least distance between two of them, pixels."""

BORDER = 8
"""Least distance from the picture's border if the picture is large enough, pixels."""

# side of the windows over which a property must hold, so that no odd single pixel is chosen, pixels
_WINDOW = 5
# distance within which an occluder is searched, and a sure pixel has no depth discontinuity, pixels
_REACH = 10
# least spread of disparities round a depth discontinuity, pixels per view step
_DISCONTINUITY = 0.3
# depth step to the occluder beyond which a larger one scores no more, pixels per view step
_CLEAR_DIFFERENCE = 2.0
# gradient beyond which more texture scores no more, full range per pixel
_CLEAR_TEXTURE = 0.03


class InterestingPixel(NamedTuple):
    """A pixel of the reference view, and why it was chosen."""

    y: int
    x: int
    label: str


def kept_subsets(maps: StageMaps) -> npt.NDArray[np.uint8]:
    """Number of the view subset that the occlusion stage kept at each pixel, (H, W); 0 (all views) without it."""
    return maps.extra.get("view_subset", np.zeros(maps.disparity.shape, np.uint8))


def interesting_pixels(light_field: LightField, maps: StageMaps) -> list[InterestingPixel]:
    """Pixels that show how the method works and where it fails.

    In order, if the scene has them: textured and sure; occluded, one for each half of the views that is kept, the
    clearest first; textureless; with the largest error; unsure. Equal input gives equal pixels.

    Parameters
    ----------
    light_field : LightField
        Its ground truth may be unknown, or not finite.
    maps : StageMaps
        Final maps of a variant, with its masks and ``view_subset`` if it has them.

    Returns
    -------
    list of InterestingPixel
        At least ``APART`` pixels from each other, and ``BORDER`` from the border of a picture that is large enough.
    """
    texture = _texture(light_field.reference_view)
    scores = [
        ("textured and sure", _sure(texture, maps)),
        *_occluded(texture, maps),
        _textureless(texture, maps),
        ("largest error", _wrong(maps.disparity, light_field.ground_truth)),
        ("textured but unsure", _unsure(texture, maps)),
    ]
    free = _inner(light_field.shape)
    found: list[InterestingPixel] = []
    for label, score in scores:
        # a score of zero means that there is no such pixel
        values = np.where(free, np.nan_to_num(score), 0)
        y, x = (int(place) for place in np.unravel_index(values.argmax(), values.shape))
        if values[y, x] > 0:
            found.append(InterestingPixel(y, x, label))
            rows, columns = np.ogrid[: free.shape[0], : free.shape[1]]
            free &= (rows - y) ** 2 + (columns - x) ** 2 >= APART**2
    return found


def _texture(reference_view: FloatMap) -> FloatMap:
    """Strength of the gradient around each pixel, full range per pixel; shape (H, W)."""
    # Scharr's weights sum to 32 per pixel of distance
    across, down = (cv2.Scharr(reference_view, cv2.CV_32F, *order) / 32 for order in ((1, 0), (0, 1)))
    return np.sqrt(_blurred((across**2 + down**2).mean(axis=2)))


def _sure(texture: FloatMap, maps: StageMaps) -> FloatMap:
    sure = _blurred(maps.confidence) * np.minimum(texture / _CLEAR_TEXTURE, 1)
    alone = ~(maps.mask("occluded") | maps.mask("textureless"))
    smooth = alone & (_spread(maps.disparity, _REACH) < _DISCONTINUITY)
    return np.where(smooth if smooth.any() else alone, sure, 0).astype(np.float32)


def _occluded(texture: FloatMap, maps: StageMaps) -> list[tuple[str, FloatMap]]:
    """A label and score for each half of the views that is kept somewhere, the highest score first."""
    names, subset = HALVES_AND_QUARTERS, kept_subsets(maps)
    # a map that changes from pixel to pixel is smoothed over the edge, or uncertain
    even = 1 / (1 + _spread(maps.disparity, 1) / _DISCONTINUITY)
    clear = even * np.minimum(texture / _CLEAR_TEXTURE, 1) * np.nan_to_num(maps.confidence)
    scores = []
    for name, (dt, ds) in SIDES.items():
        kept = subset == names.index(name)
        # the views kept lie towards (dt, ds), so the occluder lies on the opposite side
        nearer = _nearest_towards(maps.disparity, -dt, -ds) - maps.disparity
        nearer = np.clip(np.nan_to_num(nearer), 0, _CLEAR_DIFFERENCE)
        score = np.where(kept, _blurred(kept.astype(np.float32)) * nearer * clear, 0).astype(np.float32)
        scores.append((f"occluded, {name} half kept", score))
    return sorted(scores, key=lambda labelled: -float(labelled[1].max()))


def _nearest_towards(disparity: FloatMap, dy: int, dx: int) -> FloatMap:
    """Largest disparity from each pixel on, within reach in direction ``(dy, dx)``."""
    kernel = np.zeros((2 * _REACH + 1, 2 * _REACH + 1), np.uint8)
    steps = np.arange(_REACH + 1)
    kernel[_REACH + dy * steps, _REACH + dx * steps] = 1
    return np.asarray(cv2.dilate(np.nan_to_num(disparity), kernel), np.float32)


def _spread(disparity: FloatMap, radius: int) -> FloatMap:
    """Largest minus smallest disparity of the square neighbourhood of each pixel."""
    kernel = np.ones((2 * radius + 1, 2 * radius + 1), np.uint8)
    finite = np.nan_to_num(disparity)
    return np.asarray(cv2.dilate(finite, kernel) - cv2.erode(finite, kernel), np.float32)


def _textureless(texture: FloatMap, maps: StageMaps) -> tuple[str, FloatMap]:
    """A label and a score: depth inside textureless regions; without any, lack of texture."""
    mask = maps.mask("textureless")
    if not mask.any():
        return "least texture", np.asarray(1 / (1 + texture / _CLEAR_TEXTURE), np.float32)
    # with a frame, so that a picture without texture has a middle, too
    framed = np.pad(mask.astype(np.uint8), 1)
    inside = cv2.distanceTransform(framed, cv2.DIST_L2, cv2.DIST_MASK_PRECISE)[1:-1, 1:-1]
    return "textureless", np.asarray(inside, np.float32)


def _wrong(disparity: FloatMap, ground_truth: FloatMap | None) -> FloatMap:
    if ground_truth is None:
        return np.zeros_like(disparity)
    return _blurred(np.nan_to_num(np.abs(disparity - ground_truth), nan=0.0, posinf=0.0))


def _unsure(texture: FloatMap, maps: StageMaps) -> FloatMap:
    doubt = np.clip(1 - _blurred(maps.confidence), 0, 1) * np.minimum(texture / _CLEAR_TEXTURE, 1)
    return np.where(maps.mask("occluded") | maps.mask("textureless"), 0, doubt).astype(np.float32)


def _blurred(values: FloatMap) -> FloatMap:
    finite = np.ascontiguousarray(np.nan_to_num(values), np.float32)
    return np.asarray(cv2.blur(finite, (_WINDOW, _WINDOW)), np.float32)


def _inner(shape: tuple[int, int]) -> BoolMap:
    """Mask of pixels away from the border; of a small picture, of its middle."""
    y, x = (min(BORDER, (size - 1) // 2) for size in shape)
    return np.pad(np.ones((shape[0] - 2 * y, shape[1] - 2 * x), bool), ((y, y), (x, x)))
