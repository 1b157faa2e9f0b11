"""Structure from motion by pycolmap: a COLMAP model for :func:`sepi.read_cameras` from pictures without poses.

Sweeps for light fields are narrow: they lack the wide ray angles and the constraints on focal length that structure
from motion usually needs. So matches a pixel off are rejected, and a ray angle of one pixel is enough for a point.
Lenses stay as in the files, or at usual values, until all pictures are placed. Then they are refined, and the refined
lens is kept if the points lie clearly closer.
"""

import os
import re
import shutil
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np

from sepi.errors import SepiError
from sepi.extensions.cameras.files import LENS_MODELS, require_pycolmap
from sepi.extensions.cameras.model import PROJECT
from sepi.extensions.cameras.motion import SEED, Finding, colmap, match, require_motion, tolerance, write_features
from sepi.extensions.cameras.reader import read_model
from sepi.extensions.cameras.rectification import Rectification
from sepi.io.files import atomic_folder
from sepi.io.images import SUFFIXES
from sepi.io.readers.view_names import sorted_view_numbers
from sepi.process.threads import available_cores
from sepi.stage import Progress, no_progress
from sepi.validation import require_known

CAMERAS = ("one", "each")
"""Whether one camera took all pictures, or each has a camera of its own."""

# longer side of pictures for features, pixels
_SIDE = 2000
# largest number of pictures of which all pairs are matched; beyond, steps in the order of their names
_ALL_PAIRS = 60
_STEPS = (1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64, 96, 128)
# least ray angles of the first two pictures, degrees; COLMAP lowers each by itself. The next one is tried if less than
# this share of the pictures is placed
_FIRST_ANGLES, _ENOUGH = (4.0, 1.0), 0.9
# number of pairs of pictures that are tried as the first two, for each angle
_FIRST_PAIRS = 40
# least number of matches of the first two pictures, and of a placed picture
_FIRST_MATCHES, _PLACED_MATCHES = 40, 20
# least angle between the rays of a point, pixels, and COLMAP's own as its largest value, degrees
_POINT_ANGLE, _MOST_ANGLE = 1.0, 1.5
# the refined lens is kept if points lie closer by this share
_CLEARLY = 0.1
# progress after matching, and after placing
_FOUND, _MATCHED = 0.4, 0.7


@dataclass(frozen=True)
class Calibration:
    """Result of a calibration.

    Attributes
    ----------
    folder : Path
        Folder of the model.
    placed : tuple of str
        Names of the pictures whose cameras are known.
    left_out : tuple of str
        Names of the others.
    error : float
        Mean reprojection error of the points, pixels.
    notes : tuple of str
        Notes of :func:`sepi.read_cameras` on the cameras: distances from a plane, and pictures left out.
    unusable : str or None
        Reason why the cameras do not suit a light field; None if they do.

    Examples
    --------
    >>> from pathlib import Path
    >>> from sepi.extensions.cameras.calibration import Calibration
    >>> made = Calibration(Path("sweep-cameras"), ("1.jpg", "2.jpg"), ("3.jpg",), 0.4, (), None)
    >>> len(made.placed), made.left_out
    (2, ('3.jpg',))
    """

    folder: Path
    placed: tuple[str, ...]
    left_out: tuple[str, ...]
    error: float
    notes: tuple[str, ...]
    unusable: str | None


def calibrate(
    folder: str | Path,
    output: str | Path,
    *,
    lens: str = "SIMPLE_RADIAL",
    cameras: str = "one",
    force: bool = False,
    threads: int | None = None,
    progress: Progress = no_progress,
) -> Calibration:
    """Find the cameras that took the pictures of a folder, and write them as a COLMAP model.

    Parameters
    ----------
    folder : str or Path
        Folder of pictures; folders below it are ignored.
    output : str or Path
        Folder to make; an empty one may exist.
    lens : str
        COLMAP's name of the lens model.
    cameras : str
        One of :data:`CAMERAS`.
    force : bool
        Go on even if a check of a few pictures fails.
    threads : int, optional
        Default: one per core.
    progress : callable
        Called with the fraction done.

    Returns
    -------
    Calibration

    Raises
    ------
    SepiError
        If pycolmap (extra ``sepi[colmap]``) is not installed, the pictures are not a sweep of one scene, or the output
        exists already.

    Examples
    --------
    >>> import cv2
    >>> import numpy as np
    >>> from pathlib import Path
    >>> from sepi import Camera
    >>> from sepi.extensions.cameras.calibration import calibrate
    >>> from sepi.scenes import render
    >>> views = render("curved_occluders", size=96, views=3).views
    >>> Path("sweep").mkdir()
    >>> for view, (t, s) in enumerate(np.ndindex(3, 3)):
    ...     written = cv2.imwrite(f"sweep/{view}.png", views[t, s, :, :, ::-1])
    >>> made = calibrate("sweep", "sweep-cameras", threads=1)
    >>> len(made.placed), made.unusable
    (9, None)
    """
    folder, output = Path(folder), Path(output)
    require_known("lens", [lens], LENS_MODELS)
    require_known("cameras", [cameras], CAMERAS)
    pycolmap = require_pycolmap(str(folder))
    pictures = pictures_in(folder)
    names = [path.name for path in pictures]
    finding = Finding(lens, cameras == "each", threads or available_cores(), _SIDE)
    with atomic_folder(output) as temporary, colmap(folder):
        if not force:
            require_motion(pycolmap, folder, pictures, finding)
        work = temporary / "work"
        work.mkdir()
        database = work / "database.db"
        camera, _ = write_features(pycolmap, database, pictures, finding, lambda done: progress(_FOUND * done))
        pairs = pairs_of(names)
        share = _MATCHED - _FOUND
        match(pycolmap, database, pairs, tolerance(camera), finding.threads, lambda n: progress(_FOUND + share * n))
        model = _with_free_lens(pycolmap, _placed(pycolmap, folder, database, camera, len(pictures), progress))
        sparse = temporary / "sparse" / "0"
        sparse.mkdir(parents=True)
        model.write_text(str(sparse))
        # tells COLMAP's readers the folder of the pictures
        beside = os.path.relpath(folder.resolve(), Path(os.path.realpath(output)))
        (temporary / PROJECT).write_text(f"image_path = {beside}\n", "utf-8")
        shutil.rmtree(work)
    placed = {image.name for image in model.images.values() if image.has_pose}
    found, left_out = (tuple(name for name in names if (name in placed) is wanted) for wanted in (True, False))
    made = Calibration(output, found, left_out, float(model.compute_mean_reprojection_error()), (), None)
    try:
        return replace(made, notes=Rectification(read_model(output)).notes)
    except SepiError as error:
        return replace(made, unusable=str(error))


