"""Where the views of a light field may stand, for tests of all that is computed from their baselines."""

from typing import Any

import numpy as np
import numpy.typing as npt

ROW_SPACING = 0.43
"""Of a light field whose rows are closer together than its columns."""

GEOMETRIES = ("grid", "closer rows", "off the grid")
"""What :func:`standing` knows."""


def standing(geometry: str, grid: tuple[int, int]) -> dict[str, Any]:
    """Fields of a light field of ``grid`` views that stand so."""
    if geometry == "grid":
        return {}
    return {"row_spacing": ROW_SPACING} if geometry == "closer rows" else {"positions": jittered(grid)}


def jittered(grid: tuple[int, int], reach: float = 0.2) -> npt.NDArray[np.float64]:
    """Positions (T, S, 2) up to ``reach`` steps off the grid along each axis."""
    on_grid = np.moveaxis(np.indices(grid).astype(np.float64), 0, 2)
    return on_grid + np.random.default_rng(9).uniform(-reach, reach, on_grid.shape)


def grid_baselines(grid: tuple[int, int]) -> npt.NDArray[np.float64]:
    """Baselines (T, S, 2) from the centre view of views on the grid."""
    return np.moveaxis(np.indices(grid).astype(np.float64), 0, 2) - np.array(grid) // 2
