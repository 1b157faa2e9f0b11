"""Quick check of a few small pictures whether pictures without poses suit a light field, before a long calibration.

The result is an estimate, since the focal length may be a guess. So this check refuses only pictures far outside what
:mod:`sepi.extensions.cameras.rectification` accepts.
"""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from sepi.camera.rig import Floats
from sepi.errors import SepiError
from sepi.extensions.cameras.features import SEED, Finding, colmap, match, matched_points, tolerance, write_features
from sepi.stage import no_progress

# number of pictures that are checked, spread over all of them, and the longer side of each, pixels
_LOOKED_AT, _LOOK = 6, 640
# least number of features of a picture with texture, and of matches of two pictures of one scene
_FEATURES, _MATCHES = 40, 20
# quantile of the matches (some are false) that measures parallax; least parallax, in pixels of the reduced pictures,
# and that from which its direction is reliable
_MOST, _NARROW, _FIRM = 0.85, 0.8, 1.5
# angles in degrees: least between motion and viewing direction; largest between two viewing directions
_AHEAD, _TURNED = 30.0, 60.0


@dataclass(frozen=True)
class Step:
    """Motion of the camera between two pictures.

    Attributes
    ----------
    names : (str, str)
    parallax : float
        Parallax between near and far points, pixels.
    ahead : float or None
        Degrees from the first camera's viewing direction to the second camera's position; None if unknown.
    turned : float
        Degrees between the viewing directions.
    """

    names: tuple[str, str]
    parallax: float
    ahead: float | None
    turned: float


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
    with tempfile.TemporaryDirectory() as place, colmap(folder):
        database = Path(place) / "look.db"
        counts = write_features(pycolmap, database, looked_at, replace(finding, side=_LOOK), no_progress)
        poor = [path.name for path, count in zip(looked_at, counts, strict=True) if count < _FEATURES]
        if 2 * len(poor) > len(counts):
            raise SepiError(
                f"{folder}: hardly any features in {_listed(poor)}; expected pictures with texture, in focus "
                "and well lit"
            )
        with pycolmap.Database.open(str(database)) as file:
            camera = file.read_all_cameras()[0]
        names = [path.name for path in looked_at]
        size = tolerance(camera.width, camera.height) * max(1.0, max(camera.width, camera.height) / _LOOK)
        match(pycolmap, database, list(combinations(names, 2)), size, finding.threads, no_progress)
        with pycolmap.Database.open(str(database)) as file:
            steps = _steps(pycolmap, file, size)
    require_sideways(folder, names, steps, max(1.0, max(camera.width, camera.height) / _LOOK))


def require_sideways(folder: Path, names: Sequence[str], steps: Sequence[Step], unit: float) -> None:
    """Raise for motion that does not suit a light field; ``unit`` is the width of a reduced picture's pixel."""
    if not steps:
        raise SepiError(
            f"{folder}: no two of {_listed(names)} match; expected pictures of one static scene, each from a position "
            "a little beside the last"
        )
    widest = max(steps, key=lambda step: step.parallax)
    if widest.parallax < _NARROW * unit:
        raise SepiError(
            f"{folder}: from {widest.names[0]} to {widest.names[1]} the parallax is {widest.parallax:.1f} pixels: the "
            "camera turned but hardly moved, or the scene is flat; expected a camera that moves sideways, with a "
            f"parallax of at least {4 * _NARROW * unit:.0f} pixels between near and far points"
        )
    turned = max(steps, key=lambda step: step.turned)
    if turned.turned > _TURNED:
        raise SepiError(
            f"{folder}: {turned.names[0]} and {turned.names[1]} look about {turned.turned:.0f} degrees apart; expected "
            f"similar viewing directions in all pictures, at most {_TURNED:.0f} degrees apart"
        )
    firm = [step.ahead for step in steps if step.ahead is not None and step.parallax >= _FIRM * unit]
    if firm and np.median(firm) < _AHEAD:
        raise SepiError(
            f"{folder}: the camera moves along its viewing direction (at about {np.median(firm):.0f} degrees to it); "
            "expected it to move sideways, at 45 to 90 degrees"
        )


def _listed(names: Sequence[str]) -> str:
    return ", ".join(names[:3]) + (f" and {len(names) - 3} more" if len(names) > 3 else "")


def _steps(pycolmap: Any, file: Any, size: float) -> list[Step]:
    options = pycolmap.TwoViewGeometryOptions()
    options.ransac.random_seed, options.ransac.max_error, options.compute_relative_pose = SEED, size, True
    steps = []
    for one, other in combinations(sorted(file.read_all_images(), key=lambda image: image.image_id), 2):
        here, there, pairs = matched_points(file, one.image_id, other.image_id)
        if len(pairs) < _MATCHES:
            continue
        cameras = [file.read_camera(image.camera_id) for image in (one, other)]
        found = pycolmap.estimate_calibrated_two_view_geometry(cameras[0], here, cameras[1], there, pairs, options)
        motion = found.cam2_from_cam1
        if len(found.inlier_matches) < _MATCHES or motion is None:
            continue
        rotation = np.array(motion.rotation.matrix())
        place = -rotation.T @ np.array(motion.translation)
        length = float(np.linalg.norm(place))
        steps.append(
            Step(
                (one.name, other.name),
                _parallax(here[pairs[:, 0]], there[pairs[:, 1]], size),
                float(np.degrees(np.arccos(min(1.0, abs(place[2]) / length)))) if length else None,
                float(np.degrees(np.arccos(np.clip(rotation[2, 2], -1, 1)))),
            )
        )
    return steps


def _parallax(here: Floats, there: Floats, size: float) -> float:
    """Parallax in pixels: what remains after the best alignment of the pictures by a pure camera rotation."""
    cv2.setRNGSeed(SEED)
    turned, _ = cv2.findHomography(here, there, cv2.RANSAC, size)
    if turned is None:
        return 0.0
    moved = cv2.perspectiveTransform(here[:, None], turned)[:, 0]
    return float(np.quantile(np.linalg.norm(moved - there, axis=1), _MOST))
