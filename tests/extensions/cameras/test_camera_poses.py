"""Cameras of the views, and maps seen by them: they must see what the light field shows."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from geometries import GEOMETRIES, standing

from sepi.camera import Camera
from sepi.errors import SepiError
from sepi.extensions.cameras.files import read_positions
from sepi.extensions.cameras.posed_views import PosedViews, nominal_camera
from sepi.lightfield import LightField
from sepi.matching.carried_map import carried_map
from sepi.scenes import render

GRID = (3, 4)
SHAPE = (11, 14)
SHEARED = Camera(scale=36.0, offset=8.0, focal_px=1500.0)


def light_field(**known: object) -> LightField:
    views = np.random.default_rng(0).integers(0, 256, (*GRID, *SHAPE, 3), np.uint8)
    return LightField(views=views, name="noise", **known)


def test_the_centre_view_looks_through_the_middle() -> None:
    """Programs that take the middle of the picture for granted are right about one view at least."""
    poses = PosedViews(light_field(view=(0, 0)), np.zeros(SHAPE, np.float32), camera=SHEARED)
    centre = poses.positions.index((1, 2))
    np.testing.assert_allclose(poses.principal_points[centre], [(SHAPE[1] - 1) / 2, (SHAPE[0] - 1) / 2], atol=1e-12)
    # one view step to the right, a baseline of b = scale / f, and b f / F pixels
    np.testing.assert_allclose(poses.centres[centre + 1] - poses.centres[centre], [36 / 1500, 0, 0], atol=1e-12)
    np.testing.assert_allclose(poses.principal_points[centre + 1] - poses.principal_points[centre], [8, 0], atol=1e-12)


def test_a_nominal_camera_sees_the_scene_before_it() -> None:
    """Where no camera is known, depth must be positive and of a sensible size, wherever zero disparity lies."""
    rng = np.random.default_rng(2)
    for disparity in (rng.uniform(-7, -4, SHAPE), rng.uniform(0, 0.01, SHAPE), np.full(SHAPE, -3.0), np.zeros(SHAPE)):
        values = disparity.astype(np.float32)
        depth = nominal_camera(values, np.ones(SHAPE, bool)).depth(values)
        assert depth.min() > 0.9
        assert depth.max() < 2.2
    nothing = np.full(SHAPE, np.nan, np.float32)
    assert nominal_camera(nothing, np.zeros(SHAPE, bool)).focal_px == 1.2 * SHAPE[1]


def test_a_few_wrong_pixels_do_not_move_the_nominal_camera() -> None:
    disparity = np.random.default_rng(3).uniform(-1, 1, (40, 50)).astype(np.float32)
    known = np.ones(disparity.shape, bool)
    before = nominal_camera(disparity, known)
    disparity[3, :4] = -90, 90, np.nan, np.inf
    known[5, 5], disparity[5, 5] = False, 400
    assert nominal_camera(disparity, known).offset == pytest.approx(before.offset, rel=0.05)


# --- carried maps


def test_carried_map_has_the_nearer_surface_in_front_and_nothing_where_nothing_was_seen() -> None:
    """A square two pixels nearer moves two to the left in the view on the right; what it uncovers is not known."""
    disparity = np.zeros((5, 9), np.float32)
    disparity[1:4, 4:7] = 2
    views = np.zeros((1, 3, 5, 9, 3), np.uint8)
    posed = PosedViews(LightField(views=views, name="square"), disparity)
    expected = np.zeros((5, 9), np.float32)
    expected[1:4, 2:5] = 2
    expected[1:4, 5:7] = np.nan
    carried = posed.carried(2)
    np.testing.assert_array_equal(carried, expected)
    # and of the background at columns 2 and 3 this view sees nothing
    hidden = np.zeros(disparity.shape, bool)
    hidden[1:4, 2:4] = True
    np.testing.assert_array_equal(posed.sees(2, carried).reshape(disparity.shape), ~hidden)


def test_what_is_unknown_is_carried_nowhere_and_spoils_nothing_beside_it() -> None:
    """NaN in a user's map would be drawn as depth, or tear its neighbours; a guess would hide what is behind."""
    disparity = np.zeros((9, 12), np.float32)
    known = np.ones(disparity.shape, bool)
    known[3:6, 4:7] = False
    for guess in (np.nan, np.inf, -np.inf, 3.0):
        there = np.where(known, disparity, np.float32(guess))
        np.testing.assert_array_equal(carried_map(there, (0, 1), known), np.where(known, 0, np.nan))
    assert np.isnan(carried_map(there, (0, 1), np.zeros(known.shape, bool))).all()


