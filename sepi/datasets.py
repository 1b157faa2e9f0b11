"""The scenes that the workflow runs on: the built-in ones and those found in a folder of light fields."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from sepi.errors import SepiError
from sepi.io.images import png_size

VIEW_PATTERN = "input_Cam*.png"
# what a scene's folder may hold besides views, and ingest reads
_OTHER_PATTERNS = ("parameters.cfg", "gt_disp_lowres.pfm", "*mask*.png")
# a scene's name is a folder name below results/ and a word on the command line
_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.+-]*")
# root/scene, root/category/scene, and a level more
_DEPTH = 3


@dataclass(frozen=True)
class Scene:
    """One light field of the workflow.

    Attributes
    ----------
    dataset, name : str
        Together they name the scene's folder ``results/DATASET/NAME``.
    folder : Path or None
        Where its pictures are; None for a built-in scene.
    files : tuple of Path
        What ingest reads: a change in one of them is a change of the scene.
    views : int
        Number of views.
    height, width : int
        Size of a view in pixels.
    disparity_range : tuple of float or None
        Range the user set, pixels per view step; None: the scene's own or an estimate.
    """

    dataset: str
    name: str
    folder: Path | None
    files: tuple[Path, ...]
    views: int
    height: int
    width: int
    disparity_range: tuple[float, float] | None = None

    @property
    def samples(self) -> int:
        """Number of pixels of all views together."""
        return self.views * self.height * self.width


def scenes_in(root: Path, dataset: str, where: str) -> list[Scene]:
    """Every light field below a folder, by name.

    A scene is a folder with ``input_Cam*.png``; ``root`` may be one itself, or hold scenes or categories of scenes.

    Parameters
    ----------
    root : Path
        Folder to look in.
    dataset : str
        Name of the dataset that the scenes belong to.
    where : str
        The key that named ``root``, for messages.

    Raises
    ------
    SepiError
        If there is no such folder, no scene in it, two scenes of one name, or a name that is no plain word.
    """
    if not root.is_dir():
        raise SepiError(f"{where}: no folder '{root}'")
    scenes = [_scene_of(folder, dataset) for folder in _scene_folders(root.resolve(), _DEPTH)]
    if not scenes:
        raise SepiError(f"{where}: no scene in '{root}' (expected folders with {VIEW_PATTERN})")
    for name, count in Counter(scene.name for scene in scenes).items():
        if count > 1:
            both = " and ".join(str(scene.folder) for scene in scenes if scene.name == name)
            raise SepiError(f"{where}: two scenes are called '{name}': {both}")
        if not _NAME.fullmatch(name):
            raise SepiError(f"{where}: a scene's folder must be named with letters, digits and _ . + - only: '{name}'")
    return sorted(scenes, key=lambda scene: scene.name)


def _scene_folders(folder: Path, depth: int) -> Iterator[Path]:
    if any(folder.glob(VIEW_PATTERN)):
        yield folder
    elif depth:
        for inner in sorted(folder.iterdir()):
            if inner.is_dir() and not inner.name.startswith("."):
                yield from _scene_folders(inner, depth - 1)


def _scene_of(folder: Path, dataset: str) -> Scene:
    views = sorted(folder.glob(VIEW_PATTERN))
    others = sorted({path for pattern in _OTHER_PATTERNS for path in folder.glob(pattern)})
    height, width = _size_of(views[0])
    return Scene(dataset, folder.name, folder, (*views, *others), len(views), height, width)


def _size_of(view: Path) -> tuple[int, int]:
    """Height and width of a view; the benchmark's 512x512 where it is damaged, which ingest will say."""
    try:
        return png_size(view)
    except SepiError:
        return 512, 512
