"""Compiled loops of tree-reweighted message passing, on one thread: each pixel waits for the one before it.

``messages[d, y, x]`` is what comes to a pixel from its neighbour at the left, above, at the right, below.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from sepi.compiled import njit

_LEFT, _ABOVE, _RIGHT, _BELOW = 0, 1, 2, 3


@njit(inline="always")
def _send(belief: Any, back: Any, weight: Any, truncation: Any, out: Any) -> None:
    """Message over an edge: the lower envelope of truncated cones that stand on half the belief less what came back."""
    K = belief.size
    half, least = np.float32(0.5), np.float32(np.inf)
    for k in range(K):
        out[k] = half * belief[k] - back[k]
        least = min(least, out[k])
    for k in range(1, K):
        out[k] = min(out[k], out[k - 1] + weight)
    for k in range(K - 2, -1, -1):
        out[k] = min(out[k], out[k + 1] + weight)
    most = weight * truncation
    for k in range(K):
        out[k] = min(out[k] - least, most)


@njit(inline="always")
def _believe(cost: Any, messages: Any, y: int, x: int, out: Any) -> None:
    """Data cost of a pixel and all that its neighbours say of it."""
    a, b, c, d = messages[0, y, x], messages[1, y, x], messages[2, y, x], messages[3, y, x]
    for k in range(out.size):
        out[k] = cost[k] + a[k] + b[k] + c[k] + d[k]


@njit(cache=True)
def pass_messages(costs: Any, across: Any, down: Any, truncation: Any, messages: Any) -> None:
    """One pass forth, to the right and down, and one back, over ``costs (H, W, K)``."""
    H, W, K = costs.shape
    belief = np.empty(K, np.float32)
    for y in range(H):
        for x in range(W):
            _believe(costs[y, x], messages, y, x, belief)
            if x + 1 < W:
                _send(belief, messages[_RIGHT, y, x], across[y, x], truncation, messages[_LEFT, y, x + 1])
            if y + 1 < H:
                _send(belief, messages[_BELOW, y, x], down[y, x], truncation, messages[_ABOVE, y + 1, x])
    for y in range(H - 1, -1, -1):
        for x in range(W - 1, -1, -1):
            _believe(costs[y, x], messages, y, x, belief)
            if x > 0:
                _send(belief, messages[_LEFT, y, x], across[y, x - 1], truncation, messages[_RIGHT, y, x - 1])
            if y > 0:
                _send(belief, messages[_ABOVE, y, x], down[y - 1, x], truncation, messages[_BELOW, y - 1, x])


@njit(cache=True)
def decode(costs: Any, across: Any, down: Any, truncation: Any, messages: Any) -> Any:
    """A label for each pixel in turn, given those of the pixels before it and what those after it say."""
    H, W, K = costs.shape
    labels = np.empty((H, W), np.int64)
    for y in range(H):
        for x in range(W):
            best, least = 0, np.float32(np.inf)
            for k in range(K):
                total = costs[y, x, k] + messages[_RIGHT, y, x, k] + messages[_BELOW, y, x, k]
                if x > 0:
                    total += across[y, x - 1] * min(np.float32(abs(k - labels[y, x - 1])), truncation)
                if y > 0:
                    total += down[y - 1, x] * min(np.float32(abs(k - labels[y - 1, x])), truncation)
                if total < least:
                    best, least = k, total
            labels[y, x] = best
    return labels
