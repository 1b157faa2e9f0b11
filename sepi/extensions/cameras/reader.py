"""Views of calibrated cameras, from a COLMAP model, a ``transforms.json``, or a table; rectified to a light field."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from sepi.camera import Part
from sepi.errors import SepiError
from sepi.extensions.cameras.model import CameraModel, Pictures
from sepi.io.files import name_of
from sepi.io.readers.formats import Format
from sepi.io.readers.options import AS_GIVEN, ReadOptions
from sepi.lightfield import DisparityRange, LightField

# distance of cameras from their plane, in view steps, beyond which rectification needs the depth of the scene
_FLAT = 1e-3


def read(path: Path, options: ReadOptions, inverse_depths: tuple[float, float] | None = None) -> LightField:
    """Rectified light field of calibrated cameras.

    Parameters
    ----------
    path : Path
    options : ReadOptions
        ``images``, ``reference``, ``exclude`` and ``view`` are used.
    inverse_depths : (float, float), optional
        Inverse depths of the farthest and the nearest surface; default: from the model's points.
    """
    from sepi.extensions.cameras.rectification import Rectification, light_field_of

    if options.order != AS_GIVEN or options.central is not None or options.row_spacing is not None:
        raise SepiError(f"{path}: --order, --central and --row-spacing do not apply: the cameras say where views stand")
    model = read_model(path, options.images, options.part).without(options.exclude)
    light_field = light_field_of(Rectification(model, options.reference, inverse_depths))
    return replace(light_field, name=name_of(path).name, source=str(path))


def with_depths(path: Path, light_field: LightField, options: ReadOptions, given: DisparityRange | None) -> LightField:
    """The light field rectified for depths estimated from its views, if its cameras have no points and no plane."""
    from sepi.inspection.disparity_range import estimate_range

    rig, camera = light_field.rig, light_field.camera
    assert rig is not None
    assert camera is not None
    centres = np.array([shot.centre for shot in rig.views.values()])
    if np.abs((centres - rig.origin) @ rig.rotation[2]).max() < _FLAT * rig.step:
        return light_field
    known = given or estimate_range(light_field)
    low, high = ((bound + camera.offset) / camera.scale for bound in (known.minimum, known.maximum))
    same = replace(options, reference=rig.views[light_field.reference_position].name)
    again = read(path, same, (max(low, 0.0), max(high, 1e-12)))
    return replace(again, disparity_range=None)


def files_of(path: Path, options: ReadOptions) -> tuple[Sequence[Path], Sequence[Path]]:
    """Files that are read, and pictures of the light field's size; the pictures may lie in another folder."""
    model = read_model(path, options.images, options.part)
    found = model.path
    described = sorted(path for path in found.iterdir() if path.stem in MODEL_FILES) if found.is_dir() else [found]
    return (*described, *model.files), [picture.file for picture in model.pictures]


FORMATS = {
    "cameras": Format(
        "calibrated cameras",
        "COLMAP model, transforms.json, cameras.csv or cameras.yaml",
        lambda path: cameras_in(path) is not None,
        read,
        ("images", "reference"),
        scales=False,
        files_of=files_of,
        with_depths=with_depths,
    )
}


def read_cameras(
    path: str | Path,
    *,
    images: str | Path | None = None,
    reference: str | None = None,
    exclude: tuple[str, ...] = (),
    disparity_range: tuple[float, float] | None = None,
) -> LightField:
    """A light field rectified from pictures of calibrated cameras.

    Parameters
    ----------
    path : str or Path
        COLMAP model (extra ``sepi[colmap]``), ``transforms.json``, or a table ``cameras.csv`` or ``cameras.yaml``; or
        a folder with one of them.
    images : str or Path, optional
        Folder of the pictures, if the model does not name it.
    reference : str, optional
        Name of the picture whose depth is estimated; default: that of the most central camera.
    exclude : tuple of str
        Names of pictures to leave out.
    disparity_range : tuple of float, optional
        ``(minimum, maximum)`` in pixels per view step.

    Returns
    -------
    LightField
        Views of float32, with positions, camera and ``rig``; its notes say how far the cameras stand off a plane.

    Raises
    ------
    SepiError
        If cameras or pictures are missing, or the cameras do not suit a light field.

    Examples
    --------
    >>> import json
    >>> from pathlib import Path
    >>> import cv2
    >>> import sepi
    >>> from sepi.scenes import render
    >>> views = render("pyramids", size=64, views=3).views
    >>> table = []
    >>> for t in range(3):
    ...     for s in range(3):
    ...         written = cv2.imwrite(f"{t}{s}.png", views[t, s, :, :, ::-1])
    ...         table.append({"file": f"{t}{s}.png", "position": [0.1 * s, 0.1 * t, 0.0], "focal": 80.0})
    >>> text = Path("cameras.yaml").write_text(json.dumps({"units": "metres", "cameras": table}))
    >>> light_field = sepi.read_cameras("cameras.yaml", disparity_range=(-1.5, 1.5))
    >>> light_field.grid, light_field.shape, light_field.rig.units
    ((3, 3), (64, 64), 'metres')
    """
    from sepi.reading import read_light_field

    options = ReadOptions(images=None if images is None else str(images), reference=reference, exclude=exclude)
    return read_light_field(path, disparity_range=disparity_range, file_format="cameras", options=options)


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
            inside = (path / name for name in (*TABLES, *TRANSFORMS))
            return next(filter(Path.is_file, inside), None) or model_in(path)
        named = path.name.startswith("transforms") and path.suffix.lower() == ".json"
        if path.is_file() and (named or path.suffix.lower() in TABLE_SUFFIXES):
            return path
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
    from sepi.extensions.cameras import files

    found = cameras_in(path)
    if found is None:
        expected = f"a COLMAP model (with points3D), {TRANSFORMS[0]}, or a table {', '.join(TABLES)}"
        raise SepiError(f"{path}: no calibrated cameras; expected {expected}")
    pictures = Pictures(found, None if images is None else Path(images).expanduser(), crop_of)
    read = files.read_transforms if found.suffix.lower() == ".json" else files.read_table
    model = (files.read_colmap if found.is_dir() else read)(found, pictures)
    model.notes = pictures.notes
    return model
