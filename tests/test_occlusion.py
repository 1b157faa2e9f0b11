"""Occlusion stage: the side rule by geometry on a two-plane scene, candidates, and what it mends."""

import numpy as np
import pytest
from geometries import jittered
from scipy.ndimage import gaussian_filter

from sepi.image.edges import CannyParameters, canny_edges, depth_discontinuities, edge_angle
from sepi.image.mean_shift import patch_modes
from sepi.initial import CHOICES as INITIAL
from sepi.io.hdf5 import read_stage, write_stage
from sepi.lightfield import DisparityRange, LightField
from sepi.matching.view_subsets import half_planes, halves_and_quarters
from sepi.occlusion import CHOICES, nearer_on_hidden_side
from sepi.scenes import render
from sepi.stage import StageMaps, no_progress

SIZE = 48
EDGE = 24


def two_planes(near_side: str) -> LightField:
    """A near textured plane (disparity 2) covering one side of the picture, before a far one (disparity -1)."""
    generator = np.random.default_rng(7)
    # detail wider than a pixel, so that it is not taken for noise of the camera
    far, near = (
        (128 + gaussian_filter(generator.normal(0, 150, (3 * SIZE, 3 * SIZE, 3)), (1, 1, 0)))
        .clip(0, 255)
        .astype(np.uint8)
        for _ in range(2)
    )
    axis = 1 if near_side in ("left", "right") else 0
    grid = 5
    views = np.empty((grid, grid, SIZE, SIZE, 3), np.uint8)
    rows, columns = np.mgrid[:SIZE, :SIZE]
    for t in range(grid):
        for s in range(grid):
            dt, ds = t - grid // 2, s - grid // 2
            # both disparities are whole numbers: a view is a shifted copy, exact without interpolation
            there = (columns if axis else rows) + 2 * (ds if axis else dt)
            covered = there >= EDGE if near_side in ("right", "down") else there < EDGE
            background = far[rows + SIZE - dt, columns + SIZE - ds]
            foreground = near[rows + SIZE + 2 * dt, columns + SIZE + 2 * ds]
            views[t, s] = np.where(covered[..., None], foreground, background)
    place = columns if axis else rows
    nearer = place >= EDGE if near_side in ("right", "down") else place < EDGE
    ground_truth = np.where(nearer, 2, -1).astype(np.float32)
    return LightField(
        views, "two planes", disparity_range=DisparityRange(-1.5, 2.5, "given"), ground_truth=ground_truth
    )


def run(light_field, choice="half_sepi", num_disparities=41):
    initial = INITIAL["sepi"].run(
        light_field, None, INITIAL["sepi"].parameters(num_disparities=num_disparities), no_progress
    )
    parameters = CHOICES[choice].parameters(**({} if choice == "none" else {"num_disparities": num_disparities}))
    return initial, CHOICES[choice].run(light_field, initial, parameters, no_progress)


@pytest.mark.parametrize(("near_side", "kept"), [("right", "left"), ("left", "right"), ("down", "up"), ("up", "down")])
def test_half_away_from_the_nearer_surface_is_kept(near_side, kept):
    """With the side rule the wrong way round (as in the paper's text) the occluder's views would be trusted."""
    light_field = two_planes(near_side)
    _, maps = run(light_field)
    names = maps.subset_names
    assert names == halves_and_quarters(light_field).names
    across = np.s_[15:-15, EDGE - 2 : EDGE] if near_side == "right" else None
    if near_side == "left":
        across = np.s_[15:-15, EDGE : EDGE + 2]
    if near_side == "down":
        across = np.s_[EDGE - 2 : EDGE, 15:-15]
    if near_side == "up":
        across = np.s_[EDGE : EDGE + 2, 15:-15]
    sides = maps.extra["view_subset"][across]
    assert np.mean([kept in names[side] for side in sides.ravel()]) > 0.9
    opposite = {"left": "right", "right": "left", "up": "down", "down": "up"}[kept]
    assert not any(opposite in names[side] for side in sides.ravel())


