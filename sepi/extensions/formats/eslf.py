"""Decoded lenslet images of the Stanford Lytro Light Field Archive, ``NAME_eslf.png``.

Under each lenslet lies a block of pixels, one of each sub-aperture image: the pixels ``(t, s)`` of all blocks are the
view ``(t, s)``. Views near the corners of the grid are dark.

References
----------
.. [1] A. Raj, M. Lowney, R. Shah, G. Wetzstein, "Stanford Lytro Light Field Archive", 2016.
       http://lightfields.stanford.edu/LF2016.html
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from sepi.errors import SepiError
from sepi.io.images import SUFFIXES, read_picture
from sepi.io.readers.arrays import light_field_from_array
from sepi.io.readers.formats import Format
from sepi.io.readers.options import ReadOptions
from sepi.io.readers.view_files import MAX_VIEWS
from sepi.lightfield import MIN_SIZE, LightField

BLOCK = (14, 14)
"""Rows and columns of pixels under a lenslet in images of the archive."""

_CENTRAL = 9
_DARK = 0.2


def matches(path: Path) -> bool:
    """Whether ``path`` is an image with ``eslf`` in its name."""
    return "eslf" in path.name.lower() and path.suffix.lower() in SUFFIXES and path.is_file()


def read(path: Path, options: ReadOptions) -> LightField:
    """Read the views of a lenslet image; by default the middle 9x9 of them.

    Parameters
    ----------
    path : Path
        Image of any supported kind.
    options : ReadOptions
        ``grid`` is the size of the block under a lenslet.
    """
    T, S = grid = options.grid or BLOCK
    if not 2 <= T * S <= MAX_VIEWS:
        raise SepiError(f"{path}: --grid {T}x{S}: expected a grid of 2 to {MAX_VIEWS} views")
    # default: 9 views a side or, in a smaller grid, the largest odd number
    usual = (min(_CENTRAL, T, S) + 1) // 2 * 2 - 1
    central = options.central or (usual if usual > 1 else None)
    picture = read_picture(path, any_floats=options.white is not None)
    height, width = picture.shape[0] // T, picture.shape[1] // S
    if min(height, width) < MIN_SIZE:
        raise SepiError(f"{path}: {T}x{S} views under each lenslet make views of {width}x{height} pixels; too small")
    notes = []
    if options.central is None and central is not None and (central, central) != grid:
        notes.append(f"the {central}x{central} views in the middle of {T}x{S}; --central N takes another odd number")
    cropped = picture.shape[0] - height * T, picture.shape[1] - width * S
    if any(cropped):
        notes.append(f"{cropped[0]} pixel rows and {cropped[1]} columns beyond the last whole lenslet were left out")
    blocks = picture[: height * T, : width * S].reshape(height, T, width, S, -1)
    light_field = light_field_from_array(blocks, path, replace(options, grid=None, central=central), axes="HTWSC")
    return replace(light_field, notes=(*notes, *light_field.notes, *_dark_notes(light_field)))


def _dark_notes(light_field: LightField) -> list[str]:
    """Notes on the views that are much darker than the reference view."""
    brightness = light_field.views.mean(axis=(2, 3, 4), dtype=np.float64)
    limit = _DARK * brightness[light_field.reference_position]
    dark = np.argwhere(light_field.present & (brightness < limit)).tolist()
    if not dark:
        return []
    flags = " ".join(f"--exclude {t},{s}" for t, s in dark)
    views = "1 view is" if len(dark) == 1 else f"{len(dark)} views are"
    return [f"{views} darker than a fifth of the reference view; to leave out: {flags}"]


FORMATS = {"eslf": Format("Lytro lenslet image", "NAME_eslf.png", matches, read, ("grid",))}
