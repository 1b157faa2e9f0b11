"""Calibrated cameras from files, their pictures and lenses, and checks that they suit a light field."""

import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from sepi.camera import Part, require_part
from sepi.camera.rig import Floats, Lens, Shot
from sepi.errors import SepiError
from sepi.io.images import picture_header

UNITS_OF_MODEL = "units of the model"

# largest distance of cameras at one place, relative to that of the farthest cameras
_SAME_PLACE = 1e-6
# largest angle between viewing directions of two cameras, degrees
_MOST_TURNED = 60
# least angle between motion and viewing direction, degrees
_LEAST_ANGLE = 45.0
# least share of the model's points in front of the cameras
_BEFORE = 0.5


class Picture(NamedTuple):
    """A picture of a calibrated camera.

    Attributes
    ----------
    shot : Shot
    file : Path
    mask : Path or None
        Picture that is black where the picture is not to be used.
    """

    shot: Shot
    file: Path
    mask: Path | None = None


class CameraModel:
    """Calibrated cameras, and their pictures.

    Parameters
    ----------
    path : Path
        File or folder of the model, for messages.
    pictures : tuple of Picture
    points : ndarray, shape (N, 3), float64, optional
        Points of the scene in the world; most files have none.
    units : str
        Unit of the world.

    Attributes
    ----------
    path, pictures, points, units
        As given.
    notes : tuple of str
        Assumptions that were made.
    files : tuple of Path
        All pictures and their masks.
    shots : tuple of Shot
        The cameras.
    centres, axes : ndarray, shape (N, 3), float64
        Their positions, and their viewing directions.
    """

    def __init__(
        self, path: Path, pictures: tuple[Picture, ...], points: Floats | None = None, units: str = UNITS_OF_MODEL
    ) -> None:
        self.path, self.pictures, self.units = path, pictures, units
        self.notes: tuple[str, ...] = ()
        self.points = np.zeros((0, 3)) if points is None else points
        masks = (picture.mask for picture in pictures if picture.mask is not None)
        self.files = (*(picture.file for picture in pictures), *masks)
        self.shots = tuple(picture.shot for picture in pictures)
        self.centres = np.array([shot.centre for shot in self.shots])
        self.axes = np.array([shot.rotation[2] for shot in self.shots])

    def without(self, names: tuple[str, ...]) -> "CameraModel":
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

    def of(self, kept: list[int]) -> "CameraModel":
        """The model with only these cameras."""
        model = CameraModel(self.path, tuple(self.pictures[n] for n in kept), self.points, self.units)
        model.notes = self.notes
        return model

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
        apart = np.linalg.norm(centres[:, None] - centres, axis=2)
        for one, other in np.argwhere(np.triu(apart <= _SAME_PLACE * extent, 1)).tolist():
            where = f"{self.path}: {names[one]} and {names[other]} were taken from one position"
            raise SepiError(f"{where}; leave one of them out (--exclude {names[other]})")
        turned = np.degrees(np.arccos(np.clip(axes @ axes.T, -1, 1)))
        one, other = divmod(int(turned.argmax()), len(turned))
        require_alike(self.path, names[one], names[other], turned[one, other])
        if len(self.points) and np.mean((self.points - centres.mean(axis=0)) @ axes.mean(axis=0) > 0) < _BEFORE:
            expected = "expected cameras that look along z, with y down (OpenCV), not against it with y up (OpenGL)"
            raise SepiError(f"{self.path}: the scene's points lie behind the cameras; {expected}")


def require_alike(where: Path, one: str, other: str, angle: float) -> None:
    """Raise if two cameras' viewing directions are by this many degrees too far apart."""
    if angle > _MOST_TURNED:
        raise SepiError(f"{where}: {one} and {other} look {angle:.0f} degrees apart; expected at most {_MOST_TURNED}")


def require_sideways(where: Path, angle: float, least: float = _LEAST_ANGLE) -> None:
    """Raise if the cameras move at less than so many degrees to their viewing direction."""
    if angle < least:
        ahead = f"the cameras move along their viewing direction (at {angle:.0f} degrees to it)"
        raise SepiError(f"{where}: {ahead}; expected them to move sideways, at {_LEAST_ANGLE:.0f} to 90 degrees")


# where COLMAP says it, and names of folders that it and others use
PROJECT = "project.ini"
"""COLMAP's file with the folder of the pictures."""

