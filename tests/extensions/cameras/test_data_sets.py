"""Data sets for COLMAP and nerfstudio, read back by their documented conventions alone: all must fit together."""

import json
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from geometries import GEOMETRIES, standing
from plyfile import PlyData

from sepi.camera import Camera
from sepi.extensions.cameras.data_sets import write_colmap, write_nerfstudio
from sepi.extensions.cameras.posed_views import PosedViews
from sepi.lightfield import LightField
from sepi.scenes import render

pycolmap = pytest.importorskip("pycolmap")

CAMERA = Camera(scale=30.0, offset=6.0, focal_px=90.0)
NORMALS = "model/stereo/normal_maps/view_01_01.png.geometric.bin"


def scene_of(geometry: str = "grid", **known: Any) -> LightField:
    scene = render("curved_occluders", size=64, views=3, **standing(geometry, (3, 3)))
    present = np.ones((3, 3), bool)
    present[0, 2] = False
    fields = {name: getattr(scene, name) for name in ("views", "name", "row_spacing", "positions", "ground_truth")}
    return LightField(**{**fields, "present": present, "camera": CAMERA, **known})


def posed_of(scene: LightField, **options: Any) -> PosedViews:
    return PosedViews(scene, np.asarray(scene.ground_truth), **{"max_points": 300, **options})


def lines_of(path: Path) -> list[list[str]]:
    return [line.split() for line in path.read_text().splitlines() if not line.startswith("#")]


def read_depth(path: Path) -> np.ndarray:
    """A depth map of COLMAP: its size as text, then floats row by row."""
    width, height, channels, numbers = path.read_bytes().split(b"&", 3)
    assert channels == b"1"
    return np.frombuffer(numbers, "<f4").reshape(int(height), int(width))


# --- COLMAP


@pytest.mark.parametrize("geometry", GEOMETRIES)
@pytest.mark.parametrize("view", [None, (2, 0)])
def test_colmap_sees_points_where_the_views_do(tmp_path: Path, geometry: str, view: tuple[int, int] | None) -> None:
    """A model whose keypoints are off by half a pixel looks right and spoils what is made from it."""
    scene = scene_of(geometry, view=view)
    posed = posed_of(scene)
    write_colmap(tmp_path / "model", posed)
    model = pycolmap.Reconstruction(tmp_path / "model/sparse/0")
    places = {f"view_{t:02}_{s:02}.png": (t, s) for t, s in np.argwhere(scene.present)}
    images = [model.images[number] for number in sorted(model.images)]
    assert [image.name for image in images] == list(places)
    pixels = np.argwhere(posed.chosen)
    assert model.num_points3D() == len(pixels) > 100
    for image in images:
        seen = [point for point in image.points2D if point.has_point3D()]
        assert len(seen) == len(image.points2D)
        numbers, keypoints = (np.array([getattr(point, key) for point in seen]) for key in ("point3D_id", "xy"))
        projected = [image.project_point(model.points3D[number].xyz) for number in numbers]
        np.testing.assert_allclose(projected, keypoints, rtol=0, atol=1e-9)
        y, x = pixels[numbers - 1].T
        disparity = posed.disparity[y, x].astype(float)
        down, across = scene.baselines[places[image.name]]
        expected = np.column_stack([x - disparity * across, y - disparity * down]) + 0.5
        np.testing.assert_allclose(keypoints, expected, rtol=0, atol=1e-9)
    elements = [(number, one) for number, point in model.points3D.items() for one in point.track.elements]
    assert all(model.images[one.image_id].points2D[one.point2D_idx].point3D_id == number for number, one in elements)
    assert len(elements) == sum(len(image.points2D) for image in images)


def test_tracks_leave_out_views_in_which_a_point_is_hidden(tmp_path: Path) -> None:
    """Whoever looks for the point there finds something nearer."""
    disparity = np.zeros((8, 12), np.float32)
    disparity[2:6, 5:8] = 2
    views = np.random.default_rng(0).integers(0, 256, (1, 3, 8, 12, 3), np.uint8)
    posed = PosedViews(LightField(views=views, name="square", camera=CAMERA), disparity)
    write_colmap(tmp_path / "model", posed)
    tracks = [line[8::2] for line in lines_of(tmp_path / "model/sparse/points3D.txt")]
    there = {tuple(place): track for place, track in zip(np.argwhere(posed.chosen).tolist(), tracks, strict=True)}
    assert there[3, 6] == ["1", "2", "3"]
    assert there[3, 3] == ["1", "2"]  # the square moves two pixels to the left in the view on the right
    assert there[3, 9] == ["2", "3"]
    assert there[0, 3] == ["1", "2", "3"]


