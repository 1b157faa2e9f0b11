"""How far compiled kernels may change arithmetic without changing results."""

EXACT = {"nnan", "ninf", "nsz"}
"""Fast-math flags that leave every rounding as written.

A kernel that was just compiled and the same one loaded from disk are optimised differently; where sums may be reordered
or fused, the first run after an installation would give other last digits than later ones.
"""