@pytest.mark.parametrize("choice", ["half_sepi", "wang"])
def test_depth_next_to_an_occluder_is_mended(choice):
    light_field = two_planes("right")
    initial, maps = run(light_field, choice)
    beside = np.s_[6:-6, EDGE - 5 : EDGE]
    before, after = (np.abs(m.disparity - light_field.ground_truth)[beside] for m in (initial, maps))
    assert after.mean() < 0.05
    assert after.mean() <= before.mean()
    # the confidence of a mended pixel is that of the views it kept, not of the occluder's
    occluded = maps.extra["occluded"][beside]
    assert maps.confidence[beside][occluded].mean() > initial.confidence[beside][occluded].mean()


def test_nothing_changes_where_nothing_is_occluded():
    light_field = render("fronto_parallel", size=64, views=5)
    initial, maps = run(light_field)
    np.testing.assert_array_equal(maps.disparity, initial.disparity)


def blank(grid, **known):
    return LightField(np.zeros((*grid, 2, 2, 3), np.uint8), "blank", **known)


def test_halves_and_quarters_partition_the_views():
    views = halves_and_quarters(blank((9, 9)))
    members = {n: subset[views.groups] for n, subset in zip(views.names, views.subsets, strict=True)}
    assert members["full"].all()
    assert members["left"][:, :5].all()
    assert not members["left"][:, 5:].any()
    assert members["up"][:5].all()
    assert not members["up"][5:].any()
    np.testing.assert_array_equal(members["right-down"], members["right"] & members["down"])


@pytest.mark.parametrize("row_spacing", [0.1, 1, 4])
def test_a_view_close_to_the_dividing_line_stands_on_it(row_spacing):
    """Left out of a half for a hair's breadth, a row of views would be missing from the depth beside an edge."""
    positions = jittered((5, 7)) * [row_spacing, 1]
    positions[0, 0] = positions[4, 3]  # a view far from its place counts where it is
    views = halves_and_quarters(blank((5, 7), positions=positions))
    even = halves_and_quarters(blank((5, 7), row_spacing=row_spacing))
    expected = even.groups.copy()
    expected[0, 0] = even.groups[4, 3]
    np.testing.assert_array_equal(views.groups, expected)
    np.testing.assert_array_equal(even.groups, halves_and_quarters(blank((5, 7))).groups)


def test_half_planes_are_those_of_the_picture_where_rows_are_closer():
    """Edges have their angle in the picture: the views that see past one lie beyond its line there, not in the grid."""
    views = half_planes(blank((9, 9), row_spacing=0.25), 8)
    t, s = np.mgrid[-4:5, -4:5]
    angle = np.pi / 16
    facing = s * np.cos(angle) + 0.25 * t * np.sin(angle)
    np.testing.assert_array_equal(views.subsets[1][views.groups][facing != 0], (facing > 0)[facing != 0])


def test_nearer_surface_is_found_only_on_the_hidden_side():
    surface = np.zeros((9, 21), np.float32)
    surface[:, 14:] = 1
    pixel = np.zeros_like(surface)
    left = nearer_on_hidden_side(surface, pixel, ["left"], 4, 0.1)
    assert left[4, 10:14].all()
    assert not left[4, :10].any()
    assert not nearer_on_hidden_side(surface, pixel, ["right"], 4, 0.1)[4, :14].any()
    assert nearer_on_hidden_side(surface, pixel, ["left", "up"], 4, 0.1)[4, 12]


def test_mean_shift_pulls_outliers_to_their_surface_but_not_across():
    disparity = np.zeros((20, 20), np.float32)
    disparity[:, 10:] = 2
    image = np.repeat((disparity / 4)[..., None], 3, axis=2)
    speckled = disparity.copy()
    speckled[5, 5] = 0.4
    modes = patch_modes(
        image, speckled, np.ones_like(disparity, bool), radius=4, sigma_colour=0.05, sigma_disparity=0.3
    )
    assert abs(modes[5, 5]) < 0.1
    assert np.abs(modes - disparity)[:, [8, 9, 10, 11]].max() < 0.05


def test_edges_follow_gradients_and_their_direction():
    image = np.zeros((40, 40, 3), np.float32)
    image[:, 20:] = 0.5
    edges = canny_edges(image, CannyParameters())
    assert edges[5:-5, 18:22].any(axis=1).all()
    assert not edges[:, :15].any()
    assert np.abs(edge_angle(image, CannyParameters())[20, 20]) < 0.1
    assert np.abs(np.abs(edge_angle(image.transpose(1, 0, 2), CannyParameters())[20, 20]) - np.pi / 2) < 0.1
    assert depth_discontinuities(image[..., 0], 0.3)[:, 19:21].all()
    assert not depth_discontinuities(image[..., 0], 0.6).any()