@pytest.mark.parametrize("geometry", GEOMETRIES)
def test_carried_pixels_have_the_colours_of_the_reference_view(geometry: str) -> None:
    """Depth of the other views must lie where their pictures show the thing: not mirrored, nor a row too far."""
    scene = render("curved_occluders", size=64, views=3, **standing(geometry, (3, 3)))
    posed = PosedViews(scene, np.asarray(scene.ground_truth))
    here = posed.picture(posed.reference).astype(np.float64)
    for view in range(len(posed.positions)):
        carried = posed.carried(view)
        y, x = np.nonzero(~np.isnan(carried))
        assert len(y) > 0.7 * carried.size
        back = np.column_stack([y, x]) + carried[y, x][:, None] * posed.baselines[view]
        rows, columns = np.clip(np.rint(back).astype(int), 0, 63).T
        right = np.abs(posed.picture(view)[y, x] - here[rows, columns]).mean()
        wrong = np.abs(posed.picture(view)[y, x] - here[y, x]).mean()
        assert right < 0.5 * wrong or view == posed.reference


# --- what is asked for


def test_points_are_the_surer_pixels_and_no_more_than_asked() -> None:
    disparity = np.ones(SHAPE, np.float32)
    confidence = np.linspace(0, 1, disparity.size, dtype=np.float32).reshape(SHAPE)
    confidence[0, 0] = np.nan
    scene = light_field()
    half = PosedViews(scene, disparity, confidence).chosen
    np.testing.assert_array_equal(half, confidence >= np.median(np.nan_to_num(confidence, nan=-1)))
    assert (PosedViews(scene, disparity, confidence, min_confidence=0.9).chosen == (confidence >= 0.9)).all()
    for most in (0, 1, 7, 40, 10**6):
        posed = PosedViews(scene, disparity, max_points=most)
        assert posed.chosen.sum() <= most
        assert len(posed.points) == len(posed.colours) == posed.chosen.sum()
    unknown = np.zeros(SHAPE, bool)
    unknown[4:] = True
    assert PosedViews(scene, disparity, unknown=unknown, max_points=10**6).chosen.sum() == 4 * SHAPE[1]


def test_what_lies_at_infinity_has_no_depth() -> None:
    """Beyond infinity, too: it would come out behind the cameras."""
    disparity = np.ones(SHAPE, np.float32)
    disparity[2, :3] = -8, -9, np.nan
    posed = PosedViews(light_field(camera=SHEARED), disparity)
    depth = posed.depth(posed.carried(posed.reference))
    assert depth[2, :3].tolist() == [0, 0, 0]
    assert posed.chosen.sum() == disparity.size - 3
    np.testing.assert_array_equal(depth[posed.chosen], SHEARED.depth(disparity)[posed.chosen])
    assert (posed.points[:, 2] > 0).all()


@pytest.mark.parametrize("kind", [np.uint16, np.float32])
def test_pictures_are_8_bit_colour_whatever_the_views_are(kind: type) -> None:
    """What these programs read; a grey picture, or one of 16 bit, breaks some of them."""
    levels = np.random.default_rng(6).integers(0, 256, (*GRID, *SHAPE, 1), np.uint8)
    views = levels * kind(257) if kind is np.uint16 else (levels / 255).astype(kind)
    posed = PosedViews(replace(light_field(), views=views), np.ones(SHAPE, np.float32))
    picture = posed.picture(posed.reference)
    assert picture.dtype == np.uint8
    np.testing.assert_array_equal(picture, np.repeat(levels[1, 2], 3, axis=2))


@pytest.mark.parametrize(
    "lines", ["element vertex 0\nproperty float x", "element face 0\nproperty list uchar int at", "vertex 0"]
)
def test_what_is_no_ply_of_points_is_refused(tmp_path: Path, lines: str) -> None:
    (tmp_path / "a.ply").write_text(f"ply\nformat ascii 1.0\n{lines}\nend_header\n")
    with pytest.raises(SepiError, match=r"a\.ply: not a PLY file of points"):
        read_positions(tmp_path / "a.ply")
