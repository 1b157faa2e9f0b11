"""Superpixels of the reference view: geometry, neighbours, and likeness of colour (section IV-C of [1]_).

References
----------
.. [1] Zhou, Shi, Liu, Jin, Zhang, Hou: Light Field Depth Estimation via Stitched Epipolar Plane Images.
.. [2] Achanta et al.: SLIC superpixels compared to state-of-the-art superpixel methods. TPAMI 34(11), 2012.
   doi:10.1109/TPAMI.2012.120
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from sepi.lightfield import BoolMap, FloatArray, FloatMap

IntArray = npt.NDArray[np.int64]


@dataclass(frozen=True)
class Superpixels:
    """A partition of an image into superpixels.

    Attributes
    ----------
    labels : ndarray, shape (H, W), int
        0..N-1, each present.
    sizes : ndarray, shape (N,), int
        Pixels.
    centroids : ndarray, shape (N, 2), float
        ``(x, y)`` in pixels.
    """

    labels: IntArray
    sizes: IntArray
    centroids: FloatArray

    def __len__(self) -> int:
        return len(self.sizes)

    def sums(self, values: npt.NDArray[np.generic]) -> FloatArray:
        """Sum of a map over each superpixel; shape (N,)."""
        weights = np.asarray(values, np.float64).ravel()
        return np.asarray(np.bincount(self.labels.ravel(), weights, len(self)), np.float64)

    def means(self, values: npt.NDArray[np.generic]) -> FloatArray:
        """Mean of a map over each superpixel; shape (N,)."""
        return np.asarray(self.sums(values) / self.sizes, np.float64)

    def interior(self) -> BoolMap:
        """Pixels whose four neighbours all belong to the same superpixel; shape (H, W), bool."""
        inside = np.ones(self.labels.shape, bool)
        across, down = self.labels[:, 1:] != self.labels[:, :-1], self.labels[1:] != self.labels[:-1]
        inside[:, 1:] &= ~across
        inside[:, :-1] &= ~across
        inside[1:] &= ~down
        inside[:-1] &= ~down
        return inside


@dataclass(frozen=True)
class Adjacency:
    """Pairs of superpixels with a common border.

    Attributes
    ----------
    first, second : ndarray, shape (E,), int
        ``first < second``.
    lengths : ndarray, shape (E,), int
        Length of the border in pixels.
    midpoints : ndarray, shape (E, 2), float
        ``(x, y)`` of the middle of the border.
    """

    first: IntArray
    second: IntArray
    lengths: IntArray
    midpoints: FloatArray

    def subset(self, keep: BoolMap) -> Adjacency:
        """The pairs for which ``keep``, shape (E,), is set."""
        return Adjacency(self.first[keep], self.second[keep], self.lengths[keep], self.midpoints[keep])


def superpixels(reference_view: FloatMap, size: int, compactness: float) -> Superpixels:
    """SLIC superpixels of about ``size x size`` pixels.

    Parameters
    ----------
    reference_view : ndarray, shape (H, W, 3), float32
        Values in 0..1.
    size : int
        Pixels.
    compactness : float
        Weight of distance relative to colour, as in scikit-image.
    """
    from skimage.segmentation import slic

    H, W = reference_view.shape[:2]
    turned, turned_back = _upright(reference_view)
    # an odd step and equal padding: seeds are symmetric about the centre, and no pixel lies midway between two
    step = size | 1
    beyond = [(n + step * (n % 2)) // 2 for n in (-turned.shape[0] % step, -turned.shape[1] % step)]
    padded = np.pad(turned, [(n, n) for n in (*beyond, 0)], "edge")
    number = padded.shape[0] * padded.shape[1] // step**2
    found = slic(padded, n_segments=number, compactness=compactness, start_label=0, channel_axis=2)
    inside = (slice(n, n + length) for n, length in zip(beyond, turned.shape, strict=False))
    labels = turned_back(found[tuple(inside)])
    labels = np.unique(labels, return_inverse=True)[1].reshape(H, W).astype(np.int64)
    sizes = np.bincount(labels.ravel())
    rows, columns = np.indices((H, W))
    sums = [np.bincount(labels.ravel(), axis.ravel().astype(np.float64)) for axis in (columns, rows)]
    return Superpixels(labels, sizes, np.stack(sums, axis=1) / sizes[:, None])


def _upright(view: FloatMap) -> tuple[FloatMap, Callable[[IntArray], IntArray]]:
    """A view turned so that it gets brighter mostly downwards, then to the right, and the function that turns back.

    SLIC depends on the order of rows and columns; this way it finds the same superpixels in a turned view.
    """
    grey = view.sum(axis=2, dtype=np.float64)
    down, across = (
        float(grey.sum(axis=1 - axis) @ (np.arange(length) - (length - 1) / 2)) / length
        for axis, length in enumerate(grey.shape)
    )
    mirrored = np.s_[:: -1 if down < 0 else 1, :: -1 if across < 0 else 1]
    view = view[mirrored]
    if abs(across) <= abs(down):
        return view, lambda labels: labels[mirrored]
    return view.transpose(1, 0, 2), lambda labels: labels.T[mirrored]


def adjacency(segments: Superpixels) -> Adjacency:
    """Pairs of superpixels that touch, with the length and the middle of their border."""
    labels = segments.labels
    pieces = []
    for a, b, offset in ((labels[:, :-1], labels[:, 1:], (0.5, 0.0)), (labels[:-1], labels[1:], (0.0, 0.5))):
        y, x = np.nonzero(a != b)
        low, high = np.minimum(a[y, x], b[y, x]), np.maximum(a[y, x], b[y, x])
        pieces.append(np.stack([low, high, x + offset[0], y + offset[1]], axis=1))
    sides = np.concatenate(pieces)
    pairs, index = np.unique(
        sides[:, 0].astype(np.int64) * len(segments) + sides[:, 1].astype(np.int64), return_inverse=True
    )
    lengths = np.bincount(index, minlength=len(pairs))
    sums = np.stack([np.bincount(index, sides[:, k], len(pairs)) for k in (2, 3)], axis=1)
    return Adjacency(pairs // len(segments), pairs % len(segments), lengths, sums / np.maximum(lengths, 1)[:, None])


def colour_modes(reference_view: FloatMap, segments: Superpixels, bandwidth: float) -> FloatArray:
    """Mean-shift mode of each superpixel's mean colour in HSV space: the propagation cue of section IV-C.

    Parameters
    ----------
    reference_view : ndarray, shape (H, W, 3), float32
        Values in 0..1.
    segments : Superpixels
    bandwidth : float
        Standard deviation of the kernel in the HSV cone (radius and height 1).

    Returns
    -------
    ndarray, shape (N, 3), float
        Points of the HSV cone; superpixels of one cluster share a point.
    """
    from sepi.image.mean_shift import sample_modes

    hue, saturation, value = np.moveaxis(cv2.cvtColor(reference_view, cv2.COLOR_RGB2HSV), 2, 0)
    # hue is an angle, unreliable for weak colours: in a cone, both are right
    chroma = saturation * value
    cone = (chroma * np.cos(np.radians(hue)), chroma * np.sin(np.radians(hue)), value)
    samples = np.stack([segments.means(axis) for axis in cone], axis=1)
    return sample_modes(samples, bandwidth)