def test_colmap_points_have_the_error_that_their_views_would_see(tmp_path: Path) -> None:
    """COLMAP leaves out points by it, in pixels: an error of sigma in each view step, at views some steps away."""
    scene = scene_of()
    sigma = np.random.default_rng(4).uniform(0.01, 0.2, scene.shape).astype(np.float32)
    posed = posed_of(scene, sigma=sigma, max_points=10**6)
    # the half of least error
    np.testing.assert_array_equal(posed.chosen, sigma <= np.median(sigma))
    write_colmap(tmp_path / "model", posed)
    steps = [np.hypot(t - 1, s - 1) for t, s in np.argwhere(scene.present)]
    lines = lines_of(tmp_path / "model/sparse/points3D.txt")
    expected = [
        float(sigma[y, x]) * np.mean([steps[int(view) - 1] for view in line[8::2]])
        for line, (y, x) in zip(lines, np.argwhere(posed.chosen), strict=True)
    ]
    np.testing.assert_allclose([float(line[7]) for line in lines], expected, rtol=1e-5)
    write_colmap(tmp_path / "bare", posed_of(scene))
    assert {line[7] for line in lines_of(tmp_path / "bare/sparse/points3D.txt")} == {"0"}


def test_colmap_depth_is_that_of_the_camera(tmp_path: Path) -> None:
    posed = posed_of(scene_of())
    write_colmap(tmp_path / "model", posed)
    folder = tmp_path / "model/stereo/depth_maps"
    depth = read_depth(folder / "view_01_01.png.geometric.bin")
    np.testing.assert_array_equal(depth, CAMERA.depth(posed.disparity))
    np.testing.assert_allclose(depth, 30 / (posed.disparity.astype(float) + 6), rtol=1e-6)
    for name in posed.names:
        picture = cv2.imread(str(tmp_path / f"model/images/{name}.png"), cv2.IMREAD_UNCHANGED)
        t, s = map(int, name.split("_")[1:])
        np.testing.assert_array_equal(picture[:, :, ::-1], posed.light_field.views[t, s])
        other = read_depth(folder / f"{name}.png.geometric.bin")
        assert (other > 0).mean() > 0.7
        assert other.max() <= depth.max()


def test_colmap_fuses_the_workspace(tmp_path: Path) -> None:
    """Users fuse to a dense cloud as their next step; of a slanted plane it must be one, facing the cameras."""
    scene = render("slanted_plane", size=64, views=3)
    write_colmap(tmp_path / "model", posed_of(LightField(scene.views, "plane", ground_truth=scene.ground_truth)))
    options = pycolmap.StereoFusionOptions()
    options.num_threads = 1
    (tmp_path / "fused").mkdir()
    cloud = pycolmap.stereo_fusion(tmp_path / "fused", tmp_path / "model", options=options)
    points = np.array([point.xyz for point in cloud.points3D.values()])
    assert len(points) > 1000
    plane, residuals, *_ = np.linalg.lstsq(np.column_stack([points[:, :2], np.ones(len(points))]), points[:, 2])
    assert np.sqrt(residuals[0] / len(points)) < 0.003
    *size, data = (tmp_path / NORMALS).read_bytes().split(b"&", 3)
    assert size == [b"64", b"64", b"3"]
    normals = np.frombuffer(data, "<f4").reshape(3, 64, 64)
    expected = np.array([plane[0], plane[1], -1]) / np.linalg.norm([plane[0], plane[1], -1])
    np.testing.assert_allclose(np.median(normals, axis=(1, 2)), expected, atol=0.01)
    for name in ("cameras", "images", "points3D"):
        assert (tmp_path / f"model/sparse/{name}.txt").read_bytes() == (
            tmp_path / f"model/sparse/0/{name}.txt"
        ).read_bytes()


# --- nerfstudio


def nerf_pixels(frame: dict[str, Any], world: np.ndarray) -> np.ndarray:
    """Pixels (x, y) at which a frame's camera sees points: it looks along its -z, and its y points up."""
    matrix = np.array(frame["transform_matrix"])
    np.testing.assert_array_equal(matrix[3], [0, 0, 0, 1])
    np.testing.assert_allclose(matrix[:3, :3] @ matrix[:3, :3].T, np.eye(3), atol=1e-12)
    assert np.linalg.det(matrix[:3, :3]) == pytest.approx(1)
    right, up, back = ((world - matrix[:3, 3]) @ matrix[:3, :3]).T
    return np.column_stack([frame["cx"] + frame["fl_x"] * right / -back, frame["cy"] - frame["fl_y"] * up / -back])


