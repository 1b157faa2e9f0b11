"""Features and matches of pictures without poses, and whether the camera's motion suits a light field; by pycolmap.

Pictures are written into COLMAP's database in their order before their features, so that it does not depend on threads.
The check of the motion looks at a few small pictures before a long calibration. Its result is an estimate, since the
focal length may be a guess. So it refuses only pictures far outside what :mod:`sepi.extensions.cameras.rectification`
accepts.
"""

import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from itertools import combinations
from pathlib import Path
from typing import Any, NamedTuple

import cv2
import numpy as np

from sepi.camera.rig import Floats
from sepi.errors import SepiError, printable
from sepi.extensions.cameras.model import require_alike, require_sideways
from sepi.io.images import read_picture
from sepi.stage import Progress, no_progress

SEED = 0
"""Seed of COLMAP's random numbers."""

# largest error of a right match, pixels, up to this side of pictures; in proportion beyond
_MATCH_ERROR, _SIDE = 1.0, 1000
# number of pictures or pairs of them between two updates of the progress
_AT_ONCE = 16


class Finding(NamedTuple):
    """Options of the search for features.

    Attributes
    ----------
    lens : str
        COLMAP's name of the lens model.
    each : bool
        Whether every picture has a camera of its own.
    threads : int
    side : int
        Longer side of pictures for features, pixels.
    """

    lens: str
    each: bool
    threads: int
    side: int


@contextmanager
def colmap(folder: Path) -> Iterator[None]:
    """Turn COLMAP's errors into one :class:`SepiError`."""
    try:
        yield
    except (RuntimeError, ValueError) as error:
        reason = printable(str(error))[:200] or type(error).__name__
        raise SepiError(f"{folder}: COLMAP gave up ({reason})") from error


def tolerance(camera: Any) -> float:
    """Largest error of a match in pictures of a camera's size, pixels."""
    return _MATCH_ERROR * max(1.0, float(max(camera.width, camera.height)) / _SIDE)


def write_features(
    pycolmap: Any, database: Path, pictures: Sequence[Path], finding: Finding, progress: Progress
) -> tuple[Any, list[int]]:
    """Write cameras and features of pictures into a new database.

    Returns
    -------
    camera : pycolmap.Camera
        That of the first picture.
    counts : list of int
        Number of features of each picture.

    Raises
    ------
    SepiError
        If a picture cannot be read, or is of another size than the others and shares their camera.
    """
    # COLMAP skips damaged pictures without a word
    sizes = [read_picture(path).shape[1::-1] for path in pictures]
    for path, size in zip(pictures, sizes, strict=True):
        if size != sizes[0] and not finding.each:
            told = f"{size[0]}x{size[1]} pixels, but {pictures[0].name} has {sizes[0][0]}x{sizes[0][1]}"
            raise SepiError(f"{path}: {told}; expected pictures of one camera, or --cameras each")
    mode = pycolmap.CameraMode.PER_IMAGE if finding.each else pycolmap.CameraMode.SINGLE
    reader = pycolmap.ImageReaderOptions(camera_model=finding.lens)
    names, where = [path.name for path in pictures], (str(database), str(pictures[0].parent))
    wanted = pycolmap.FeatureExtractionOptions(num_threads=finding.threads, max_image_size=finding.side)
    with pycolmap.Database.open(str(database)) as file:
        # first of all, so that numbers do not depend on which thread is done first
        pycolmap.import_images(*where, mode, names, reader)
        for begin in range(0, len(names), _AT_ONCE):
            some = names[begin : begin + _AT_ONCE]
            pycolmap.extract_features(*where, some, mode, reader, wanted, pycolmap.Device.cpu)
            progress(min(1.0, (begin + _AT_ONCE) / len(names)))
        images = [file.read_image_with_name(name) for name in names]
        if None in images:
            raise SepiError(f"{pictures[images.index(None)]}: not a picture that COLMAP can read")
        return file.read_all_cameras()[0], [file.num_keypoints_for_image(image.image_id) for image in images]


def match(
    pycolmap: Any, database: Path, pairs: Sequence[tuple[str, str]], size: float, threads: int, progress: Progress
) -> None:
    """Match pairs of pictures (by name), and keep the matches that one motion explains.

    Parameters
    ----------
    pycolmap : module
    database : Path
    pairs : sequence of (str, str)
    size : float
        Largest error of a match, pixels.
    threads : int
    progress : callable
    """
    matching = pycolmap.FeatureMatchingOptions(num_threads=threads)
    ransac = {"random_seed": SEED, "max_error": size}
    geometry = pycolmap.TwoViewGeometryOptions(compute_relative_pose=True, ransac=ransac)
    listed = database.with_suffix(".pairs")
    pairing = pycolmap.ImportedPairingOptions(match_list_path=str(listed))
    for begin in range(0, len(pairs), _AT_ONCE):
        listed.write_text("".join(f"{one} {other}\n" for one, other in pairs[begin : begin + _AT_ONCE]), "utf-8")
        pycolmap.match_image_pairs(str(database), matching, pairing, geometry, pycolmap.Device.cpu)
        progress(min(1.0, (begin + _AT_ONCE) / len(pairs)))
    listed.unlink()


