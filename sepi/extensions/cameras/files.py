"""Files of calibrated cameras: recognition of their kind, and reading."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from sepi.camera import Part
    from sepi.extensions.cameras.model import CameraModel

TABLES = ("cameras.csv", "cameras.yaml", "cameras.yml")
"""Names of tables in a folder."""

TRANSFORMS = tuple(f"transforms{part}.json" for part in ("", "_train", "_val", "_test"))
"""Names of files of nerfstudio and NeRF in a folder; the first existing one has the cameras."""

TABLE_SUFFIXES = tuple(Path(name).suffix for name in TABLES)

# folders of a model below a folder, by COLMAP and others
_INSIDE = (".", "sparse/0", "sparse", "colmap/sparse/0", "0")
_FILES = ("cameras", "images", "points3D")
MODEL_FILES = (*_FILES, "rigs", "frames")
"""Names of a model's files without their ending; only newer versions have the last two."""


def cameras_in(path: Path) -> Path | None:
    """The file or folder of cameras at ``path``; None without one. Quick, and never raises."""
    try:
        if path.is_dir():
            for name in (*TABLES, *TRANSFORMS):
                if (path / name).is_file():
                    return path / name
            return model_in(path)
        if path.is_file() and (path.suffix.lower() in TABLE_SUFFIXES or path.name.startswith("transforms")):
            return path if path.suffix.lower() in (*TABLE_SUFFIXES, ".json") else None
        # a file of a COLMAP model
        return model_in(path.parent) if path.is_file() and path.stem in ("cameras", "images") else None
    except OSError:
        return None


def model_in(folder: Path) -> Path | None:
    """The folder of a COLMAP model in a folder, if there is one."""
    for inside in _INSIDE:
        place = folder / inside
        if any(all((place / f"{name}{end}").is_file() for name in _FILES) for end in (".bin", ".txt")):
            return place
    return None


def described_by(found: Path) -> tuple[Path, ...]:
    """The files of the cameras that :func:`cameras_in` found."""
    return tuple(sorted(path for path in found.iterdir() if path.stem in MODEL_FILES)) if found.is_dir() else (found,)


def read_model(path: Path, images: str | None = None, crop_of: Part | None = None) -> CameraModel:
    """Calibrated cameras of any known format.

    Parameters
    ----------
    path : Path
        File or folder.
    images : str, optional
        Folder of the pictures.
    crop_of : (int, int, int, int), optional
        Whole picture for crops, as in :func:`sepi.camera.camera_from`.

    Raises
    ------
    SepiError
        If there are none, the file is damaged, or pictures are missing.
    """
    # called for every path, so readers are imported when needed
    from sepi.errors import SepiError
    from sepi.extensions.cameras.pictures import Pictures

    found = cameras_in(path)
    if found is None:
        raise SepiError(
            f"{path}: no calibrated cameras; expected a COLMAP model (cameras, images and points3D, .txt or .bin), "
            f"{TRANSFORMS[0]}, or a table {', '.join(TABLES)}"
        )
    pictures = Pictures(found, None if images is None else Path(images).expanduser(), crop_of)
    if found.is_dir():
        from sepi.extensions.cameras.colmap_model import read_colmap as read
    elif found.suffix.lower() == ".json":
        from sepi.extensions.cameras.transforms import read_transforms as read
    else:
        from sepi.extensions.cameras.table import read_table as read
    return replace(read(found, pictures), notes=pictures.notes)
