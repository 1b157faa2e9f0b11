"""COLMAP models [1]_ of light fields, with exact poses: no features are matched, no cameras adjusted.

Structure from motion rarely works on light fields, because their views are too close together. Their poses are known.

The folder is a COLMAP workspace::

    images/view_04_04.png                                     each view, RGB of 8 bit
    sparse/0/cameras.txt, images.txt, points3D.txt            the model as text, where other programs look for it
    sparse/cameras.txt, images.txt, points3D.txt              the same, where stereo_fusion does
    stereo/depth_maps/view_04_04.png.geometric.bin            depth of each view, 0 where unknown
    stereo/normal_maps/view_04_04.png.geometric.bin           surface normals, 0 where unknown
    stereo/fusion.cfg                                         the views, for stereo_fusion

Each view has its own ``PINHOLE`` camera, with its principal point. Origin and axes are those of the reference view's
camera, so there is no rotation; for calibrated cameras they are those of their world. The points are those of the
reference view. The track of a point lists its pixel in each view that sees it. Its error is the mean reprojection error
over the track in pixels, from the standard deviation of the disparity; 0 where that is unknown.

References
----------
.. [1] COLMAP's documentation, "Output Format", https://colmap.github.io/format.html: poses go from the world to the
       camera, whose axes point right, down and forward; depth maps begin with ``width&height&channels&``. The middle of
       the first pixel is (0.5, 0.5).
"""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from sepi.io.files import atomic_folder, atomic_path
from sepi.io.images import write_png
from sepi.lightfield import FloatMap
from sepi.stage import Progress, no_progress

if TYPE_CHECKING:
    from sepi.extensions.cameras.posed_views import PosedViews

Points = npt.NDArray[np.float64]
Flags = npt.NDArray[np.bool_]
"""Which of the views sees which of the points, (N, P)."""

_CAMERAS = "#   CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]"
_IMAGES = "#   IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME\n#   POINTS2D[] as (X, Y, POINT3D_ID)"
_POINTS = "#   POINT3D_ID, X, Y, Z, R, G, B, ERROR, TRACK[] as (IMAGE_ID, POINT2D_IDX)"


def write_colmap(folder: str | Path, posed: PosedViews, progress: Progress = no_progress) -> None:
    """Write views, poses, points and depth as a COLMAP workspace; equal content gives equal bytes.

    Parameters
    ----------
    folder : str or Path
        Must not exist, or be empty.
    posed : PosedViews
        From :func:`sepi.extensions.cameras.posed_views.posed_views`.
    progress : callable
        Receives the fraction done.

    Raises
    ------
    SepiError
        If the folder exists and is not empty, or cannot be written.
    """
    with atomic_folder(Path(folder)) as temporary:
        sees = np.zeros((len(posed.poses), int(posed.chosen.sum())), bool)
        for view, name in enumerate(posed.names):
            carried = posed.carried(view)
            sees[view] = posed.sees(view, carried)
            write_png(temporary / "images" / f"{name}.png", posed.picture(view))
            if posed.incomplete:
                # the names that ``--ImageReader.mask_path`` and ``--StereoFusion.mask_path`` look for
                write_png(temporary / "masks" / f"{name}.png.png", posed.shown(view))
            stereo = f"{name}.png.geometric.bin"
            _write_maps(temporary / "stereo/depth_maps" / stereo, posed.depth(carried)[None])
            _write_maps(temporary / "stereo/normal_maps" / stereo, posed.normals(view, carried))
            progress((view + 1) / len(posed.poses))
        for name, lines in {
            "sparse/0/cameras.txt": _cameras(posed),
            "sparse/0/images.txt": _images(posed, sees),
            "sparse/0/points3D.txt": _points(posed, sees),
            "stereo/fusion.cfg": (f"{name}.png" for name in posed.names),
        }.items():
            with atomic_path(temporary / name) as path, path.open("w", encoding="ascii") as file:
                file.writelines(f"{line}\n" for line in lines)
        for path in (temporary / "sparse/0").iterdir():
            shutil.copyfile(path, temporary / "sparse" / path.name)


def _write_maps(path: Path, maps: FloatMap) -> None:
    """Write maps (C, H, W) in COLMAP's binary format."""
    channels, height, width = maps.shape
    with atomic_path(path) as temporary:
        temporary.write_bytes(f"{width}&{height}&{channels}&".encode("ascii") + maps.astype("<f4").tobytes())


def _cameras(posed: PosedViews) -> Iterator[str]:
    height, width = posed.poses.shape
    focal = posed.poses.focal_px
    yield "# Camera list with one line of data per camera:"
    yield _CAMERAS
    for number, (x, y) in enumerate(posed.poses.from_corner.tolist(), 1):
        yield f"{number} PINHOLE {width} {height} {focal!r} {focal!r} {x!r} {y!r}"


def _images(posed: PosedViews, sees: Flags) -> Iterator[str]:
    numbers = np.arange(1, sees.shape[1] + 1)
    points = posed.points
    # without rotation the translation is the negative camera centre
    places = posed.poses.centres if posed.rig is None else posed.in_world(posed.poses.centres) @ posed.rotation.T
    turn = "1 0 0 0" if posed.rig is None else _quaternion(posed.rotation)
    yield "# Image list with two lines of data per image:"
    yield _IMAGES
    yield f"# units: {posed.units}"
    for view, name in enumerate(posed.names):
        # adding zero makes -0 a 0
        x, y, z = (0.0 - places[view]).tolist()
        yield f"{view + 1} {turn} {x!r} {y!r} {z!r} {view + 1} {name}.png"
        there = posed.poses.project(points[sees[view]], view) + 0.5
        yield " ".join(
            f"{column!r} {row!r} {number}"
            for (row, column), number in zip(there.tolist(), numbers[sees[view]].tolist(), strict=True)
        )


def _quaternion(rotation: Points) -> str:
    from scipy.spatial.transform import Rotation

    x, y, z, w = Rotation.from_matrix(rotation).as_quat(canonical=True).tolist()
    return f"{w!r} {x!r} {y!r} {z!r}"


def _points(posed: PosedViews, sees: Flags) -> Iterator[str]:
    # a point's number among those that a view sees
    places = np.cumsum(sees, axis=1) - 1
    yield "# 3D point list with one line of data per point:"
    yield _POINTS
    errors = posed.pixel_errors(sees).tolist()
    for point, ((x, y, z), (r, g, b), error) in enumerate(
        zip(posed.in_world(posed.points).tolist(), posed.colours.tolist(), errors, strict=True)
    ):
        views = np.flatnonzero(sees[:, point])
        track = " ".join(f"{view + 1} {places[view, point]}" for view in views.tolist())
        yield f"{point + 1} {x!r} {y!r} {z!r} {r} {g} {b} {error:.6g} {track}"
