"""Calibrated cameras of a COLMAP model, text or binary, rigs included; by pycolmap."""

from __future__ import annotations

import signal
import threading
from pathlib import Path
from typing import Any

import numpy as np

from sepi.camera.rig import FISHEYE, PINHOLE, Lens, Shot
from sepi.errors import SepiError
from sepi.extensions.cameras.model import CameraModel
from sepi.extensions.cameras.pictures import Pictures, mask_of
from sepi.io.files import naming, reading

# model to lens, and indices of its parameters: fx, fy, cx, cy, then OpenCV's coefficients; -1: zero
_MODELS: dict[str, tuple[str, tuple[int, int, int, int], tuple[int, ...]]] = {
    "SIMPLE_PINHOLE": (PINHOLE, (0, 0, 1, 2), ()),
    "PINHOLE": (PINHOLE, (0, 1, 2, 3), ()),
    "SIMPLE_RADIAL": (PINHOLE, (0, 0, 1, 2), (3,)),
    "RADIAL": (PINHOLE, (0, 0, 1, 2), (3, 4)),
    "OPENCV": (PINHOLE, (0, 1, 2, 3), (4, 5, 6, 7)),
    "FULL_OPENCV": (PINHOLE, (0, 1, 2, 3), (4, 5, 6, 7, 8, 9, 10, 11)),
    "OPENCV_FISHEYE": (FISHEYE, (0, 1, 2, 3), (4, 5, 6, 7)),
    "SIMPLE_RADIAL_FISHEYE": (FISHEYE, (0, 0, 1, 2), (3,)),
    "RADIAL_FISHEYE": (FISHEYE, (0, 0, 1, 2), (3, 4)),
}
LENS_MODELS = tuple(_MODELS)
"""COLMAP's names of the lens models that can be read."""


def read_colmap(path: Path, pictures: Pictures) -> CameraModel:
    """The cameras of a COLMAP model.

    Raises
    ------
    SepiError
        If pycolmap is not installed, the model is damaged or empty, a lens is of another kind, or a picture is missing.
    """
    pycolmap = require_pycolmap(str(path))
    with reading(path, "COLMAP model"):
        try:
            model = pycolmap.Reconstruction(str(path))
            # names that are not text are errors, too
            images = sorted((image for image in model.images.values() if image.has_pose), key=lambda image: image.name)
        except (ValueError, RuntimeError, IndexError, KeyError) as error:
            raise SepiError(f"not a COLMAP model, or damaged ({str(error).splitlines()[0][:120]})") from error
    if not images:
        raise SepiError(f"{path}: a COLMAP model without pictures")
    points = np.array([point.xyz for point in model.points3D.values()], np.float64).reshape(-1, 3)
    files = tuple(pictures.find(image.name) for image in images)
    shots = []
    for file, image in zip(files, images, strict=True):
        with naming(f"{path}: {image.name}"):
            shots.append(_shot(pictures, file, image, model.cameras[image.camera_id]))
    masks = tuple(mask_of(file, image.name) for file, image in zip(files, images, strict=True))
    return CameraModel(path, tuple(shots), files, points, masks=masks)


def require_pycolmap(where: str) -> Any:
    """The module pycolmap, or an error that tells how to install it."""
    # if loaded before OpenCV, it makes OpenCV crash when writing PNG
    import cv2  # noqa: F401

    try:
        import pycolmap
    except ImportError as error:
        raise SepiError(f"{where}: reading a COLMAP model needs pycolmap: pip install 'sepi[colmap]'") from error
    # its signal handlers would end the program, and leave unfinished files
    before = signal.getsignal(signal.SIGTERM)
    if before is not None and threading.current_thread() is threading.main_thread():
        signal.signal(signal.SIGTERM, before)
    # it logs everything to standard error
    pycolmap.logging.minloglevel = pycolmap.logging.Level.FATAL  # type: ignore[assignment]
    return pycolmap


def _shot(pictures: Pictures, file: Path, image: Any, camera: Any) -> Shot:
    word = camera.model.name
    if word not in _MODELS:
        raise SepiError(f"camera model {word}; expected one of {', '.join(_MODELS)}")
    kind, (fx, fy, cx, cy), places = _MODELS[word]
    values = [float(value) for value in camera.params]
    # COLMAP counts from the picture's corner, a lens from the middle of the first pixel
    principal = values[cx] - 0.5, values[cy] - 0.5
    size, distortion = (camera.width, camera.height), tuple(values[place] for place in places)
    lens = pictures.fitted(file, Lens(*size, (values[fx], values[fy]), principal, kind, distortion), size)
    pose = image.cam_from_world()
    rotation = np.array(pose.rotation.matrix(), np.float64)
    return Shot(image.name, lens, rotation, -rotation.T @ np.array(pose.translation, np.float64))
