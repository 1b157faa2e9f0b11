"""Pictures of calibrated cameras, and their lenses for pictures of another size."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from sepi.camera import Part, require_part
from sepi.camera.rig import Lens
from sepi.errors import SepiError
from sepi.io.images import picture_header

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
            raise SepiError(f"{self._model}: picture '{tried[0]}': expected a path within the folder of pictures")
        where = " nor ".join(map(str, self._places[:3]))
        raise SepiError(f"{self._model}: no picture '{names[0]}' in {where}; name the folder by --images")

    def size(self, file: Path) -> tuple[int, int]:
        """Width and height of a picture, or of the whole picture for a crop."""
        header = picture_header(file)
        return (header.width, header.height) if self._crop is None else self._crop[:2]

    def fitted(self, file: Path, lens: Lens, size: tuple[float, float] | None) -> Lens:
        """The lens for a picture file, which may be a scaled or cropped version of the calibrated picture.

        Parameters
        ----------
        file : Path
        lens : Lens
            Lens in the model.
        size : (float, float) or None
            Width and height of the calibrated picture, if the model has them.

        Raises
        ------
        SepiError
            If the sizes do not fit.
        """
        header, whole, told = picture_header(file), self.size(file), (lens.width, lens.height)
        if size is None:
            self._middles.append([(2 * at + 1) / side for at, side in zip(lens.principal, told, strict=True)])
        elif told != whole:
            self._scaled = f"lenses of {told[0]}x{told[1]} pixels scaled to pictures of {whole[0]}x{whole[1]}"
        lens = lens.scaled(*whole)
        part = self._crop or (*whole, 0, 0)
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
            raise SepiError(
                f"{self._model}: the principal points are those of pictures about {low:.2g} times as large; expected "
                "w and h, the size of the calibrated pictures, or --crop-of if these pictures are crops of them"
            )
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
