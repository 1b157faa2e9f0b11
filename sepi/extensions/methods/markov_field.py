"""The final multi-label optimisation of several compared methods, by message passing (TRW-S) [1]_.

``markov_field``, a choice of the global optimisation, takes the previous stage's cost volume and assigns each pixel the
candidate that minimises data costs and truncated linear smoothness, which is weaker across edges of the reference view:
``sum_p cost(p, l_p) + sum_pq w_pq min(|l_p - l_q|, truncation)`` over pixels and 4-connected neighbours. The methods'
authors use graph cuts. On such grids, the energies of TRW-S are as low as those of alpha expansion or lower (compared
in [2]_); it also gives a lower bound, does not depend on the order of labels, and needs no library. The maintained
max-flow packages are either under the GPL, which would bind this package's users, or too slow for a hundred graphs of a
million edges.

References
----------
.. [1] Kolmogorov: Convergent tree-reweighted message passing for energy minimization. IEEE TPAMI 28(10), 2006.
   doi:10.1109/TPAMI.2006.200
.. [2] Szeliski, Zabih, Scharstein, Veksler, Kolmogorov, Agarwala, Tappen, Rother: A comparative study of energy
   minimization methods for Markov random fields. IEEE TPAMI 30(6), 2008. doi:10.1109/TPAMI.2007.70844
"""

import numpy as np
import numpy.typing as npt
from pydantic import Field

from sepi.extensions.methods.costs import disparity_of, distinctness
from sepi.kernels import message_passing as kernels
from sepi.lightfield import FloatMap, LightField
from sepi.stage import Choice, Needs, Parameters, Progress, StageMaps, require_costs


def changes(picture: FloatMap) -> FloatMap:
    """How much a picture (H, W, C) changes along the 4-connected edges.

    Returns
    -------
    ndarray, shape (2, H, W), float32
        Mean absolute difference of the channels from the next pixel in the row, and in the column; 0 at the last ones.
    """
    return np.stack([np.abs(np.diff(picture, axis=n, append=picture.take([-1], n))).mean(axis=2) for n in (1, 0)])


def labels_of_least_energy(
    costs: npt.NDArray[np.floating], across: FloatMap, down: FloatMap, truncation: float, iterations: int
) -> npt.NDArray[np.int64]:
    """A label for each pixel that nearly minimises data cost and truncated linear smoothness.

    Parameters
    ----------
    costs : ndarray, shape (K, H, W), float
        Data cost of each label.
    across, down : ndarray, shape (H, W), float32
        Weights of the edges to the next pixel in the row and in the column, not negative; those of the last ones do
        not count.
    truncation : float
        Label difference above which the cost is constant.
    iterations : int
        Forward and backward passes; about ten are enough for maps.

    Returns
    -------
    ndarray, shape (H, W), int64
        0..K-1.
    """
    volume = np.ascontiguousarray(costs.transpose(1, 2, 0), np.float32)
    messages, labels = np.zeros((4, *volume.shape), np.float32), np.empty(volume.shape[:2], np.int64)
    for _ in range(iterations):
        kernels.pass_messages(volume, across, down, truncation, messages)
    kernels.decode(volume, across, down, truncation, messages, labels)
    return labels


class MarkovFieldParameters(Parameters):
    """Parameters of the multi-label optimisation."""

    needs = Needs(bytes_per_sample=6, bytes_per_pixel=4000, seconds_per_megasample=0.6)

    smoothness: float = Field(0.02, ge=0, description="cost of a change by a hundredth of the disparity range")
    truncation: float = Field(0.1, gt=0, le=1, description="largest change that counts, share of the disparity range")
    contrast: float = Field(0.05, gt=0, description="difference of colours, 0..1, at which smoothness falls to 1/e")
    iterations: int = Field(8, ge=1, le=100, description="passes of the messages, there and back")


def markov_field(
    light_field: LightField, previous: StageMaps | None, parameters: MarkovFieldParameters, progress: Progress
) -> StageMaps:
    """Candidates of least energy.

    Requires maps with a cost volume.

    Returns
    -------
    StageMaps
        Without the cost volume.
    """
    before, volume = require_costs(previous)
    intervals = len(volume.disparities) - 1
    weight = np.float32(parameters.smoothness * 100 / intervals)
    across, down = weight * np.exp(-changes(light_field.reference_view) / np.float32(parameters.contrast))
    truncation = parameters.truncation * intervals
    labels = labels_of_least_energy(volume.costs, across, down, truncation, parameters.iterations)
    progress(1.0)
    return before.updated(disparity_of(volume, labels), distinctness(volume, labels)).without_costs()


CHOICES = {"optimize": {"markov_field": Choice(MarkovFieldParameters, markov_field)}}
