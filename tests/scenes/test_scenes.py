"""Built-in scenes: pictures, ground truth and masks must agree, or every score made from them is wrong."""

from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from geometries import grid_baselines, standing
from remembered_scenes import remembered
from scipy import ndimage

from sepi.errors import SepiError
from sepi.lightfield import LightField
from sepi.reading import read_light_field
from sepi.scenes import SCENES, definitions, rendering, write_hci
from sepi.scenes.definitions import (
    DEFINITIONS,
    PERIOD,
    Plane,
    Surface,
    blob,
    everywhere,
    noise,
    photograph,
    rectangle,
    shading,
)

# as it is drawn: the tests' other modules have it from a file
from sepi.scenes.light_field import read_truth, render, true_disparity

SIZE, VIEWS = 96, 5


@contextmanager
def small_textures() -> Iterator[None]:
    """Textures that repeat after 128 texels: most of the time of a small picture goes into them."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(definitions, "PERIOD", 128)
        yield


@remembered
@small_textures()
def small_textured(name: str, *, period: int, **given: Any) -> LightField:
    """A scene with small textures, which its name in the tests' files has to tell."""
    assert period == definitions.PERIOD
    return render(name, **given)


@cache
def scene(name: str, geometry: str = "grid") -> LightField:
    return small_textured(name, period=128, size=SIZE, views=VIEWS, **standing(geometry, (VIEWS, VIEWS)))


@pytest.fixture(name="small_textures")
def with_small_textures() -> Iterator[None]:
    with small_textures():
        yield


@contextmanager
def unpainted() -> Iterator[None]:
    """Scenes of one grey: outlines and planes as they are. No picture may be drawn meanwhile that others look at."""
    with pytest.MonkeyPatch.context() as patch:
        for texture in ("noise", "photograph", "shading"):
            patch.setattr(definitions, texture, lambda *_, **__: np.full((8, 8, 3), 0.5, np.float32))
        yield


def steps(light_field: LightField) -> list[tuple[int, int, float, float]]:
    """Grid position of every view but the centre, and its steps down and right from there."""
    (T, S), centre = light_field.grid, light_field.reference_position
    return [(t, s, *light_field.baselines[t, s]) for t in range(T) for s in range(S) if (t, s) != centre]


def warp_error(light_field: LightField, offset: float) -> float:
    """Mean difference in grey levels between the centre view and the views where truth + offset says a point is."""
    d = light_field.ground_truth.astype(float) + offset
    y, x = np.mgrid[: d.shape[0], : d.shape[1]]
    # pixels that mix two surfaces have no one disparity
    step = ndimage.maximum_filter(light_field.ground_truth, 5) - ndimage.minimum_filter(light_field.ground_truth, 5)
    usable = ~ndimage.binary_dilation(light_field.masks["occluded"], iterations=2)
    usable &= ~light_field.masks["textureless"] & (step < 0.6)
    centre = light_field.views[light_field.reference_position].astype(float)
    errors = []
    for number, (t, s, dt, ds) in enumerate(steps(light_field)):
        at_y, at_x = y - d * dt, x - d * ds
        inside = usable & (np.minimum(at_y, at_x) > 2) & (np.maximum(at_y, at_x) < d.shape[0] - 3)
        # of each view one channel, in turn
        values = light_field.views[t, s, ..., number % 3].astype(float)
        seen = ndimage.map_coordinates(values, [at_y[inside], at_x[inside]], order=3, mode="nearest")
        errors.append(np.abs(seen - centre[inside, number % 3]))
    return float(np.concatenate(errors).mean())


@pytest.mark.parametrize(
    ("name", "geometry"),
    [(name, "grid") for name in SCENES if name != "dots"]
    + [("curved_occluders", "closer rows"), ("curved_occluders", "off the grid")],
)
def test_every_view_shows_the_centre_view_where_the_truth_says(name: str, geometry: str) -> None:
    """A wrong sign, axis or half pixel in truth or views would make a perfect method look bad."""
    shown = scene(name, geometry)
    at_truth = warp_error(shown, 0.0)
    assert at_truth < 2.0
    assert warp_error(shown, 0.02) > at_truth
    assert warp_error(shown, -0.02) > at_truth


