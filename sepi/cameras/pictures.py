"""Where the pictures of calibrated cameras are."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

from sepi.errors import SepiError

# where COLMAP says it, and names of folders that it and others use
PROJECT = "project.ini"
"""File of COLMAP that says where the pictures are."""

_FOLDERS = ("images", ".")


class Pictures:
    """Finds pictures by the names that a model has for them.

    Parameters
    ----------
    model : Path
        The model's file or folder.
    given : Path or None
        The folder that the user names; else it is the one that COLMAP's ``project.ini`` names, or ``images`` beside the
        model or above it, or the model's own.
    """

    def __init__(self, model: Path, given: Path | None) -> None:
        self._model = model
        home = model if model.is_dir() else model.parent
        if given is not None and not given.is_dir():
            raise SepiError(f"{given}: no folder of pictures")
        self._places = [given] if given is not None else list(_around(home))

    def find(self, name: str) -> Path:
        """The file of a picture.

        Raises
        ------
        SepiError
            If there is none.
        """
        inside = Path(name.replace("\\", "/"))
        if inside.is_absolute() or ".." in inside.parts or not name.isprintable():
            raise SepiError(f"{self._model}: picture '{inside}': expected a path within the folder of pictures")
        for place in self._places:
            if (place / inside).is_file():
                return place / inside
        where = " nor ".join(map(str, self._places[:3]))
        raise SepiError(f"{self._model}: no picture '{name}' in {where}; --images names the folder of the pictures")


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
