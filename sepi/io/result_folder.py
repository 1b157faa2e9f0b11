"""The folder of a result: numbers for programs, images and points for people.

docs/reference/outputs.md describes the files.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from types import NoneType
from typing import Any

import h5py
import numpy as np
import numpy.typing as npt

from sepi.camera import Camera, warn_of_infinity
from sepi.camera.rig import Rig
from sepi.errors import SepiError
from sepi.io import hdf5, map_pictures
from sepi.io.disparity_maps import write_pfm
from sepi.io.files import atomic_folder, remove_files, write_whole
from sepi.io.images import write_png
from sepi.io.point_cloud import point_cloud, write_ply
from sepi.io.provenance import DIGEST, RESULT, result_attributes
from sepi.io.result_files import (
    ALL_VIEWS,
    RESULT_FILES,
    RUNTIME,
    UNKNOWN,
    names_as_taken,
    require_own,
    sound_maps,
)
from sepi.lightfield import BoolMap, FloatMap, LightField, require_light_field
from sepi.process.threads import available_cores
from sepi.stage import ERROR_BARS, HIGH, LOW, SIGMA, StageMaps
from sepi.validation import described, is_finite, require_path, require_type

_Attributes = Mapping[str, hdf5.Attribute]
_Names = tuple[str, ...]
_View = tuple[int, int]

EXTENDED = "extended"
"""Dataset that only a file of maps of all views has: pixels that no map shows."""

_MASK_TEXT = {"Software": "sepi", "Description": "mask: 255 inside, 0 outside"}


@dataclass(frozen=True)
class Result:
    """Maps of one view as ``result.h5`` holds them.

    Attributes
    ----------
    scene : str
        Name of the scene.
    picture : ndarray, shape (H, W, C), uint8, uint16 or float32
        The view.
    disparity, confidence : ndarray, shape (H, W), float32
        Pixels per view step; 0..1.
    unknown : ndarray, shape (H, W), bool
        Pixels for whose depth no view has evidence; all False if the result does not record them.
    camera : Camera or None
        None if unknown.
    from_centre : (float, float)
        Baseline (down, across) from the grid's centre view to the view, in view steps.
    rig : Rig or None
        Pose of the view in the world, at the rig's origin, if the cameras were calibrated.
    sigma : ndarray, shape (H, W), float32, or None
        Standard deviation of the disparity, pixels per view step; None without error bars.
    low, high : ndarray, shape (H, W), float32, or None
        Bounds of the interval that holds the disparity with a probability of 90 %.

    Examples
    --------
    >>> from pathlib import Path
    >>> import sepi
    >>> from sepi.io.result_folder import Result
    >>> from sepi.scenes import render
    >>> light_field = render("dots", size=64, views=3)
    >>> files = sepi.write_result("dots-depth", light_field, sepi.estimate_depth(light_field))
    >>> result = sepi.read_result("dots-depth")
    >>> isinstance(result, Result), result.scene, result.picture.shape, result.camera
    (True, 'dots', (64, 64, 3), None)
    """

    scene: str
    picture: npt.NDArray[np.generic]
    disparity: FloatMap
    confidence: FloatMap
    unknown: BoolMap
    camera: Camera | None
    from_centre: tuple[float, float]
    rig: Rig | None = None
    sigma: FloatMap | None = None
    low: FloatMap | None = None
    high: FloatMap | None = None


def write_result(
    folder: str | Path,
    light_field: LightField,
    maps: StageMaps,
    attributes: Mapping[str, hdf5.Attribute] | None = None,
    *,
    force: bool = False,
    seconds: float | None = None,
    beside: tuple[str, ...] = (),
) -> tuple[str, ...]:
    """Write the maps of a light field, as ``sepi depth`` does.

    The files are:

    - ``disparity.pfm``, ``disparity.npy`` and ``disparity_16bit.png``: disparity as numbers;
    - ``disparity.png``: in colours from far (dark blue) to near (yellow), grey where the mask ``unknown`` is set;
    - ``confidence.png``, from black (0) to white (1), and ``mask_NAME.png`` for each boolean map;
    - ``points.ply``, without unknown pixels;
    - ``sigma.pfm``, ``sigma.png`` and ``interval.npz`` if the maps have error bars;
    - ``depth.pfm`` and ``depth_sigma.pfm`` in metres if the light field has a camera;
    - ``original_disparity.pfm``, ``original_depth.pfm`` and ``original_sigma.pfm``, at the pixels of the image as a
      calibrated camera took it;
    - ``result.h5``: all maps, the view, the camera, what made the maps, and their light field.

    docs/reference/outputs.md describes them. Equal content gives equal bytes. A new folder appears whole or not at all.
    In an existing folder, files are replaced once all are written, and other files of an earlier result are removed.

    Parameters
    ----------
    folder : str or Path
        Made if missing.
    light_field : LightField
        The light field of the maps.
    maps : StageMaps
        Of the light field's shape.
    attributes : mapping, optional
        More attributes for ``result.h5``; they override those written by default.
    force : bool
        Also write into a folder that holds other files or the result of another light field. Files with the names of
        the result's files are replaced, others stay.
    seconds : float, optional
        Run time, for ``runtime.txt``.
    beside : tuple of str
        Names of further files of the result that the caller writes.

    Returns
    -------
    tuple of str
        Names of the files written.

    Raises
    ------
    SepiError
        If the maps are not valid (:func:`sepi.io.result_files.sound_maps`), or the folder is a file, holds the views of
        a light field, other files or another light field's result, or cannot be written.

    Examples
    --------
    >>> import numpy as np
    >>> import sepi
    >>> from sepi.scenes import render
    >>> light_field = render("dots", size=64, views=3)
    >>> maps = sepi.estimate_depth(light_field)
    >>> for name in sepi.write_result("dots-depth", light_field, maps, {"made_by": "a test"}):
    ...     print(name)
    disparity.pfm
    disparity.npy
    disparity_16bit.png
    disparity.png
    confidence.png
    points.ply
    interval.npz
    mask_occluded.png
    mask_textureless.png
    mask_unknown.png
    sigma.pfm
    sigma.png
    result.h5
    >>> bool((np.load("dots-depth/disparity.npy") == maps.disparity).all())
    True
    """
    require_light_field(light_field)
    require_type(f"{light_field.name}: maps", maps, StageMaps, "StageMaps")
    folder = require_path("folder of the result", folder)
    require_type(f"{folder}: attributes", attributes, (Mapping, NoneType), "names with values")
    if not (seconds is None or is_finite(seconds)):
        raise SepiError(f"{folder}: seconds: expected a number, got {described(seconds)}")
    maps = sound_maps(light_field, maps)
    if light_field.camera is not None:
        warn_of_infinity(folder, light_field.camera, maps.disparity, maps.sigma, maps.mask(UNKNOWN))
    earlier = require_own(folder, light_field, force=force)
    with atomic_folder(folder, add=True) as temporary:
        names = _write_files(temporary, light_field, maps, attributes or {}, seconds, beside)
    remove_files(folder, earlier.difference(names))
    return names


def read_result(path: str | Path, view: _View | None = None) -> Result:
    """Read the maps of one view of a result.

    Parameters
    ----------
    path : str or Path
        Folder written by :func:`write_result`, its ``result.h5``, or a file of maps of all views.
    view : (int, int), optional
        Row and column in the grid; default: the result's own view. In other views, pixels that no map shows and pixels
        of confidence 0 are unknown.

    Returns
    -------
    Result

    Raises
    ------
    SepiError
        If there is no map of this view, or the result is missing or damaged.

    Examples
    --------
    >>> import sepi
    >>> from sepi.scenes import render
    >>> light_field = render("dots", size=64, views=3)
    >>> maps = sepi.estimate_depth(light_field)
    >>> files = sepi.write_result("dots-depth", light_field, maps)
    >>> result = sepi.read_result("dots-depth")
    >>> bool((result.disparity == maps.disparity).all()), int(result.unknown.sum())
    (True, 0)
    >>> bool((result.low <= result.disparity).all()), bool((result.sigma == maps.sigma).all())
    (True, True)
    """
    path = require_path("result", path)
    path = all_views_file(path, view) or (path / RESULT if path.is_dir() else path)
    with hdf5.open_hdf5(path, "result of 'sepi depth'") as file:
        own = tuple(map(int, hdf5.attribute(file, "view_position")))
        place = place_in(path, file, view)
        if place is ... and view not in (None, own):
            alone = f"holds the map of view {own[0]},{own[1]} alone"
            raise SepiError(f"{path}: {alone}; 'sepi depth --all-views' makes those of all")
        maps = hdf5.float_maps(path, file, place)
        if missing := {"disparity", "confidence"}.difference(maps):
            raise SepiError(f"damaged result of 'sepi depth': it has no {' and no '.join(sorted(missing))}")
        picture = hdf5.read_dataset(path, file["view" if place is ... else "picture"], place)
        names = ("scene", "camera", "from_centre", hdf5.RIG)
        known = {name: hdf5.attribute(file, name) for name in names if name in file.attrs}
        centre, rig = known["from_centre"], Rig.from_text(str(known[hdf5.RIG])) if hdf5.RIG in known else None
        if place is ...:
            unknown = (
                hdf5.read_dataset(path, file[UNKNOWN]) > 0 if UNKNOWN in file else np.zeros(picture.shape[:2], bool)
            )
        else:
            unknown = (hdf5.read_dataset(path, file[EXTENDED], place) > 0) | (maps["confidence"] == 0)
            baseline = hdf5.read_dataset(path, file["baselines"])[place]
            centre, rig = centre + baseline, rig and rig.seen_from(baseline)
        camera = Camera(*map(float, known["camera"])) if "camera" in known else None
        down, across = map(float, centre)
    shapes = {name: values.shape for name, values in (*maps.items(), (UNKNOWN, unknown))}
    if set(shapes.values()) != {picture.shape[:2]} or picture.shape[2:] not in ((1,), (3,)):
        raise SepiError(f"{path}: damaged: view {picture.shape} and maps {shapes} do not fit together")
    scene = str(known.get("scene", ""))
    return Result(scene, picture, **maps, unknown=unknown, camera=camera, from_centre=(down, across), rig=rig)


def all_views_file(path: Path, view: _View | None) -> Path | None:
    """The file of maps of all views; None: the map of a result's own view, or of another program."""
    path = path / ALL_VIEWS if path.is_dir() and view is not None else path
    # reading reports a damaged file
    return path if hdf5.has_dataset(path, EXTENDED, if_damaged=True) else None


