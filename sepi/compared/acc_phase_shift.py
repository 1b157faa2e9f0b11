"""Pictures moved by fractions of a pixel in the Fourier domain, by the phase shift theorem.

``I(x + D) = F^-1{ F{I}(w) exp(2 pi i w D) }`` is exact for a periodic picture without detail beyond the highest
frequency. Views are not periodic: what leaves at one border would come in at the opposite one, and the jump between
the two would ring. Here a picture goes on as its own mirror image, as far as samples reach, and crosses over to that of
the opposite border beyond, so that its period has no seam.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from sepi.kernels import thread_count
from sepi.lightfield import FloatMap

_SEAM = 16
"""Pixels over which the two mirror images cross over."""


class PhaseShift:
    """Pictures, to be moved by fractions of a pixel in the Fourier domain.

    Parameters
    ----------
    pictures : ndarray, shape (C, H, W), float32
    farthest : float or None
        Of the offsets to come, pixels along either axis. None: the pictures are periodic.
    """

    def __init__(self, pictures: FloatMap, farthest: float | None) -> None:
        from scipy import fft

        if farthest is not None:
            margin = 2 * int(np.ceil(farthest)) + _SEAM
            pictures = _seamless(_seamless(pictures, 1, margin), 2, margin)
        self._size = pictures.shape[1:]
        self._spectrum = fft.rfft2(pictures)

    def by(self, offsets: npt.NDArray[np.float64]) -> FloatMap:
        """The pictures' samples at ``(y, x) + offset``.

        Parameters
        ----------
        offsets : ndarray, shape (M, 2), float64
            Down and across, pixels.

        Returns
        -------
        ndarray, shape (M, C, H or more, W or more), float32
            What lies beyond the pictures' own height and width is of no use.
        """
        from scipy import fft

        rows, columns = (_phases(length, offsets[:, axis]) for axis, length in enumerate(self._size))
        turned = self._spectrum * (rows[:, None, :, None] * columns[:, None, None, : self._spectrum.shape[2]])
        moved = fft.irfft2(turned, s=self._size, overwrite_x=True, workers=thread_count())
        return np.asarray(moved, np.float32)


def _phases(length: int, offsets: npt.NDArray[np.float64]) -> npt.NDArray[np.complex64]:
    """Factors of the frequencies of a period for each offset; shape (M, length), complex64."""
    phases = np.exp(2j * np.pi * np.outer(offsets, np.fft.fftfreq(length)))
    if length % 2 == 0:
        # the highest frequency stands for both its signs: a real picture stays real
        phases[:, length // 2] = phases[:, length // 2].real
    return phases.astype(np.complex64)


def _seamless(pictures: FloatMap, axis: int, margin: int) -> FloatMap:
    """Pictures that go on, at the end of an axis, as their mirror image, which becomes that of their beginning."""
    from scipy import fft

    length = pictures.shape[axis]
    extra = fft.next_fast_len(length + margin, real=True) - length
    along = np.moveaxis(pictures, axis, -1)
    beyond_end = np.pad(along, ((0, 0), (0, 0), (0, extra)), mode="symmetric")[..., length:]
    before_begin = np.pad(along, ((0, 0), (0, 0), (extra, 0)), mode="symmetric")[..., :extra]
    # both halves hold whole mirror images as far as samples reach
    step = np.linspace(-extra / 2, extra / 2, extra, dtype=np.float32) / np.float32(_SEAM / 2)
    share = np.float32(0.5) + np.float32(0.5) * np.sin(np.float32(np.pi / 2) * np.clip(step, -1, 1))
    joined = np.concatenate([along, beyond_end + share * (before_begin - beyond_end)], axis=-1)
    return np.ascontiguousarray(np.moveaxis(joined, -1, axis))