def pictures_in(folder: Path) -> list[Path]:
    """Pictures of a folder in the order of their names, with numbers in order of value.

    Raises
    ------
    SepiError
        If there are fewer than two.
    """
    if not folder.is_dir():
        raise SepiError(f"{folder}: no such folder; expected one of pictures")
    found = [path for path in folder.iterdir() if path.suffix.lower() in SUFFIXES and path.name[0] != "."]
    if len(found) < 2:
        what = "no pictures" if not found else "one picture alone"
        raise SepiError(f"{folder}: {what}; expected two or more pictures of one scene from different places")
    odd = next((path for path in found if not path.name.isprintable() or re.search(r"\s", path.name)), None)
    if odd is not None:
        raise SepiError(f"{odd}: the name has spaces, which COLMAP's files cannot hold; expected a name without them")
    return [folder / name for name in sorted_view_numbers(path.name for path in found).numbers]


def pairs_of(names: Sequence[str]) -> list[tuple[str, str]]:
    """Pairs of pictures to match: all pairs of a few; of many, each with some later ones, near ones more densely."""
    if len(names) <= _ALL_PAIRS:
        return list(combinations(names, 2))
    return [(names[n], names[n + step]) for n in range(len(names)) for step in _STEPS if n + step < len(names)]


def _placed(pycolmap: Any, folder: Path, database: Path, camera: Any, count: int, progress: Progress) -> Any:
    """The model with most pictures, with the lenses of the database."""
    size = tolerance(camera)
    least = min(_MOST_ANGLE, float(np.degrees(_POINT_ANGLE * size / camera.mean_focal_length())))
    options = pycolmap.IncrementalPipelineOptions()
    # on one thread, sums are the same in each run
    options.random_seed, options.num_threads = SEED, 1
    options.multiple_models, options.min_model_size = False, 2
    options.min_num_matches, options.init_num_trials = _PLACED_MATCHES, _FIRST_PAIRS
    options.ba_refine_focal_length = options.ba_refine_extra_params = False
    mapper, triangulation = options.mapper, options.triangulation
    mapper.random_seed = triangulation.random_seed = SEED
    mapper.num_threads = 1
    mapper.abs_pose_refine_focal_length = mapper.abs_pose_refine_extra_params = False
    mapper.init_min_num_inliers, mapper.abs_pose_min_num_inliers = _FIRST_MATCHES, _PLACED_MATCHES
    mapper.init_max_error = size
    mapper.abs_pose_max_error = 2 * size
    mapper.filter_max_reproj_error = triangulation.merge_max_reproj_error = 2 * size
    triangulation.complete_max_reproj_error = 2 * size
    mapper.filter_min_tri_angle = triangulation.min_angle = least
    made = database.parent / "models"
    made.mkdir()
    models: list[Any] = []
    for angle in _FIRST_ANGLES:
        mapper.init_min_tri_angle = mapper.ba_local_min_tri_angle = angle
        placed = iter(range(3, count + 1))

        def one_more(placed: Iterator[int] = placed) -> None:
            progress(_MATCHED + (1 - _MATCHED) * next(placed, count) / count)

        found = pycolmap.incremental_mapping(*map(str, (database, folder, made)), options, next_image_callback=one_more)
        models += found.values()
        best = max(models, key=lambda model: model.num_reg_images(), default=None)
        if best is not None and best.num_reg_images() >= _ENOUGH * count:
            return best
    if best is None:
        why = "the camera moved too little or along its viewing direction, or the pictures share too little"
        told = f"no two pictures tell the positions of their cameras: {why}"
        raise SepiError(f"{folder}: {told}; expected a sweep sideways past a scene with texture")
    return best


def _with_free_lens(pycolmap: Any, model: Any) -> Any:
    """The model with focal length and distortion refined by its points; itself if they are not clearly better."""
    freed = pycolmap.Reconstruction(model)
    options = pycolmap.BundleAdjustmentOptions(print_summary=False)
    options.ceres.solver_options.num_threads = 1
    config = pycolmap.BundleAdjustmentConfig()
    for image in freed.reg_image_ids():
        config.add_image(image)
    config.fix_gauge(pycolmap.BundleAdjustmentGauge.TWO_CAMS_FROM_WORLD)
    pycolmap.create_default_bundle_adjuster(options, config, freed).solve()
    freed.update_point_3d_errors()
    model.update_point_3d_errors()
    closer = freed.compute_mean_reprojection_error() < (1 - _CLEARLY) * model.compute_mean_reprojection_error()
    return freed if closer else model