@pytest.mark.usefixtures("small_textures")
def test_the_layout_of_the_benchmark_takes_even_grids_only(tmp_path: Path) -> None:
    """Who read such a folder would get a wrong depth: it cannot say where the views stand."""
    with pytest.raises(SepiError, match=r"wall: the layout .* even spacing"):
        write_hci(render("wall", size=64, views=2, row_spacing=0.5), tmp_path / "wall")
    assert not (tmp_path / "wall").exists()


def test_a_plane_of_disparity_one_moves_by_whole_pixels() -> None:
    light_field = scene("fronto_parallel")
    assert (light_field.ground_truth == 1).all()
    centre = light_field.views[light_field.reference_position]
    inner = slice(3, SIZE - 3)
    for t, s, dt, ds in steps(light_field):
        shifted = np.roll(light_field.views[t, s], (int(dt), int(ds)), axis=(0, 1))
        np.testing.assert_array_equal(shifted[inner, inner], centre[inner, inner])


def test_slanted_plane_is_linear_at_pixel_centres() -> None:
    y, x = (np.mgrid[:SIZE, :SIZE] + 0.5) / SIZE - 0.5
    np.testing.assert_allclose(scene("slanted_plane").ground_truth, 1.6 * x - 0.8 * y, atol=1e-6)


@pytest.mark.usefixtures("small_textures")
@pytest.mark.parametrize("name", list(SCENES))
def test_the_same_scene_is_the_same_bytes_each_time(name: str) -> None:
    first, second = (render(name, size=64, views=3) for _ in range(2))
    assert first.views.tobytes() == second.views.tobytes()
    assert first.ground_truth.tobytes() == second.ground_truth.tobytes()
    assert all(first.masks[key].tobytes() == second.masks[key].tobytes() for key in first.masks)


FINE = 5


