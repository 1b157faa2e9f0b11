"""Light fields with exact poses as COLMAP models [1]_ and data sets of nerfstudio [2]_ and instant-ngp [3]_.

Structure from motion rarely works on light fields, because their views are too close together. Their poses are known:
no features are matched, no cameras adjusted. Each view has its own ``PINHOLE`` camera, with its principal point.

A COLMAP workspace::

    images/view_04_04.png                                     each view, RGB of 8 bit
    sparse/0/cameras.txt, images.txt, points3D.txt            the model as text, where other programs look for it
    sparse/cameras.txt, images.txt, points3D.txt              the same, where stereo_fusion does
    stereo/depth_maps/view_04_04.png.geometric.bin            depth of each view, 0 where unknown
    stereo/normal_maps/view_04_04.png.geometric.bin           surface normals, 0 where unknown
    stereo/fusion.cfg                                         the views, for stereo_fusion

Origin and axes are those of the reference view's camera, so there is no rotation; for calibrated cameras they are those
of their world. The points are those of the reference view. The track of a point lists its pixel in each view that sees
it. Its error is the mean reprojection error over the track in pixels, from the standard deviation of the disparity; 0
where that is unknown.

A data set of nerfstudio::

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
.. [1] COLMAP's documentation, "Output Format", https://colmap.github.io/format.html: poses go from the world to the
       camera, whose axes point right, down and forward; depth maps begin with ``width&height&channels&``. The middle of
       the first pixel is (0.5, 0.5).
.. [2] "Data conventions", https://docs.nerf.studio/quickstart/data_conventions.html: the axes; depth of 16 or 32 bit in
       millimetres, zero where unknown, for every frame or for none.
.. [3] ``src/nerf_loader.cu`` of https://github.com/NVlabs/instant-ngp: principal points of single frames need `w` and
       `h` beside them; it ignores this depth.
"""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation

from sepi.camera.rig import WORLD, Rig
from sepi.extensions.cameras.posed_views import PosedViews
from sepi.io.files import atomic_folder, atomic_path, write_whole
from sepi.io.images import write_png
from sepi.io.point_cloud import PointCloud, write_ply
from sepi.lightfield import FloatMap
from sepi.stage import Progress, no_progress

Flags = npt.NDArray[np.bool_]
"""Which of the views sees which of the points, (N, P)."""


def write_colmap(folder: str | Path, posed: PosedViews, progress: Progress = no_progress) -> None:
    """Write views, poses, points and depth as a COLMAP workspace; equal content gives equal bytes.

    Parameters
    ----------
    folder : str or Path
        Must not exist, or be empty.
    posed : PosedViews
    progress : callable
        Receives the fraction done.

    Raises
    ------
    SepiError
        If the folder exists and is not empty, or cannot be written.
    """
    with atomic_folder(Path(folder)) as temporary:
        sees = np.zeros((len(posed.positions), int(posed.chosen.sum())), bool)
        # the names that ``--ImageReader.mask_path`` and ``--StereoFusion.mask_path`` look for
        for view, name, carried in _pictured(temporary, posed, ".png.png", progress):
            sees[view] = posed.sees(view, carried)
            stereo = f"{name}.png.geometric.bin"
            _write_maps(temporary / "stereo/depth_maps" / stereo, posed.depth(carried)[None])
            _write_maps(temporary / "stereo/normal_maps" / stereo, posed.normals(view, carried))
        write_whole(temporary / "stereo/fusion.cfg", "".join(f"{name}.png\n" for name in posed.names))
        model = {"cameras": _cameras(posed), "images": _images(posed, sees), "points3D": _points(posed, sees)}
        for name, lines in model.items():
            text = "".join(f"{line}\n" for line in lines)
            for place in ("sparse/0", "sparse"):
                write_whole(temporary / place / f"{name}.txt", text)


def _pictured(folder: Path, posed: PosedViews, mask: str, progress: Progress) -> Iterator[tuple[int, str, FloatMap]]:
    """Number, name and disparity of each view, whose picture and mask are written."""
    missing = posed.light_field.missing
    for view, name in enumerate(posed.names):
        write_png(folder / "images" / f"{name}.png", posed.picture(view))
        if missing is not None:
            write_png(folder / "masks" / f"{name}{mask}", ~missing[posed.positions[view]])
        yield view, name, posed.carried(view)
        progress((view + 1) / len(posed.positions))


def _write_maps(path: Path, maps: FloatMap) -> None:
    """Write maps (C, H, W) in COLMAP's binary format."""
    channels, height, width = maps.shape
    write_whole(path, f"{width}&{height}&{channels}&".encode("ascii") + maps.astype("<f4").tobytes())


