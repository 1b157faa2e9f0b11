"""Cameras of a path-traced scene, and their conversion of depth to disparity.

Cameras stand on a grid with spacing ``b``, sheared so that points at the focus distance ``F`` have disparity zero, as
in the HCI 4D benchmark. With the focal length ``f`` in pixels, depth ``Z`` has disparity ``d = b f (1 / Z - 1 / F)``.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from sepi.camera import Camera, camera_from
from sepi.extensions.rendered.world import World

SENSOR_MM = 35.0


@dataclass(frozen=True)
class Rig:
    """Cameras of a scene.

    Attributes
    ----------
    size : int
        Height and width of a view in pixels.
    grid : (int, int)
        Rows and columns of views.
    focal_px : float
        Focal length in pixels.
    baseline : float
        Metres from one view to the next.
    focus : float
        Focus distance, metres.
    """

    size: int
    grid: tuple[int, int]
    focal_px: float
    baseline: float
    focus: float

    @property
    def camera(self) -> Camera:
        """Camera of the light field."""
        return camera_from(**self.settings, shape=(self.size, self.size), crop_of=None)

    @property
    def settings(self) -> dict[str, float]:
        """Values for the benchmark's ``parameters.cfg``."""
        return {
            "focal_length_mm": self.focal_px / self.size * SENSOR_MM,
            "baseline_mm": 1000 * self.baseline,
            "focus_distance_m": self.focus,
            "sensor_size_mm": SENSOR_MM,
        }

    @property
    def positions(self) -> npt.NDArray[np.float64]:
        """Positions of the views from the centre view, ``(down, across)`` in view steps; shape (T, S, 2)."""
        rows, columns = self.grid
        down, across = np.arange(rows) - rows // 2, np.arange(columns) - columns // 2
        return np.stack(np.broadcast_arrays(down[:, None], across[None, :]), axis=-1).astype(np.float64)

    def disparity(self, depth: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
        """Disparity in pixels per view step of depths along the viewing direction in metres."""
        return self.baseline * self.focal_px * (1 / depth - 1 / self.focus)


def rig_of(world: World, size: int, grid: tuple[int, int], baseline: float = 1.0) -> Rig:
    """The cameras for which a scene's near and far depths have its disparities, times ``baseline``."""
    focal = size / (2 * np.tan(np.radians(world.field_of_view) / 2))
    step = (world.at_near - world.at_far) / (focal * (1 / world.near - 1 / world.far))
    focus = 1 / (1 / world.near - world.at_near / (step * focal))
    return Rig(size, grid, float(focal), float(baseline * step), float(focus))
