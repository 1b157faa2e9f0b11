"""Builds COLMAP's database of features and matches of pictures without poses; by pycolmap.

Features are found one picture after the other and written in the order of the pictures, so that the database does not
depend on threads.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt

from sepi.errors import SepiError, printable
from sepi.io.files import reading
from sepi.io.images import read_picture
from sepi.lightfield import FloatMap, as_unit_float
from sepi.stage import Progress

SEED = 0
"""Seed of COLMAP's random numbers."""

# largest error of a right match, pixels, up to this side of pictures; in proportion beyond
_MATCH_ERROR, _SIDE = 1.0, 1000
# number of pairs that are matched between two updates of the progress
_AT_ONCE = 64


@dataclass(frozen=True)
class Finding:
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


def tolerance(width: int, height: int) -> float:
    """Largest error of a match in pictures of this size, pixels."""
    return _MATCH_ERROR * max(1.0, max(width, height) / _SIDE)


def write_features(
    pycolmap: Any, database: Path, pictures: Sequence[Path], finding: Finding, progress: Progress
) -> list[int]:
    """Write cameras and features of pictures into a new database.

    Returns
    -------
    list of int
        Number of features of each picture.

    Raises
    ------
    SepiError
        If a picture cannot be read, or is of another size than the others and shares their camera.
    """
    wanted = pycolmap.FeatureExtractionOptions()
    wanted.num_threads = 1

    def found(path: Path) -> tuple[tuple[int, int], Any, Any]:
        grey: FloatMap = np.ascontiguousarray(as_unit_float(read_picture(path)).mean(axis=2), np.float32)
        height, width = grey.shape
        scale = finding.side / max(height, width)
        if scale < 1:
            small = (max(1, round(width * scale)), max(1, round(height * scale)))
            grey = np.asarray(cv2.resize(grey, small, interpolation=cv2.INTER_AREA), np.float32)
        bytes_of = np.rint(np.clip(grey, 0, 1) * 255).astype(np.uint8)
        extractor = pycolmap.FeatureExtractor.create(wanted, pycolmap.Device.cpu)
        features, descriptors = extractor.extract_from_uint8_array(bytes_of)
        places = np.array([(feature.x, feature.y) for feature in features], np.float32).reshape(-1, 2)
        places *= np.array([width / grey.shape[1], height / grey.shape[0]], np.float32)
        return (height, width), places, descriptors

    counts: list[int] = []
    first: tuple[int, int] | None = None
    with pycolmap.Database.open(str(database)) as file, ThreadPoolExecutor(finding.threads) as pool:
        camera = rig = -1
        for path, (size, places, descriptors) in zip(pictures, pool.map(found, pictures), strict=True):
            first = first or size
            if size != first and not finding.each:
                raise SepiError(
                    f"{path}: {size[1]}x{size[0]} pixels, but {pictures[0].name} has {first[1]}x{first[0]}; expected "
                    "pictures of one camera, or --cameras each"
                )
            if not counts or finding.each:
                camera, rig = _write_camera(pycolmap, file, path, finding.lens)
            image = pycolmap.Image(name=path.name, camera_id=camera)
            image.image_id = file.write_image(image)
            frame = pycolmap.Frame()
            frame.rig_id = rig
            frame.add_data_id(image.data_id)
            file.write_frame(frame)
            file.write_keypoints(image.image_id, places)
            file.write_descriptors(image.image_id, descriptors)
            counts.append(len(places))
            progress(len(counts) / len(pictures))
    return counts


def _write_camera(pycolmap: Any, file: Any, path: Path, lens: str) -> tuple[int, int]:
    options = pycolmap.ImageReaderOptions()
    options.camera_model = lens
    with reading(path, "picture that COLMAP can read"):
        # its focal length is from EXIF if there is one
        known = pycolmap.infer_camera_from_image(str(path), options)
    known.camera_id = file.write_camera(known)
    rig = pycolmap.Rig()
    rig.add_ref_sensor(known.sensor_id)
    return known.camera_id, file.write_rig(rig)


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
    matching, geometry = pycolmap.FeatureMatchingOptions(), pycolmap.TwoViewGeometryOptions()
    matching.num_threads = threads
    geometry.ransac.random_seed, geometry.ransac.max_error = SEED, size
    listed, pairing = database.with_suffix(".pairs"), pycolmap.ImportedPairingOptions()
    pairing.match_list_path = str(listed)
    for begin in range(0, len(pairs), _AT_ONCE):
        listed.write_text("".join(f"{one} {other}\n" for one, other in pairs[begin : begin + _AT_ONCE]), "utf-8")
        pycolmap.match_image_pairs(str(database), matching, pairing, geometry, pycolmap.Device.cpu)
        progress(min(1.0, (begin + _AT_ONCE) / len(pairs)))
    listed.unlink()


def matched_points(
    file: Any, one: int, other: int
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64], npt.NDArray[np.uint32]]:
    """Unverified matches of two pictures of a database: all features of both, and pairs of them."""
    places = [np.asarray(file.read_keypoints(image)[:, :2], np.float64) for image in (one, other)]
    return places[0], places[1], np.asarray(file.read_matches(one, other), np.uint32).reshape(-1, 2)