def _cameras(posed: PosedViews) -> Iterator[str]:
    (height, width), focal = posed.light_field.shape, posed.camera.focal_px
    yield "# CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]"
    for number, (x, y) in enumerate((posed.principal_points + 0.5).tolist(), 1):
        yield f"{number} PINHOLE {width} {height} {focal!r} {focal!r} {x!r} {y!r}"


def _images(posed: PosedViews, sees: Flags) -> Iterator[str]:
    turn, places = "1 0 0 0", posed.centres
    if posed.rig is not None:
        x, y, z, w = Rotation.from_matrix(posed.rig.rotation).as_quat(canonical=True).tolist()
        turn, places = f"{w!r} {x!r} {y!r} {z!r}", posed.rig.to_world(places) @ posed.rig.rotation.T
    yield "# IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME; then POINTS2D[] as (X, Y, POINT3D_ID)"
    yield f"# units: {posed.units}"
    for view, name in enumerate(posed.names):
        # adding zero makes -0 a 0
        x, y, z = (0.0 - places[view]).tolist()
        yield f"{view + 1} {turn} {x!r} {y!r} {z!r} {view + 1} {name}.png"
        numbers = np.flatnonzero(sees[view])
        there = posed.project(posed.points[numbers], view) + 0.5
        yield " ".join(f"{x!r} {y!r} {n + 1}" for (x, y), n in zip(there.tolist(), numbers.tolist(), strict=True))


def _points(posed: PosedViews, sees: Flags) -> Iterator[str]:
    # a point's number among those that a view sees
    places = np.cumsum(sees, axis=1) - 1
    yield "# POINT3D_ID, X, Y, Z, R, G, B, ERROR, TRACK[] as (IMAGE_ID, POINT2D_IDX)"
    world = posed.points if posed.rig is None else posed.rig.to_world(posed.points)
    told = world.tolist(), posed.colours.tolist(), posed.pixel_errors(sees).tolist()
    for point, ((x, y, z), (r, g, b), error) in enumerate(zip(*told, strict=True)):
        track = " ".join(f"{view + 1} {places[view, point]}" for view in np.flatnonzero(sees[:, point]).tolist())
        yield f"{point + 1} {x!r} {y!r} {z!r} {r} {g} {b} {error:.6g} {track}"


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
    progress : callable
        Receives the fraction done.

    Raises
    ------
    SepiError
        If the folder exists and is not empty, or cannot be written.
    """
    with atomic_folder(Path(folder)) as temporary:
        for view, name, carried in _pictured(temporary, posed, ".png", progress):
            _write_millimetres(temporary / "depths" / f"{name}.npy", posed.depth(carried))
            if posed.sure:
                _write_millimetres(temporary / "depth_sigmas" / f"{name}.npy", posed.depth_sigma(view, carried))
        # without calibrated cameras, the world's axes are right, forward, up
        rig = posed.rig or Rig(np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]]), np.zeros(3), 1.0, posed.units, {})
        if posed.chosen.any():
            cloud = PointCloud(rig.to_world(posed.points).astype(np.float32), posed.colours, metric=True)
            axes = _AXES, f"{posed.units}; origin: camera of the reference view"
            write_ply(temporary / _CLOUD, cloud, axes if posed.rig is None else (WORLD, posed.units))
        write_whole(temporary / "transforms.json", json.dumps(_transforms(posed, rig), indent=1) + "\n")


def _write_millimetres(path: Path, metres: FloatMap) -> None:
    with atomic_path(path) as temporary, temporary.open("wb") as file:
        np.save(file, (metres * np.float32(_MILLIMETRES)).astype("<f4"), allow_pickle=False)


def _transforms(posed: PosedViews, rig: Rig) -> dict[str, Any]:
    (height, width), focal = posed.light_field.shape, posed.camera.focal_px
    # the camera's right, up and back in the world; adding zero makes -0 a 0
    axes = (rig.rotation * [[1], [-1], [-1]]).T + 0.0
    frames = []
    for name, (x, y), at in zip(posed.names, posed.principal_points + 0.5, rig.to_world(posed.centres), strict=True):
        frame: dict[str, Any] = {"file_path": f"images/{name}.png", "depth_file_path": f"depths/{name}.npy"}
        # nerfstudio wants it for all views or for none
        if posed.sure:
            frame["depth_sigma_file_path"] = f"depth_sigmas/{name}.npy"
        if posed.light_field.missing is not None:
            frame["mask_path"] = f"masks/{name}.png"
        frame |= {"w": width, "h": height, "fl_x": focal, "fl_y": focal, "cx": float(x), "cy": float(y)}
        frame["transform_matrix"] = [*np.column_stack([axes, at]).tolist(), [0.0, 0.0, 0.0, 1.0]]
        frames.append(frame)
    cloud = {"ply_file_path": _CLOUD} if posed.chosen.any() else {}
    return {"camera_model": "OPENCV", "units": posed.units, **cloud, "frames": frames}
