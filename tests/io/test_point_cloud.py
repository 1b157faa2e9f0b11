"""Point clouds: where the points lie, what colour they have, and that other programs read the file."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from clouds import H, W, cloud_of, light_field, read_back

from sepi.camera import Camera
from sepi.errors import SepiError
from sepi.io.point_cloud import PointCloud, point_cloud, write_ply

CAMERA = Camera(scale=12.0, offset=3.0, focal_px=400.0)


# --- positions


def test_metric_point_lies_where_the_pinhole_camera_sees_it() -> None:
    """By hand: 12 / (1 + 3) = 3 m away; 10 pixels right of the middle and 5.5 above it, or less of a crop's middle."""
    disparity = np.full((H, W), np.nan, np.float32)
    disparity[4, 25] = 1
    cloud = cloud_of(light_field(camera=CAMERA), disparity)
    assert cloud.metric
    np.testing.assert_allclose(cloud.positions, [[10 * 3 / 400, 5.5 * 3 / 400, -3]], rtol=1e-6)
    cropped = cloud_of(light_field(camera=replace(CAMERA, right=4, down=-2)), disparity)
    np.testing.assert_allclose(cropped.positions, [[6 * 3 / 400, 3.5 * 3 / 400, -3]], rtol=1e-6)


@pytest.mark.parametrize("view", [(2, 5), (0, 3), (4, 0)])
@pytest.mark.parametrize("row_spacing", [1.0, 0.5])
def test_clouds_of_two_views_coincide_a_baseline_apart(view: tuple[int, int], row_spacing: float) -> None:
    """Whoever merges the clouds of several views must get one scene: the sheared views' principal points differ.

    The views are made by the definition of disparity alone; whole pixels keep that exact.
    """
    centre = (2, 3)
    down, right = row_spacing * (view[0] - centre[0]), view[1] - centre[1]
    first = np.random.default_rng(3).choice([-1.0, 0.0, 2.0], (H, W)).astype(np.float32)
    second = np.full((H, W), np.nan, np.float32)
    pairs = {}
    for y, x in np.ndindex(H, W):
        there = int(y - first[y, x] * down), int(x - first[y, x] * right)
        # one scene point for each pixel is enough here: hidden ones need no order
        if 0 <= there[0] < H and 0 <= there[1] < W and there not in pairs:
            pairs[there] = (y, x)
            second[there] = first[y, x]
    kept = np.full((H, W), np.nan, np.float32)
    for y, x in pairs.values():
        kept[y, x] = first[y, x]
    scene = light_field(camera=CAMERA, row_spacing=row_spacing)
    from_first = cloud_of(scene, kept).positions
    from_second = cloud_of(scene.seen_from(view), second).positions
    assert len(from_first) == len(from_second) > 100
    baseline = CAMERA.scale / CAMERA.focal_px
    moved = from_second + np.array([right * baseline, -down * baseline, 0], np.float32)
    by_pixel = dict(zip(sorted(pairs), moved, strict=True))
    expected = dict(zip(sorted(pairs.values()), from_first, strict=True))
    for there, here in pairs.items():
        np.testing.assert_allclose(by_pixel[there], expected[here], rtol=0, atol=2e-6)


def test_relief_is_upright_and_a_third_as_deep_as_wide() -> None:
    disparity = np.tile(np.linspace(-1, 1, W, dtype=np.float32), (H, 1))
    disparity[7, 7] = 1000  # one wrong pixel does not flatten it
    cloud = cloud_of(light_field(), disparity)
    assert not cloud.metric
    assert len(cloud.positions) == H * W
    grid = cloud.positions.reshape(H, W, 3)
    np.testing.assert_allclose(grid[0, :, 0], np.arange(W) - (W - 1) / 2)
    np.testing.assert_allclose(grid[:, 0, 1], (H - 1) / 2 - np.arange(H))
    assert (np.diff(grid[0, :, 2]) > 0).all()  # nearer is nearer to the viewer
    assert grid[0, -1, 2] - grid[0, 0, 2] == pytest.approx(W / 3, rel=0.05)
    np.testing.assert_allclose(grid[3, :, 2], cloud.stretch * disparity[3], rtol=1e-6)


