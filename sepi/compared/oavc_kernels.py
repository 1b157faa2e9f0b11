"""Compiled loops of the vote cost."""

from __future__ import annotations

from typing import Any

import numpy as np

from sepi.compiled import njit, prange


@njit(inline="always")
def _deviations(sheared: Any, n: int, reference: int, y: int, out: Any) -> None:
    """Mean difference of the channels between a row of view ``n`` and that of the reference view, into ``out``."""
    red, green, blue = sheared[n, 0, y], sheared[n, 1, y], sheared[n, 2, y]
    own_red, own_green, own_blue = sheared[reference, 0, y], sheared[reference, 1, y], sheared[reference, 2, y]
    for x in range(len(out)):
        difference = abs(red[x] - own_red[x]) + abs(green[x] - own_green[x]) + abs(blue[x] - own_blue[x])
        out[x] = difference * np.float32(1 / 3)


@njit(cache=True, parallel=True)
def lower_thresholds(sheared: Any, reference: int, needed: int, thresholds: Any) -> None:
    """Lower each threshold to that by which ``needed`` views agree with the reference view, where it is less.

    Parameters
    ----------
    sheared : ndarray, shape (N, 3, H, W), float32
        The views sheared by one candidate.
    reference : int
        Number of the reference view, which has no vote.
    needed : int
        Views, 1..N-1.
    thresholds : ndarray, shape (H, W), float32
        Changed in place.
    """
    N, _, H, W = sheared.shape
    for y in prange(H):
        deviations = np.empty((N, W), np.float32)
        agreeing = np.zeros(W, np.int32)
        for n in range(N):
            if n == reference:
                deviations[n] = np.inf
                continue
            _deviations(sheared, n, reference, y, deviations[n])
            for x in range(W):
                agreeing[x] += deviations[n, x] < thresholds[y, x]
        for x in range(W):
            # few pixels: the thresholds soon are as low as most candidates leave them
            if agreeing[x] >= needed:
                thresholds[y, x] = np.partition(deviations[:, x].copy(), needed - 1)[needed - 1]


@njit(cache=True, parallel=True)
def vote_costs(sheared: Any, reference: int, thresholds: Any, out: Any) -> None:
    """What one candidate costs each pixel: ``1 - (V - M) / (N - 1)`` of :mod:`sepi.compared.oavc`.

    Parameters
    ----------
    sheared : ndarray, shape (N, 3, H, W), float32
        The views sheared by the candidate.
    reference : int
        Number of the reference view, which has no vote.
    thresholds : ndarray, shape (H, W), float32
        Positive.
    out : ndarray, shape (H, W), float32
    """
    N, _, H, W = sheared.shape
    for y in prange(H):
        deviations, total = np.empty(W, np.float32), np.zeros(W, np.float32)
        votes = np.zeros(W, np.float32)
        for n in range(N):
            if n == reference:
                continue
            _deviations(sheared, n, reference, y, deviations)
            for x in range(W):
                agrees = deviations[x] <= thresholds[y, x]
                votes[x] += np.float32(1) if agrees else np.float32(0)
                total[x] += deviations[x] if agrees else np.float32(0)
        for x in range(W):
            mean = total[x] / (max(votes[x], np.float32(1)) * thresholds[y, x])
            out[y, x] = np.float32(1) - (votes[x] - mean) / np.float32(N - 1)
