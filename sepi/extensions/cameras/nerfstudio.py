"""Data sets of nerfstudio [1]_ from light fields; instant-ngp [2]_ reads the same file.

::

    transforms.json              cameras: `w h fl_x fl_y cx cy` of each view, camera-to-world matrices
    images/view_04_04.png        each view, RGB of 8 bit
    depths/view_04_04.npy        depth of each view in millimetres, float32; 0 where unknown
    depth_sigmas/view_04_04.npy  its standard deviation in millimetres; only if the map has error bars
    points.ply                   coloured points, for methods that start from points

A camera's axes point right, up and back. The world's z points up, y in the viewing direction; the origin is the
reference view's camera. Principal points are counted from the corner of the image. Neither program has a key for the
error of depth; ``depth_sigma_file_path`` is for programs that weight depth by it.

References
----------
.. [1] "Data conventions", https://docs.nerf.studio/quickstart/data_conventions.html: the axes; depth of 16 or 32 bit in
       millimetres, zero where unknown, for every frame or for none.
.. [2] ``src/nerf_loader.cu`` of https://github.com/NVlabs/instant-ngp: principal points of single frames need `w` and
       `h` beside them; it ignores this depth.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from sepi.camera.rig import WORLD
from sepi.io.files import atomic_folder, atomic_path
from sepi.io.images import write_png
from sepi.io.point_cloud import PointCloud, write_ply
from sepi.lightfield import FloatMap
from sepi.stage import Progress, no_progress

if TYPE_CHECKING:
    from sepi.extensions.cameras.camera_poses import Points
    from sepi.extensions.cameras.posed_views import PosedViews

_MILLIMETRES = 1000
_CLOUD = "points.ply"
_AXES = "x right, y the way that the cameras look, z up"


def write_nerfstudio(folder: str | Path, posed: PosedViews, progress: Progress = no_progress) -> None:
    """Write views, poses, points and depth as a data set of nerfstudio; equal content gives equal bytes.

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
        for view, name in enumerate(posed.names):
            carried = posed.carried(view)
            _write_millimetres(temporary / "depths" / f"{name}.npy", posed.depth(carried))
            if posed.sure:
                _write_millimetres(temporary / "depth_sigmas" / f"{name}.npy", posed.depth_sigma(view, carried))
            write_png(temporary / "images" / f"{name}.png", posed.picture(view))
            if posed.incomplete:
                write_png(temporary / "masks" / f"{name}.png", posed.shown(view))
            progress((view + 1) / len(posed.poses))
        if posed.chosen.any():
            cloud = PointCloud(_world(posed, posed.points).astype(np.float32), posed.colours, metric=True)
            axes = _AXES, f"{posed.units}; origin: camera of the reference view"
            write_ply(temporary / _CLOUD, cloud, axes if posed.rig is None else (WORLD, posed.units))
        with atomic_path(temporary / "transforms.json") as path:
            path.write_text(json.dumps(_transforms(posed), indent=1) + "\n", encoding="ascii")


def _write_millimetres(path: Path, metres: FloatMap) -> None:
    with atomic_path(path) as temporary, temporary.open("wb") as file:
        np.save(file, (metres * np.float32(_MILLIMETRES)).astype("<f4"), allow_pickle=False)


def _transforms(posed: PosedViews) -> dict[str, Any]:
    height, width = posed.poses.shape
    focal = posed.poses.focal_px
    frames = [
        {
            "file_path": f"images/{name}.png",
            "depth_file_path": f"depths/{name}.npy",
            # nerfstudio wants it for all views or for none
            **({"depth_sigma_file_path": f"depth_sigmas/{name}.npy"} if posed.sure else {}),
            **({"mask_path": f"masks/{name}.png"} if posed.incomplete else {}),
            **dict(zip(("w", "h", "fl_x", "fl_y", "cx", "cy"), (width, height, focal, focal, x, y), strict=True)),
            "transform_matrix": _camera_to_world(posed, centre),
        }
        for name, (x, y), centre in zip(
            posed.names, posed.poses.from_corner.tolist(), _world(posed, posed.poses.centres).tolist(), strict=True
        )
    ]
    cloud = {"ply_file_path": _CLOUD} if posed.chosen.any() else {}
    return {"camera_model": "OPENCV", "units": posed.units, **cloud, "frames": frames}


def _world(posed: PosedViews, points: Points) -> Points:
    """Points from the reference view's axes to those of the world: the calibrated cameras', or right, forward, up."""
    if posed.rig is not None:
        return posed.in_world(points)
    return np.column_stack([points[:, 0], points[:, 2], 0.0 - points[:, 1]])


def _camera_to_world(posed: PosedViews, centre: list[float]) -> list[list[float]]:
    """Camera-to-world matrix; columns: the camera's right, up and back in the world, and its centre."""
    axes = [[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]
    if posed.rig is not None:
        axes = (posed.rotation * [[1], [-1], [-1]]).T.tolist()
    return [*([*axis, place] for axis, place in zip(axes, centre, strict=True)), [0.0, 0.0, 0.0, 1.0]]