def place_in(path: Path, file: h5py.File, view: _View | None) -> Any:
    """Index of a view, by default the reference view, in a file of maps of all views; in other files that of all."""
    if EXTENDED not in file:
        return ...
    t, s = map(int, hdf5.attribute(file, "view_position")) if view is None else view
    present = hdf5.read_dataset(path, file["present"])
    rows, columns = present.shape
    if not (0 <= t < rows and 0 <= s < columns and present[t, s]):
        raise SepiError(f"{path}: has no view {t},{s}; there are {present.sum()} of {rows}x{columns}, counted from 0")
    return t, s


def _write_files(
    folder: Path,
    light_field: LightField,
    maps: StageMaps,
    attributes: _Attributes,
    seconds: float | None,
    beside: _Names,
) -> _Names:
    camera, disparity, sigma = light_field.camera, maps.disparity, maps.sigma
    more: dict[str, npt.NDArray[Any]] = {"view": light_field.views[light_field.reference_position]}
    if camera is not None:
        more["depth"] = camera.depth(disparity)
        if sigma is not None and maps.low is not None and maps.high is not None:
            # larger disparities are nearer
            more |= {"nearest": camera.depth(maps.high), "farthest": camera.depth(maps.low)}
            more["depth_sigma"] = camera.depth_sigma(disparity, sigma)
    writers, digest = _writers(light_field, maps, more, seconds), attributes.get(DIGEST)
    taken = write_as_taken(folder, light_field, disparity, sigma=sigma)
    # images are packed outside Python's lock
    with ThreadPoolExecutor(min(4, available_cores())) as pool:
        # the digest of all views takes longest, and runs outside Python's lock
        told = pool.submit(result_attributes, light_field, maps, None if digest is None else str(digest))
        written = [pool.submit(write, folder / name) for name, write in writers.items()]
        with hdf5.create_hdf5(folder / RESULT) as file:
            hdf5.put_maps(file, maps.updated(disparity, maps.confidence, **more))
            for one in written:
                one.result()
            names = (*RESULT_FILES[:-1], *sorted({*writers, *taken}.difference(RESULT_FILES)), RESULT)
            # a later result may replace these files: they are not a user's own
            files = {"files": " ".join(sorted((*names, *beside)))}
            file.attrs.update({**told.result(), **attributes, **files})
    return names