_FOLDERS = ("images", ".")
# how much larger or smaller, and how differently down and across, the picture is whose middle is the principal point,
# where that cannot be the picture at hand
_OTHER, _ALIKE = 1.4, 1.3


class Pictures:
    """Finds pictures by the names that a model has for them.

    Parameters
    ----------
    model : Path
        The model's file or folder.
    given : Path or None
        The user's folder; default: that in COLMAP's ``project.ini``, or ``images`` beside the model or above it, or the
        model's own.
    crop_of : (int, int, int, int), optional
        As for :func:`sepi.camera.camera_from`.
    """

    def __init__(self, model: Path, given: Path | None, crop_of: Part | None = None) -> None:
        self._model, self._crop = model, crop_of
        self._scaled = ""
        self._middles: list[list[float]] = []
        home = model if model.is_dir() else model.parent
        if given is not None and not given.is_dir():
            raise SepiError(f"{given}: no folder of pictures")
        self._places = [given] if given is not None else list(_around(home))

    def find(self, *names: str) -> Path:
        """The file of a picture, by the first of its names that exists.

        Raises
        ------
        SepiError
            If there is none.
        """
        tried = [Path(name.replace("\\", "/")) for name in names]
        within = [one for one in tried if not one.is_absolute() and ".." not in one.parts and str(one).isprintable()]
        for inside in within:
            for place in self._places:
                if (place / inside).is_file():
                    return place / inside
        if tried[0] not in within:
            raise SepiError(f"picture '{tried[0]}': expected a path within the folder of pictures")
        where = " nor ".join(map(str, self._places[:3]))
        raise SepiError(f"no picture '{names[0]}' in {where}; name the folder by --images")

    def size(self, file: Path) -> tuple[int, int]:
        """Width and height of a picture, or of the whole picture for a crop."""
        header = picture_header(file)
        return (header.width, header.height) if self._crop is None else self._crop[:2]

    def fitted(self, file: Path, lens: Lens, sized: bool) -> Lens:
        """The lens for a picture file, which may be a scaled or cropped version of the calibrated picture.

        Parameters
        ----------
        file : Path
        lens : Lens
            Lens in the model.
        sized : bool
            Whether the model has the size of the calibrated picture.

        Raises
        ------
        SepiError
            If the sizes do not fit.
        """
        header, whole, (x, y) = picture_header(file), self.size(file), lens.principal
        if not sized:
            self._middles.append([(2 * x + 1) / lens.width, (2 * y + 1) / lens.height])
        elif (lens.width, lens.height) != whole:
            self._scaled = f"lenses of {lens.width}x{lens.height} pixels scaled to pictures of {whole[0]}x{whole[1]}"
        lens, part = lens.scaled(*whole), self._crop or (*whole, 0, 0)
        require_part(part, (header.height, header.width))
        principal = lens.principal[0] - part[2], lens.principal[1] - part[3]
        return replace(lens, width=header.width, height=header.height, principal=principal)

    @property
    def notes(self) -> tuple[str, ...]:
        """Assumptions about the lenses.

        Raises
        ------
        SepiError
            If the lenses cannot belong to the pictures.
        """
        low, high = sorted(np.mean(self._middles or [[1.0, 1.0]], axis=0))
        if 0 < low <= high < _ALIKE * low and not 1 / _OTHER < low < _OTHER:
            told = f"the principal points are those of pictures about {low:.2g} times as large"
            expected = "expected w and h, the size of the calibrated pictures, or --crop-of if these are crops of them"
            raise SepiError(f"{self._model}: {told}; {expected}")
        return (f"{self._scaled}; if the pictures are crops, give --crop-of",) if self._scaled else ()


def mask_of(picture: Path, name: str) -> Path | None:
    """The mask of a picture, by its name in the model, where COLMAP expects it: in ``masks`` beside their folder."""
    mask = picture.parents[len(Path(name).parts) - 1].parent / "masks" / f"{name}.png"
    return mask if mask.is_file() else None


def _around(home: Path) -> Sequence[Path]:
    places = []
    for folder in (home, *list(home.resolve().parents)[:2]):
        project = folder / PROJECT
        if project.is_file() and project.stat().st_size < 2**20:
            told = re.search(r"^\s*image_path\s*=\s*(.+?)\s*$", project.read_text("utf-8", "replace"), re.MULTILINE)
            if told:
                places.append(folder / told[1])
        places += [folder / name for name in _FOLDERS]
    return [place for n, place in enumerate(places) if place.is_dir() and place not in places[:n]]
