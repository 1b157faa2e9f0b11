"""Pictures of calibrated cameras, rotated and undistorted with a single interpolation."""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt

from sepi.errors import SepiError
from sepi.extensions.cameras.frame import Frame, Seeing
from sepi.io.images import read_picture
from sepi.lightfield import BoolMap, FloatMap, as_unit_float

# order of the splines: the third blurs more, which costs accuracy at silhouettes
_SPLINES = 5
# largest distance of samples that count as exactly on a pixel
_ON_PIXEL = 1e-6


def rectified_view(seeing: Seeing, frame: Frame, view: int) -> tuple[FloatMap, BoolMap]:
    """A view's pixels (H, W, C), float32, in 0..1 except for overshoot, and the mask of missing ones, which are 0.

    Splines of the fifth order blur less than direct weights of as many samples.
    """
    from scipy import ndimage

    height, width = frame.shape
    # the frame's first pixel in the reference's original picture
    first = np.subtract(seeing.principal, frame.principal)
    pixels = (
        np.stack(np.meshgrid(np.arange(width), np.arange(height)), axis=-1).reshape(-1, 2).astype(np.float64) + first
    )
    at = seeing.pixels(view, pixels)[:, ::-1].T
    absent = np.isnan(at[0])
    at = np.where(absent, 0, at)
    picture, unusable = as_unit_float(read_picture(seeing.model.pictures[view])), _masked(seeing, view)
    if np.abs(at - np.rint(at)).max() < _ON_PIXEL:
        row, column = np.rint(at).astype(int)
        found = picture[row, column]
    else:
        # samples between pixels depend mostly on the four around them
        unusable = np.asarray(cv2.dilate(unusable, np.ones((3, 3), np.uint8)), np.uint8)
        channels = [
            ndimage.map_coordinates(picture[..., c], at, np.float32, order=_SPLINES, mode="mirror")
            for c in range(picture.shape[2])
        ]
        found = np.clip(np.stack(channels, axis=-1), -0.5, 1.5)
    absent |= unusable[tuple(np.rint(at).astype(int))] > 0
    found = np.where(absent[:, None], 0, found).reshape(height, width, -1)
    return np.asarray(found, np.float32), absent.reshape(height, width)


def completed(view: FloatMap, missing: BoolMap) -> FloatMap:
    """A view (H, W, C) with missing pixels (H, W) replaced by the nearest other one."""
    if missing.all() or not missing.any():
        return view
    from scipy import ndimage

    row, column = ndimage.distance_transform_edt(missing, return_distances=False, return_indices=True)
    return np.asarray(view[row, column])


def _masked(seeing: Seeing, view: int) -> npt.NDArray[np.uint8]:
    """Mask of a picture: 1 where it is not to be used, else 0."""
    lens, masks = seeing.model.shots[view].lens, seeing.model.masks
    path = masks[view] if masks else None
    if path is None:
        return np.zeros((lens.height, lens.width), np.uint8)
    mask = read_picture(path)
    if mask.shape[:2] != (lens.height, lens.width):
        raise SepiError(
            f"{path}: {mask.shape[1]}x{mask.shape[0]} pixels; expected a mask as large as its picture, "
            f"{lens.width}x{lens.height}"
        )
    return np.asarray(mask.reshape(lens.height, lens.width, -1)[..., 0] == 0, np.uint8)
