"""The folder of refocused images, with an index of where each is focused.

docs/depth/refocusing.md describes them.
"""

from __future__ import annotations

import csv
import os
import re
from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from sepi.errors import SepiError
from sepi.io.files import atomic_path, filled_folder, remove_files
from sepi.io.images import write_png
from sepi.lightfield import FloatMap, full_scale

INDEX = "focus.csv"
"""Name of the index: a row for each image."""

COLUMNS = ("file", "disparity", "depth_m", "x", "y")
"""Columns of the index; a value is empty if it is unknown or does not apply."""

ALL_IN_FOCUS = "all_in_focus.png"

ANIMATION = "focus.webp"
"""Endless animation of the focal stack from the nearest to the farthest image and back."""

# of an image of the animation
_MILLISECONDS = 120
_QUALITY = 85

_MADE = re.compile(rf"focus_\d+\.png|{re.escape(ALL_IN_FOCUS)}|{re.escape(ANIMATION)}")


@dataclass(frozen=True)
class Focus:
    """Focus of an image.

    Attributes
    ----------
    disparity : float
        Pixels per view step.
    depth : float or None
        Metres, infinite at and beyond infinity; None if the camera is unknown.
    at : (int, int) or None
        Column and row ``(x, y)`` of the pixel whose surface is in focus, if the focus was chosen so.
    """

    disparity: float
    depth: float | None = None
    at: tuple[int, int] | None = None


def stack_names(count: int) -> list[str]:
    """Names of the images of a focal stack: ``focus_01.png`` and so on."""
    digits = max(2, len(str(count)))
    return [f"focus_{number:0{digits}}.png" for number in range(1, count + 1)]


def write_refocused(
    folder: Path,
    foci: Sequence[Focus],
    pictures: Iterable[FloatMap],
    sharp: FloatMap | None,
    dtype: npt.DTypeLike,
    *,
    animated: bool = False,
) -> tuple[str, ...]:
    """Write a focal stack, the image in focus everywhere, and their index.

    A new folder appears whole or not at all. In an existing folder, files that an earlier index names are replaced once
    all new files are written, or removed; other files stay. Equal content gives equal bytes.

    Parameters
    ----------
    folder : Path
        Made if missing.
    foci : sequence of Focus
        Focus of each image of the stack.
    pictures : iterable of ndarray, shape (H, W, C), float32
        Images in 0..1, consumed one by one.
    sharp : ndarray, shape (H, W, C), float32, or None
        The image in focus everywhere.
    dtype : dtype
        That of the views: uint8 gives images of 8 bit, all others of 16 bit.
    animated : bool
        Also write the stack as an animation.

    Returns
    -------
    tuple of str
        Names of the files written.

    Raises
    ------
    SepiError
        If the folder is a file, cannot be written or holds other files of these names, or the installed Pillow cannot
        write animations.
    """
    before = _earlier_files(folder / INDEX)
    names = stack_names(len(foci))
    made = [*[ALL_IN_FOCUS] * (sharp is not None), *names, *[ANIMATION] * animated, INDEX]
    others = [name for name in made if name not in before and os.path.lexists(folder / name)]
    if others:
        raise SepiError(f"{folder}: {others[0]} there was not written by 'sepi refocus'; choose another folder")
    with filled_folder(folder) as temporary:
        if sharp is not None:
            write_png(temporary / ALL_IN_FOCUS, _levels(sharp, dtype))
        frames = []
        for name, picture in zip(names, pictures, strict=True):
            write_png(temporary / name, _levels(picture, dtype))
            if animated:
                frames.append(_levels(picture, np.uint8))
        if animated:
            _write_animation(temporary / ANIMATION, frames)
        told = dict(zip(names, map(_described, foci), strict=True))
        rows = [[name, *told.get(name, [""] * 4)] for name in made[:-1]]
        with (temporary / INDEX).open("w", encoding="ascii", newline="") as file:
            csv.writer(file, lineterminator="\n").writerows([COLUMNS, *rows])
    remove_files(folder, set(before).difference(made))
    return tuple(made)


def _levels(picture: FloatMap, dtype: npt.DTypeLike) -> npt.NDArray[Any]:
    """Levels of an image (H, W, C) in 0..1 for a PNG: (H, W) if grey; 8 bit for uint8, else 16 bit."""
    held = np.uint8 if np.dtype(dtype) == np.uint8 else np.uint16
    levels = np.rint(picture.astype(np.float64) * full_scale(held)).astype(held)
    return levels[..., 0] if levels.shape[2] == 1 else levels


def _described(focus: Focus) -> list[str]:
    x, y = ("", "") if focus.at is None else focus.at
    depth = "" if focus.depth is None else f"{focus.depth:.6g}"
    return [f"{focus.disparity:.6g}", depth, f"{x}", f"{y}"]


def _write_animation(path: Path, frames: Sequence[npt.NDArray[Any]]) -> None:
    from PIL import Image, features

    if not features.check("webp"):
        raise SepiError(f"{path}: the installed Pillow has no WebP, which animations need")
    first, *more = (Image.fromarray(frame).convert("RGB") for frame in [*frames, *frames[-2:0:-1]])
    with atomic_path(path) as temporary:
        first.save(
            temporary, "WEBP", save_all=True, append_images=more, duration=_MILLISECONDS, loop=0, quality=_QUALITY
        )


def _earlier_files(index: Path) -> list[str]:
    """Names of an earlier index and of the images in it; empty if there is none."""
    # a user's own file of this name stays, whatever it holds
    with suppress(OSError, UnicodeDecodeError, csv.Error):
        with index.open(encoding="ascii", newline="") as file:
            rows = list(csv.reader(file))
        if rows and tuple(rows[0]) == COLUMNS:
            return [INDEX, *(row[0] for row in rows[1:] if row and _MADE.fullmatch(row[0]))]
    return []
