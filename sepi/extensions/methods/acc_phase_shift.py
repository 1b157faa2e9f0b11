"""Sub-pixel shifts of images in the Fourier domain, by the phase shift theorem.

``I(x + D) = F^-1{ F{I}(w) exp(2 pi i w D) }`` is exact for a periodic, band-limited image. Views are not periodic: the
jump between opposite borders would cause ringing, and content would wrap around. Here an image is extended by its
mirror image as far as samples reach; beyond, that is blended with the mirror image of the opposite border, so that the
period has no seam.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from sepi.kernels import thread_count
from sepi.lightfield import FloatMap

_SEAM = 16
"""Pixels over which the two mirror images are blended."""


class PhaseShift:
    """Images to be shifted by fractions of a pixel in the Fourier domain.

    Parameters
    ----------
    pictures : ndarray, shape (C, H, W), float32
    farthest : float or None
        Largest offset in pixels along either axis. None: the images are periodic.
    """

    def __init__(self, pictures: FloatMap, farthest: float | None) -> None:
        from scipy import fft

        if farthest is not None:
            margin = 2 * int(np.ceil(farthest)) + _SEAM
            pictures = _seamless(_seamless(pictures, 1, margin), 2, margin)
        self._size = pictures.shape[1:]
        self._spectrum = fft.rfft2(pictures)

    def by(self, offsets: npt.NDArray[np.float64]) -> FloatMap:
        """Samples of the images at ``(y, x) + offset``.

        Parameters
        ----------
        offsets : ndarray, shape (M, 2), float64
            Down and across, pixels.

        Returns
        -------
        ndarray, shape (M, C, H or more, W or more), float32
            Values beyond the images' height and width are meaningless.
        """
        from scipy import fft

        rows, columns = (_phases(length, offsets[:, axis]) for axis, length in enumerate(self._size))
        turned = self._spectrum * (rows[:, None, :, None] * columns[:, None, None, : self._spectrum.shape[2]])
        moved = fft.irfft2(turned, s=self._size, overwrite_x=True, workers=thread_count())
        return np.asarray(moved, np.float32)


def _phases(length: int, offsets: npt.NDArray[np.float64]) -> npt.NDArray[np.complex64]:
    """Phase factors of all frequencies for each offset; shape (M, length), complex64."""
    phases = np.exp(2j * np.pi * np.outer(offsets, np.fft.fftfreq(length)))
    if length % 2 == 0:
        # the Nyquist frequency represents both signs: a real image stays real
        phases[:, length // 2] = phases[:, length // 2].real
    return phases.astype(np.complex64)


def _seamless(pictures: FloatMap, axis: int, margin: int) -> FloatMap:
    """Images extended at the end of an axis by their mirror image, blended into that of the start."""
    from scipy import fft

    length = pictures.shape[axis]
    extra = fft.next_fast_len(length + margin, real=True) - length
    along = np.moveaxis(pictures, axis, -1)
    beyond_end = np.pad(along, ((0, 0), (0, 0), (0, extra)), mode="symmetric")[..., length:]
    before_begin = np.pad(along, ((0, 0), (0, 0), (extra, 0)), mode="symmetric")[..., :extra]
    # both halves are unblended as far as samples reach
    step = np.linspace(-extra / 2, extra / 2, extra, dtype=np.float32) / np.float32(_SEAM / 2)
    share = np.float32(0.5) + np.float32(0.5) * np.sin(np.float32(np.pi / 2) * np.clip(step, -1, 1))
    joined = np.concatenate([along, beyond_end + share * (before_begin - beyond_end)], axis=-1)
    return np.ascontiguousarray(np.moveaxis(joined, -1, axis))
