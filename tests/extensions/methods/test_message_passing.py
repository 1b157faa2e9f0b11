"""Message passing against exhaustive search, exact chains, and a plain NumPy twin."""

import itertools

import numpy as np
import pytest

from sepi.extensions.methods.markov_field import changes, labels_of_least_energy
from sepi.kernels import message_passing as kernels


def problem(seed, labels, shape, strength=0.5):
    """Random costs (K, H, W) and weights of the edges."""
    random = np.random.default_rng(seed)
    costs = random.random((labels, *shape)).astype(np.float32)
    across, down = (strength * random.random((2, *shape))).astype(np.float32)
    return costs, across, down


def energy(labels, costs, across, down, truncation):
    """The energy of a labelling; arguments as for :func:`labels_of_least_energy`."""
    data = np.take_along_axis(costs, labels[None], axis=0).sum(dtype=np.float64)
    jumps_across = np.minimum(np.abs(np.diff(labels, axis=1)), truncation)
    jumps_down = np.minimum(np.abs(np.diff(labels, axis=0)), truncation)
    smoothness = (across[:, :-1] * jumps_across).sum(dtype=np.float64) + (down[:-1] * jumps_down).sum(dtype=np.float64)
    return float(data + smoothness)


def least_by_search(costs, across, down, truncation):
    """Least energy over all labellings."""
    count, *shape = costs.shape
    labellings = itertools.product(range(count), repeat=shape[0] * shape[1])
    return min(energy(np.reshape(one, shape), costs, across, down, truncation) for one in labellings)


@pytest.mark.parametrize(("labels", "shape", "truncation"), [(2, (3, 3), 1), (3, (2, 3), 2), (4, (2, 2), 3)])
def test_least_energy_is_that_of_all_labellings(labels, shape, truncation) -> None:
    """Where the smoothness is linear, the bound that the messages climb is the least energy itself."""
    for seed in range(6):
        costs, across, down = problem(seed, labels, shape)
        found = labels_of_least_energy(costs, across, down, truncation, 50)
        expected = least_by_search(costs, across, down, truncation)
        np.testing.assert_allclose(energy(found, costs, across, down, truncation), expected, rtol=1e-5)


def chain_energy(costs, weights, truncation):
    """Least energy of a chain by dynamic programming; ``costs`` (K, n), ``weights`` (n,)."""
    count = np.arange(len(costs))
    jumps = np.minimum(np.abs(count[:, None] - count), truncation)
    best = costs[:, 0].astype(float)
    for n in range(1, costs.shape[1]):
        best = costs[:, n] + (best[:, None] + weights[n - 1] * jumps).min(axis=0)
    return best.min()


@pytest.mark.parametrize("truncation", [1.5, 7])
@pytest.mark.parametrize("shape", [(1, 40), (40, 1)])
def test_a_single_row_or_column_is_solved_exactly(shape, truncation) -> None:
    """Without loops nothing is approximate: views one pixel high would tell on wrong edges of the grid."""
    for seed in range(5):
        costs, across, down = problem(seed, 8, shape)
        weights = (across if shape[0] == 1 else down).ravel()
        found = labels_of_least_energy(costs, across, down, truncation, 60)
        expected = chain_energy(costs.reshape(8, -1), weights, truncation)
        np.testing.assert_allclose(energy(found, costs, across, down, truncation), expected, rtol=1e-5)


def message(belief, back, weight, truncation):
    """Least over the sender's labels of its share, less what came over this edge, and the smoothness."""
    share = belief / 2 - back
    count = np.arange(belief.size)
    out = (share[:, None] + weight * np.minimum(np.abs(count[:, None] - count), truncation)).min(axis=0)
    return out - share.min()


def pass_twin(costs, across, down, truncation, messages):
    """One pass forth and back; ``messages`` (4, H, W, K) from the left, above, the right, below."""
    height, width, _ = costs.shape
    steps = {0: (0, -1), 1: (-1, 0), 2: (0, 1), 3: (1, 0)}
    opposite = {0: 2, 1: 3, 2: 0, 3: 1}
    pixels = list(np.ndindex(height, width))
    for order, senders_sides in ((pixels, (2, 3)), (pixels[::-1], (0, 1))):
        for y, x in order:
            belief = costs[y, x] + messages[:, y, x].sum(axis=0)
            for side in senders_sides:
                v, u = y + steps[side][0], x + steps[side][1]
                if 0 <= v < height and 0 <= u < width:
                    weight = (across if side in (0, 2) else down)[min(y, v), min(x, u)]
                    sent = message(belief, messages[side, y, x], weight, truncation)
                    messages[opposite[side], v, u] = sent


@pytest.mark.parametrize("truncation", [1.5, 2, 100])
def test_a_pass_equals_a_plain_twin(truncation) -> None:
    """The distance transform in linear time is the plain minimum over pairs of labels."""
    costs, across, down = problem(7, 6, (5, 4))
    volume = np.ascontiguousarray(costs.transpose(1, 2, 0))
    found = np.zeros((4, *volume.shape), np.float32)
    expected = np.zeros(found.shape)
    for _ in range(3):
        kernels.pass_messages(volume, across, down, truncation, found)
        pass_twin(volume.astype(float), across.astype(float), down.astype(float), truncation, expected)
    np.testing.assert_allclose(found, expected, atol=1e-5)


def test_changes_are_those_across_edges_and_zero_at_the_last_pixels() -> None:
    """Depth may only step where the picture does."""
    guide = np.zeros((4, 6, 3), np.float32)
    guide[:, 3:] = [0.05, 0.1, 0.15]
    across, down = changes(guide)
    np.testing.assert_allclose(across, np.tile([0, 0, 0.1, 0, 0, 0], (4, 1)), rtol=1e-5)
    np.testing.assert_array_equal(down, 0)