@pytest.mark.parametrize("choice", ["half_sepi", "wang"])
def test_the_file_says_which_views_were_kept(tmp_path, choice):
    """Both occlusion models number their subsets from 0: the same number stands for other views."""
    light_field = two_planes("right")
    initial, maps = run(light_field, choice)
    write_stage(tmp_path / "occlusion.h5", maps, {})
    back = read_stage(tmp_path / "occlusion.h5")
    assert back.subset_names == maps.subset_names
    kept = {back.subset_names[number] for number in np.unique(back.extra["view_subset"])}
    assert "full" in kept
    assert ("left" in kept) == (choice == "half_sepi")
    assert any(name.startswith("half-plane") for name in kept) == (choice == "wang")
    # stages that follow hand it on
    assert back.updated(initial.disparity, initial.confidence).subset_names == maps.subset_names


@pytest.mark.parametrize("choice", ["half_sepi", "wang"])
def test_small_changes_keep_the_depth_from_all_views(choice):
    """A half's depth is noisier: what it moves by less than ``min_change`` is no occlusion mended."""
    light_field = two_planes("right")
    initial, _ = run(light_field, "none")
    changes = {}
    for least in (0.0, 0.5):
        parameters = CHOICES[choice].parameters(num_disparities=41, min_change=least, gain_half=0)
        maps = CHOICES[choice].run(light_field, initial, parameters, no_progress)
        change = np.abs(maps.disparity - initial.disparity)
        changes[least] = change[change > 0]
    # in steps of which the farthest view is 4 away, here 2
    assert (changes[0.0] < 1).any()
    assert (changes[0.5] > 1).all()
    assert changes[0.5].any()


def test_a_mirrored_scene_keeps_the_mirrored_halves():
    """Halves that lay askew to the edge would hold views in which the occluder hides the pixel."""
    light_field = two_planes("right")
    views = np.flip(light_field.views, (1, 3)).copy()
    other = LightField(views, "mirrored", disparity_range=light_field.disparity_range)
    _, usual = run(light_field, "wang")
    _, mirrored = run(other, "wang")
    directions = CHOICES["wang"].parameters().directions
    # the angle (n + 1/2) pi / directions, seen in a mirror
    half = np.fliplr(mirrored.extra["view_subset"]).astype(int) - 1
    expected = np.where(half < 0, 0, (directions - 1 - half) % (2 * directions) + 1)
    occluded = usual.extra["occluded"]
    assert occluded.any()
    assert (usual.extra["view_subset"] == expected)[occluded].mean() > 0.95


@pytest.mark.parametrize("choice", ["half_sepi", "wang"])
def test_depth_steps_without_an_edge_are_candidates(choice):
    """Before a background of its own colour, an occluder has no edge but that of the depth."""
    views = np.full((3, 3, 40, 40, 3), 128, np.uint8)
    light_field = LightField(views, "one colour", disparity_range=DisparityRange(-1, 1, "given"))
    step = np.repeat(np.where(np.arange(40) < 20, -1, 1)[None], 40, axis=0).astype(np.float32)
    parameters = CHOICES[choice].parameters(num_disparities=5, candidate_reach=3)
    maps = CHOICES[choice].run(light_field, StageMaps(step, np.ones_like(step)), parameters, no_progress)
    found = maps.extra["occlusion_candidates"]
    assert found[:, 16:24].all()
    assert not found[:, :14].any()
    assert not found[:, 26:].any()


def test_best_marks_what_some_view_does_not_see():
    """The mask is scored, shown, and left out by those who need sure depth."""
    light_field = two_planes("right")
    before = StageMaps(light_field.ground_truth, np.ones((SIZE, SIZE), np.float32))
    parameters = CHOICES["visibility"].parameters(num_disparities=41)
    occluded = CHOICES["visibility"].run(light_field, before, parameters, no_progress).extra["occluded"]
    # two views away, the near plane has moved by 4 px to the left, and the far one by 2 to the right
    assert occluded[6:-6, EDGE - 6 : EDGE].mean() > 0.9
    assert occluded[6:-6, 4 : EDGE - 8].mean() < 0.02
    assert occluded[6:-6, EDGE + 2 : -6].mean() < 0.02