def test_plane_and_empty_map_are_clouds_too() -> None:
    flat = cloud_of(light_field(), np.full((H, W), 0.5, np.float32))
    assert (flat.positions[:, 2] == 0.5).all()
    nothing = cloud_of(light_field(), np.full((H, W), np.nan, np.float32))
    assert nothing.positions.shape == nothing.colours.shape == (0, 3)


# --- which points


def test_pixels_without_a_place_have_no_point() -> None:
    disparity = np.zeros((H, W), np.float32)
    disparity[0, :5] = np.nan, np.inf, -np.inf, -3, -4  # -3: infinity of this camera
    assert len(cloud_of(light_field(camera=CAMERA), disparity).positions) == H * W - 5
    assert len(cloud_of(light_field(), disparity).positions) == H * W - 3


def test_unsure_far_and_skipped_pixels_are_left_out() -> None:
    disparity = np.zeros((H, W), np.float32)  # 4 m
    disparity[0] = -2  # 12 m
    confidence = np.full((H, W), 0.5, np.float32)
    confidence[1], confidence[2, 0] = 0.4, np.nan
    view = light_field().views[2, 3]
    sure = point_cloud(view, disparity, confidence, camera=CAMERA, min_confidence=0.5)
    assert len(sure.positions) == (H - 1) * W - 1
    near = point_cloud(view, disparity, camera=CAMERA, max_depth=4.0)
    assert len(near.positions) == (H - 1) * W
    assert (near.positions[:, 2] == -4).all()
    thin = point_cloud(view, disparity, camera=CAMERA, step=10)
    assert len(thin.positions) == 2 * 4
    np.testing.assert_array_equal(thin.colours, view[::10, ::10].reshape(-1, 3))


BAD_CALLS = {
    "map of another size": ({"disparity": np.zeros((3, 3), np.float32)}, "(3, 3)"),
    "metres without a camera": ({"max_depth": 3.0}, "camera's geometry"),
    "confidence above 1": ({"min_confidence": 1.5}, "0..1"),
    "least confidence of none": ({"min_confidence": 0.5}, "confidence map"),
}


@pytest.mark.parametrize("case", BAD_CALLS)
def test_what_cannot_be_meant_is_refused(case: str) -> None:
    values, word = BAD_CALLS[case]
    with pytest.raises(SepiError, match="point cloud") as raised:
        point_cloud(np.zeros((H, W, 3), np.uint8), **{"disparity": np.zeros((H, W), np.float32), **values})
    assert word in str(raised.value)


# --- colours


@pytest.mark.parametrize("kind", [np.uint8, np.uint16, np.float32])
@pytest.mark.parametrize("channels", [1, 3])
def test_colours_are_those_of_the_view_in_8_bit(kind: type, channels: int) -> None:
    scene = light_field(kind, channels)
    colours = cloud_of(scene, np.zeros((H, W), np.float32)).colours
    top = 1 if kind is np.float32 else np.iinfo(kind).max
    expected = np.broadcast_to(scene.views[2, 3].astype(float) / top * 255, (H, W, 3)).reshape(-1, 3)
    assert colours.dtype == np.uint8
    np.testing.assert_allclose(colours, expected, rtol=0, atol=0.501)


# --- files


def test_ply_is_read_by_others(tmp_path: Path) -> None:
    rng = np.random.default_rng(5)
    positions = rng.normal(size=(50, 3)).astype(np.float32)
    colours = rng.integers(0, 256, (50, 3), np.uint8)
    cloud = PointCloud(positions, colours, metric=True)
    write_ply(tmp_path / "a.ply", cloud)
    back, shades, data = read_back(tmp_path / "a.ply")
    assert (data.text, data.byte_order) == (False, "<")
    assert list(data.comments) == ["x right, y up, z towards the viewer", "metres; origin: camera of the view"]
    np.testing.assert_array_equal(back, positions)
    np.testing.assert_array_equal(shades, colours)
    write_ply(tmp_path / "b.ply", cloud)
    assert (tmp_path / "a.ply").read_bytes() == (tmp_path / "b.ply").read_bytes()