def z_buffered(name: str, geometry: str) -> np.ndarray:
    """Occluded pixels by brute force: the ground truth at five times the resolution, splatted into every view."""
    with unpainted():
        drawn = rendering.drawing(DEFINITIONS[name].surfaces(), FINE * SIZE)
    drawn = drawn._replace(planes=drawn.planes * FINE)
    d, _ = rendering.visible(drawn, FINE * SIZE)
    y, x = np.mgrid[: d.shape[0], : d.shape[1]]
    centres = slice(FINE // 2, None, FINE)
    hidden = np.zeros((SIZE, SIZE), bool)
    for _, _, dt, ds in steps(scene(name, geometry)):
        at_y, at_x = np.rint(y - d * dt).astype(int), np.rint(x - d * ds).astype(int)
        inside = (np.minimum(at_y, at_x) >= 0) & (np.maximum(at_y, at_x) < d.shape[0])
        at = np.where(inside, at_y * d.shape[1] + at_x, d.size)
        nearest = np.full(d.size + 1, -np.inf)
        np.maximum.at(nearest, at[inside], d[inside])
        # the tolerance is what a slanted surface changes within a fine pixel
        hidden |= nearest[at[centres, centres]] > d[centres, centres] + 0.15 * FINE
    return hidden


@pytest.mark.parametrize(
    ("name", "geometry"),
    [(name, "grid") for name in SCENES] + [("curved_occluders", "closer rows"), ("curved_occluders", "off the grid")],
)
def test_occlusion_mask_agrees_with_a_z_buffer_of_the_truth(name: str, geometry: str) -> None:
    """A z-buffer rounds positions, so it may differ next to a boundary of the mask, and nowhere else."""
    mask, hidden = scene(name, geometry).masks["occluded"], z_buffered(name, geometry)
    around = np.ones((3, 3))
    # both, for a band so thin that one of them has lost it
    boundary = [ndimage.binary_dilation(m, around) & ~ndimage.binary_erosion(m, around) for m in (mask, hidden)]
    frame = np.ones(mask.shape, bool)
    frame[4:-4, 4:-4] = False  # what enters a view from outside the centre view is unknown to a z-buffer
    assert not ((hidden != mask) & ~boundary[0] & ~boundary[1] & ~frame).any()
    assert (hidden == mask).mean() > 0.96


def test_square_before_a_plane_hides_exactly_the_ring_around_it() -> None:
    square = rectangle(0.25, 0.25, 0.5, 0.5)
    grey = shading((0.5, 0.5, 0.5), 0.0)
    drawn = rendering.drawing([Surface([everywhere()], Plane(0.0), grey), Surface([square], Plane(1.0), grey)], 64)
    disparity, owner = rendering.visible(drawn, 64)
    inside = np.zeros((64, 64), bool)
    inside[16:32, 16:32] = True
    np.testing.assert_array_equal(owner == 1, inside)
    expected = ndimage.binary_dilation(inside, np.ones((3, 3))) & ~inside
    np.testing.assert_array_equal(rendering.occluded(drawn, disparity, grid_baselines((3, 3))), expected)


def test_what_leaves_the_picture_is_not_occluded() -> None:
    """Nobody can see there, so no method can be asked to know it."""
    grey = shading((0.5, 0.5, 0.5), 0.0)
    strip = rectangle(-1, -1, 1.5 / 64, 2)  # ends at x = 1 in the centre view and at x = 7 in the view to its left
    drawn = rendering.drawing([Surface([everywhere()], Plane(-3.0), grey), Surface([strip], Plane(6.0), grey)], 64)
    disparity, _ = rendering.visible(drawn, 64)
    hidden = rendering.occluded(drawn, disparity, grid_baselines((3, 3)))
    # the plane's column x is at x - 3 in that view: up to column 9 hidden, but columns 1 and 2 outside
    np.testing.assert_array_equal(hidden[8:-8].all(axis=0), (np.arange(64) >= 3) & (np.arange(64) <= 9))
    assert not hidden[:, 1:3].any()


def test_edge_pixels_are_a_mixture() -> None:
    """Without anti-aliasing an edge would jump by whole pixels between views."""
    white, black = np.ones((8, 8, 3), np.float32), np.zeros((8, 8, 3), np.float32)
    half = Surface([rectangle(32.25 / 64, -1, 2, 2)], Plane(0.5), white)
    drawn = rendering.drawing([Surface([everywhere()], Plane(0.0), black), half], 64)
    centre, right = rendering.render_view(drawn, 64, 0, 0), rendering.render_view(drawn, 64, 0, 1)
    np.testing.assert_allclose(centre[5, 30:35, 0], [0, 0, 0.75, 1, 1], atol=1e-6)
    np.testing.assert_allclose(right[5, 30:35, 0], [0, 0.25, 1, 1, 1], atol=1e-6)


def test_textureless_mask_is_the_bare_wall() -> None:
    light_field = scene("wall")
    bare = light_field.masks["textureless"]
    assert 0.2 < bare.mean() < 0.6
    values = light_field.reference_view[ndimage.binary_erosion(bare, iterations=2)]
    assert values.std(axis=0).max() < 0.015
    with unpainted():
        assert not any(read_truth(name, SIZE, 2)[1]["textureless"].any() for name in SCENES if name != "wall")


@pytest.mark.parametrize("name", list(SCENES))
def test_range_encloses_the_truth_with_a_margin_in_tenths(name: str) -> None:
    light_field = scene(name)
    known = light_field.require_disparity_range()
    assert known.source == "parameters"
    assert known.minimum <= light_field.ground_truth.min() - 0.199
    assert known.maximum >= light_field.ground_truth.max() + 0.199
    assert known.maximum - known.minimum < max(2.3, np.ptp(light_field.ground_truth) + 0.6)
    assert (known.minimum, known.maximum) == (round(known.minimum, 1), round(known.maximum, 1))


@pytest.mark.usefixtures("small_textures")
@pytest.mark.parametrize("views", [2, 4])
def test_even_grids_have_their_centre_at_the_lower_right_of_the_middle(views: int) -> None:
    even, odd = render("pyramids", size=64, views=views), render("pyramids", size=64, views=3)
    assert even.grid == (views, views)
    np.testing.assert_array_equal(even.views[even.reference_position], odd.views[odd.reference_position])


def test_shapes_grow_with_the_picture_and_disparities_stay() -> None:
    with unpainted():
        small, large = render("curved_occluders", size=64, views=2), render("curved_occluders", size=129, views=2)
    assert large.shape == (129, 129)
    at = np.rint((np.arange(64) + 0.5) / 64 * 129 - 0.5).astype(int)
    assert (np.abs(large.ground_truth[np.ix_(at, at)] - small.ground_truth) < 0.05).mean() > 0.95


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"name": "piramids"}, "did you mean 'pyramids'.*fronto_parallel"),
        ({"name": "wall", "size": 63}, "scene wall: size .* 64 to 1024, got 63"),
        ({"name": "wall", "views": 1}, "scene wall: views .* from 2"),
        ({"name": "dots", "row_spacing": 0.0}, "dots: row_spacing must be a positive number, got 0"),
        ({"name": "dots", "positions": np.zeros((3, 3, 2))}, r"dots: positions .* \(9, 9, 2\), got .* \(3, 3, 2\)"),
    ],
)
def test_bad_arguments_are_named(arguments: dict, message: str) -> None:
    with pytest.raises(SepiError, match=message):
        render(**arguments)