# number of pictures that are checked, spread over all of them, and the longer side of each, pixels
_LOOKED_AT, _LOOK = 6, 640
# least number of features of a picture with texture, and of matches of two pictures of one scene
_FEATURES, _MATCHES = 40, 20
# quantile of the matches (some are false) that measures parallax; least parallax, in pixels of the reduced pictures,
# and that from which its direction is reliable
_MOST, _NARROW, _FIRM = 0.85, 0.8, 1.5
# least angle between motion and viewing direction, degrees, by an estimate
_AHEAD = 30.0


Step = tuple[tuple[str, str], float, float, float]
"""Motion of the camera between two pictures: their names; the parallax between near and far points in pixels; degrees
from the first camera's viewing direction, or its opposite, to the second camera's position, NaN if unknown; degrees
between the viewing directions."""


def require_motion(pycolmap: Any, folder: Path, pictures: Sequence[Path], finding: Finding) -> None:
    """Raise if the camera hardly moved, moved along its viewing direction, or turned too far.

    Raises
    ------
    SepiError
        In these cases, and if pictures have hardly any features, or no two of them match.
    """
    chosen = np.unique(np.rint(np.linspace(0, len(pictures) - 1, _LOOKED_AT)).astype(int)).tolist()
    # also neighbours, in case distant pictures do not match
    looked_at = [pictures[n] for n in sorted({*chosen, 1})]
    names = [path.name for path in looked_at]
    with tempfile.TemporaryDirectory() as place, colmap(folder):
        database = Path(place) / "look.db"
        camera, counts = write_features(pycolmap, database, looked_at, finding._replace(side=_LOOK), no_progress)
        poor = [name for name, count in zip(names, counts, strict=True) if count < _FEATURES]
        if 2 * len(poor) > len(counts):
            raise SepiError(f"{folder}: hardly any features in {_listed(poor)}; expected sharp, well lit texture")
        # width of a reduced picture's pixel, and largest error of a match
        unit = max(1.0, max(camera.width, camera.height) / _LOOK)
        size = tolerance(camera) * unit
        match(pycolmap, database, list(combinations(names, 2)), size, finding.threads, no_progress)
        with pycolmap.Database.open(str(database)) as file:
            steps = _steps(file, size)
    if not steps:
        expected = "expected one static scene, each picture from a position a little beside the last"
        raise SepiError(f"{folder}: no two of {_listed(names)} match; {expected}")
    pairs = [names for names, *_ in steps]
    parallax, ahead, turned = np.array([measured for _, *measured in steps]).T
    widest, farthest = int(parallax.argmax()), int(turned.argmax())
    if parallax[widest] < _NARROW * unit:
        told = f"from {' to '.join(pairs[widest])} the parallax is {parallax[widest]:.1f} pixels"
        why = "the camera turned but hardly moved, or the scene is flat; expected a camera that moves sideways, with"
        raise SepiError(f"{folder}: {told}: {why} at least {4 * _NARROW * unit:.0f} pixels between near and far points")
    require_alike(folder, *pairs[farthest], turned[farthest])
    firm = ahead[(parallax >= _FIRM * unit) & ~np.isnan(ahead)]
    if len(firm):
        require_sideways(folder, float(np.median(firm)), _AHEAD)


def _listed(names: Sequence[str]) -> str:
    return ", ".join(names[:3]) + (f" and {len(names) - 3} more" if len(names) > 3 else "")


def _steps(file: Any, size: float) -> list[Step]:
    steps: list[Step] = []
    for one, other in combinations(sorted(file.read_all_images(), key=lambda image: image.image_id), 2):
        found = file.read_two_view_geometry(one.image_id, other.image_id)
        if found is None or found.cam2_from_cam1 is None or len(found.inlier_matches) < _MATCHES:
            continue
        here, there = (np.asarray(file.read_keypoints(image.image_id)[:, :2], np.float64) for image in (one, other))
        pairs, motion = np.asarray(file.read_matches(one.image_id, other.image_id)), found.cam2_from_cam1
        rotation = np.array(motion.rotation.matrix())
        place = -rotation.T @ np.array(motion.translation)
        ahead = min(1.0, abs(place[2]) / length) if (length := np.linalg.norm(place)) else np.nan
        parallax = _parallax(here[pairs[:, 0]], there[pairs[:, 1]], size)
        angles = np.degrees(np.arccos([ahead, np.clip(rotation[2, 2], -1, 1)])).tolist()
        steps.append(((one.name, other.name), parallax, *angles))
    return steps


def _parallax(here: Floats, there: Floats, size: float) -> float:
    """Parallax in pixels: what remains after the best alignment of the pictures by a pure camera rotation."""
    cv2.setRNGSeed(SEED)
    turned, _ = cv2.findHomography(here, there, cv2.RANSAC, size)
    if turned is None:
        return 0.0
    moved = cv2.perspectiveTransform(here[:, None], turned)[:, 0]
    return float(np.quantile(np.linalg.norm(moved - there, axis=1), _MOST))