def nerf_world(frame: dict[str, Any], depth: np.ndarray) -> np.ndarray:
    """Points of all pixels of a frame from its depth."""
    y, x = np.indices(depth.shape).reshape(2, -1) + 0.5
    rays = [(x - frame["cx"]) / frame["fl_x"], -(y - frame["cy"]) / frame["fl_y"], -np.ones(x.size)]
    matrix = np.array(frame["transform_matrix"])
    return (np.column_stack(rays) * depth.reshape(-1, 1)) @ matrix[:3, :3].T + matrix[:3, 3]


@pytest.mark.parametrize("geometry", GEOMETRIES)
@pytest.mark.parametrize("camera", [CAMERA, None])
def test_nerfstudio_frames_fit_together(tmp_path: Path, geometry: str, camera: Camera | None) -> None:
    """Depth of the reference view, taken to the other frames by their cameras, must come out where disparity says."""
    scene = scene_of(geometry, camera=camera)
    posed = posed_of(scene)
    write_nerfstudio(tmp_path / "set", posed)
    content = json.loads((tmp_path / "set/transforms.json").read_text())
    assert content["units"].split()[0] == ("metres" if camera else "nominal")
    frames = content["frames"]
    assert [frame["file_path"] for frame in frames] == [f"images/{name}.png" for name in posed.names]
    reference = next(frame for frame in frames if "01_01" in frame["file_path"])
    depth = np.load(tmp_path / "set" / reference["depth_file_path"]) / 1000
    if camera:
        np.testing.assert_allclose(depth, camera.depth(posed.disparity), rtol=1e-6)
    world = nerf_world(reference, depth.astype(float))
    pixels = np.indices(depth.shape).reshape(2, -1).T
    for frame, (t, s) in zip(frames, np.argwhere(scene.present), strict=True):
        expected = pixels - posed.disparity.astype(float).reshape(-1, 1) * scene.baselines[t, s]
        np.testing.assert_allclose(nerf_pixels(frame, world)[:, ::-1] - 0.5, expected, rtol=0, atol=1e-4)
        assert (frame["w"], frame["h"]) == (64, 64)
        # every frame has depth, or nerfstudio refuses all
        other = np.load(tmp_path / "set" / frame["depth_file_path"])
        assert other.dtype == np.dtype("<f4")
        assert (other > 0).mean() > 0.7
        assert cv2.imread(str(tmp_path / "set" / frame["file_path"]), cv2.IMREAD_UNCHANGED).shape == (64, 64, 3)


def test_nerfstudio_points_lie_in_the_same_world(tmp_path: Path) -> None:
    """Splats that begin elsewhere than the cameras look never find their place."""
    posed = posed_of(scene_of())
    write_nerfstudio(tmp_path / "set", posed)
    content = json.loads((tmp_path / "set/transforms.json").read_text())
    vertex = PlyData.read(str(tmp_path / "set" / content["ply_file_path"]))["vertex"].data
    world = np.column_stack([vertex[axis] for axis in "xyz"]).astype(float)
    (frame,) = [frame for frame in content["frames"] if "01_01" in frame["file_path"]]
    here = nerf_pixels(frame, world)[:, ::-1] - 0.5
    np.testing.assert_allclose(here, np.argwhere(posed.chosen), rtol=0, atol=1e-3)
    colours = np.column_stack([vertex[name] for name in ("red", "green", "blue")])
    np.testing.assert_array_equal(colours, posed.light_field.views[1, 1][posed.chosen])
    # z points up: what is at the top of the picture is high in the world
    assert np.corrcoef(world[:, 2], here[:, 0])[0, 1] < -0.9


def test_nerfstudio_depth_has_its_error_in_every_view(tmp_path: Path) -> None:
    """Who weighs depth by it needs it in the unit of the depth, and at the pixels that see the same surface."""
    scene = scene_of()
    disparity = np.asarray(scene.ground_truth)
    # of each surface its own
    sigma = (0.02 + 0.01 * (disparity - disparity.min())).astype(np.float32)
    write_nerfstudio(tmp_path / "set", posed_of(scene, sigma=sigma))
    write_nerfstudio(tmp_path / "bare", posed_of(scene))
    for frame in json.loads((tmp_path / "set/transforms.json").read_text())["frames"]:
        depth, found = (np.load(tmp_path / "set" / frame[key]) for key in ("depth_file_path", "depth_sigma_file_path"))
        known = depth > 0
        assert found.dtype == np.dtype("<f4")
        assert (found[~known] == 0).all()
        there = 30_000 / depth[known].astype(float) - 6
        expected = (0.02 + 0.01 * (there - disparity.min())) * 30_000 / (there + 6) ** 2
        # pixels are carried whole, disparity between them
        assert np.quantile(np.abs(found[known] / expected - 1), 0.99) < 0.03
    assert "depth_sigma" not in (tmp_path / "bare/transforms.json").read_text()


# --- both