def _writers(
    light_field: LightField, maps: StageMaps, more: Mapping[str, npt.NDArray[Any]], seconds: float | None
) -> dict[str, Callable[[Path], None]]:
    """What writes each file of a result beside ``result.h5``, by its name."""
    disparity, unknown, sigma = maps.disparity, maps.mask(UNKNOWN), maps.sigma
    camera, centre, rig = light_field.camera, light_field.from_centre, light_field.reference_rig
    shown: dict[str, Any] = {"camera": camera, "from_centre": centre, "unknown": unknown, "rig": rig, "sigma": sigma}
    writers: dict[str, Callable[[Path], None]] = {
        "disparity.npy": lambda path: np.save(path, disparity.astype("<f4"), allow_pickle=False),
        "disparity_16bit.png": lambda path: map_pictures.write_16bit(path, disparity),
        "disparity.png": lambda path: write_png(path, map_pictures.colour_code(disparity, unknown)),
        "confidence.png": lambda path: write_png(path, map_pictures.levels(maps.confidence)),
        "points.ply": lambda path: write_ply(path, point_cloud(more["view"], disparity, **shown)),
    }
    floats = {"disparity": disparity, **{name: maps.extra[name] for name in ERROR_BARS if name in maps.extra}, **more}
    pfm = [name for name in ("disparity", SIGMA, "depth", "depth_sigma") if name in floats]
    writers |= {f"{name}.pfm": partial(write_pfm, values=floats[name]) for name in pfm}
    masks = {f"mask_{name}.png": values for name, values in maps.extra.items() if values.dtype == bool}
    writers |= {name: partial(write_png, pixels=mask, texts=_MASK_TEXT) for name, mask in masks.items()}
    if sigma is not None:
        bounds: dict[str, Any] = {
            name: floats[name].astype("<f4") for name in (LOW, HIGH, "nearest", "farthest") if name in floats
        }
        writers["sigma.png"] = lambda path: write_png(path, map_pictures.sigma_picture(sigma, unknown))
        writers["interval.npz"] = lambda path: np.savez(path, **bounds)
    if seconds is not None:
        writers[RUNTIME] = partial(write_whole, content=f"{seconds:.3f}\n")
    return writers


def write_as_taken(
    folder: Path,
    light_field: LightField,
    disparity: FloatMap,
    position: _View | None = None,
    sigma: FloatMap | None = None,
) -> _Names:
    """Write the maps of a view at the pixels of the image as its calibrated camera took it; nothing without a rig.

    Parameters
    ----------
    folder : Path
    light_field : LightField
    disparity : ndarray, shape (H, W), float32
        Of the view.
    position : (int, int), optional
        Position of the view in the grid; default: the reference view.
    sigma : ndarray, shape (H, W), float32, optional
        Standard deviation of the disparity.

    Returns
    -------
    tuple of str
        Names of the files written.
    """
    if light_field.camera is None or light_field.rig is None:
        return ()
    from sepi.camera.as_taken import as_taken

    t, s = position or light_field.reference_position
    down, across = (light_field.baselines[t, s] + light_field.from_centre).tolist()
    maps = as_taken(disparity, sigma, light_field.camera, light_field.rig, (t, s), (down, across))
    names = names_as_taken(position, with_sigma=sigma is not None)
    for name, values in zip(names, maps, strict=True):
        write_pfm(folder / name, values)
    return names