def test_textures_repeat_without_a_seam_and_keep_their_mean() -> None:
    """A seam would be an edge that no surface has."""
    for texture in (noise(5, (0.3, 0.5, 0.6), 0.12)(), photograph("brick", (1.0, 0.9, 0.8), seed=2)()):
        assert texture.shape == (PERIOD, PERIOD, 3)
        inside = np.abs(np.diff(texture, axis=0)).mean()
        assert np.abs(texture[0] - texture[-1]).mean() < 1.5 * inside
    np.testing.assert_allclose(noise(5, (0.3, 0.5, 0.6), 0.12)().mean(axis=(0, 1)), (0.3, 0.5, 0.6), atol=0.01)


def test_hole_shows_what_is_behind() -> None:
    grey = shading((0.5, 0.5, 0.5), 0.0)
    ring = Surface([blob(0.5, 0.5, 0.4), blob(0.5, 0.5, 0.2)], Plane(1.0), grey)
    _, owner = rendering.visible(rendering.drawing([Surface([everywhere()], Plane(0.0), grey), ring], 64), 64)
    assert owner[32, 32] == 0
    assert owner[32, 51] == 1
    assert owner.mean() == pytest.approx(np.pi * (0.4**2 - 0.2**2), rel=0.02)


@pytest.mark.usefixtures("small_textures")
@pytest.mark.parametrize("name", ["wall", "curved_occluders"])
def test_folder_is_read_back_exactly(name: str, tmp_path: Path) -> None:
    """Scores of a written scene must be those of the built-in one."""
    light_field = render(name, size=64, views=4)
    write_hci(light_field, tmp_path / name)
    back = read_light_field(tmp_path / name)
    np.testing.assert_array_equal(back.views, light_field.views)
    np.testing.assert_array_equal(back.ground_truth, light_field.ground_truth)
    assert (back.name, back.disparity_range) == (light_field.name, light_field.disparity_range)
    assert set(back.masks) == set(light_field.masks)
    for key, mask in light_field.masks.items():
        np.testing.assert_array_equal(back.masks[key], mask)


def test_truth_of_another_view_is_where_the_centre_views_points_are_seen() -> None:
    """Maps of other views would be scored against the truth of another place."""
    light_field = scene("curved_occluders")
    with unpainted():
        np.testing.assert_array_equal(true_disparity("curved_occluders", size=SIZE), light_field.ground_truth)
    truth = light_field.ground_truth.astype(float)
    y, x = np.nonzero(~light_field.masks["occluded"])
    for t, s in ((0, 0), (1, 4), (3, 2)):
        down, across = light_field.baselines[t, s]
        there = true_disparity("curved_occluders", size=SIZE, baseline=(down, across))
        at = np.rint([y - truth[y, x] * down, x - truth[y, x] * across]).astype(int)
        inside = ((at >= 0) & (at < SIZE)).all(axis=0)
        error = np.abs(there[tuple(at[:, inside])] - truth[y, x][inside])
        # rounding to a pixel: a slope of 0.8 over the picture, and outlines
        assert np.median(error) < 0.01
        assert (error > 0.1).mean() < 0.05
        moved_wrongly = np.rint([y + truth[y, x] * down, x + truth[y, x] * across]).astype(int).clip(0, SIZE - 1)
        assert (np.abs(there[tuple(moved_wrongly)] - truth[y, x]) > 0.1).mean() > 0.08
