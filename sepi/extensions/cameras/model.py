"""Model of calibrated cameras from files, and checks that they suit a light field."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import combinations
from pathlib import Path

import numpy as np

from sepi.camera.rig import Floats, Shot
from sepi.errors import SepiError

UNITS_OF_MODEL = "units of the model"

# largest distance of cameras at one place, relative to that of the farthest cameras
_SAME_PLACE = 1e-6
# largest angle between viewing directions of two cameras, degrees
_MOST_TURNED = 60.0
# least share of the model's points in front of the cameras
_BEFORE = 0.5


@dataclass(frozen=True)
class CameraModel:
    """Calibrated cameras, and their pictures.

    Attributes
    ----------
    path : Path
        File or folder of the model, for messages.
    shots : tuple of Shot
    pictures : tuple of Path
        Picture of each shot.
    points : ndarray, shape (N, 3), float64
        Points of the scene in the world; most files have none.
    units : str
        Unit of the world.
    masks : tuple of Path or None
        Pictures that are black where a picture is not to be used, None for a picture without one; empty: no masks.
    notes : tuple of str
        Assumptions that were made.
    """

    path: Path
    shots: tuple[Shot, ...]
    pictures: tuple[Path, ...]
    points: Floats
    units: str = UNITS_OF_MODEL
    masks: tuple[Path | None, ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def files(self) -> tuple[Path, ...]:
        """All pictures and their masks."""
        return (*self.pictures, *(mask for mask in self.masks if mask is not None))

    @property
    def centres(self) -> Floats:
        """Positions of the cameras, (N, 3)."""
        return np.array([shot.centre for shot in self.shots])

    @property
    def axes(self) -> Floats:
        """Viewing directions of the cameras, (N, 3)."""
        return np.array([shot.rotation[2] for shot in self.shots])

    def without(self, names: tuple[str, ...]) -> CameraModel:
        """The model without these pictures, named with or without folders."""
        left_out = {n for name in names for n in self.named(name)}
        return self.of([n for n in range(len(self.shots)) if n not in left_out])

    def named(self, name: str) -> list[int]:
        """Numbers of the pictures with this file name, with or without folders; an error without any."""
        found = [n for n, shot in enumerate(self.shots) if name in (shot.name, Path(shot.name).name)]
        if not found:
            some = ", ".join(shot.name for shot in self.shots[:3])
            raise SepiError(f"{self.path}: no picture '{name}' (found: {some}, ...)")
        return found

    def of(self, kept: list[int]) -> CameraModel:
        """The model with only these cameras."""
        shots, pictures = tuple(self.shots[n] for n in kept), tuple(self.pictures[n] for n in kept)
        return replace(self, shots=shots, pictures=pictures, masks=tuple(self.masks[n] for n in kept if self.masks))

    def require_sound(self) -> None:
        """Raise for cameras whose poses do not suit a light field.

        Raises
        ------
        SepiError
            If there are fewer than two, two stand at one place, look at each other, or have the scene behind them.
        """
        if len(self.shots) < 2:
            raise SepiError(f"{self.path}: depth needs at least two cameras, got {len(self.shots)}")
        names = [shot.name for shot in self.shots]
        centres, axes = self.centres, self.axes
        extent = float(np.linalg.norm(np.ptp(centres, axis=0)))
        for one, other in combinations(range(len(names)), 2):
            if np.linalg.norm(centres[one] - centres[other]) <= _SAME_PLACE * extent:
                raise SepiError(
                    f"{self.path}: {names[one]} and {names[other]} were taken from one position; leave one of them out "
                    f"(--exclude {names[other]})"
                )
        turned = np.degrees(np.arccos(np.clip(axes @ axes.T, -1, 1)))
        one, other = divmod(int(turned.argmax()), len(turned))
        if turned[one, other] > _MOST_TURNED:
            raise SepiError(
                f"{self.path}: {names[one]} and {names[other]} look {turned[one, other]:.0f} degrees apart; expected "
                f"similar viewing directions, at most {_MOST_TURNED:.0f} degrees apart"
            )
        if len(self.points) and np.mean((self.points - centres.mean(axis=0)) @ axes.mean(axis=0) > 0) < _BEFORE:
            raise SepiError(
                f"{self.path}: the scene's points lie behind the cameras; expected poses of cameras that look along "
                "their z axis, with y down (OpenCV), not against it with y up (OpenGL)"
            )
