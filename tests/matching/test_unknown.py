"""Which pixels count as unknown: a surface that nobody saw must not pass for depth, nor a bare wall for nothing."""

from pathlib import Path

import cv2
import numpy as np
import pytest

from sepi.io.readers.options import ReadOptions
from sepi.lightfield import DisparityRange, LightField
from sepi.matching.unknown import held_by_few, unknown_pixels, with_unknown
from sepi.pipeline import estimate_depth
from sepi.reading import read_light_field
from sepi.stage import StageMaps
from sepi.variants import VARIANTS, needing_files

H, W = 72, 96
Y, X = np.mgrid[:H, :W]
DISC = (Y - 36) ** 2 + (X - 40) ** 2 <= 20**2
# outside of the circle that a lens lights: four corners
CORNERS = (Y - 35.5) ** 2 + (X - 47.5) ** 2 > 46**2
KINDS = [(np.uint8, 3), (np.uint8, 1), (np.uint16, 3), (np.float32, 1)]


def texture(low: float = 0.3, high: float = 0.9) -> np.ndarray:
    return np.random.default_rng(0).uniform(low, high, (H, W))


def light_field(
    picture: np.ndarray, noise: float = 0, kind: type = np.uint8, channels: int = 3, offset: float = 0
) -> LightField:
    """Nine equal views of a picture (H, W) or (H, W, 3) in 0..1, each with noise of its own: all at disparity 0."""
    colours = picture if picture.ndim == 3 else np.repeat(picture[..., None], channels, axis=2)
    views = np.broadcast_to(colours, (3, 3, *colours.shape)) + offset
    views = np.clip(views + np.random.default_rng(1).normal(0, noise, views.shape), 0, 1)
    if kind is np.float32:
        return LightField(views.astype(np.float32), "made", disparity_range=DisparityRange(-1, 1, "given"))
    levels = np.rint(views * np.iinfo(kind).max).astype(kind)
    return LightField(levels, "made", disparity_range=DisparityRange(-1, 1, "given"))


def unknown_in(scene: LightField) -> np.ndarray:
    return unknown_pixels(scene, np.zeros(scene.shape, np.float32))


@pytest.mark.parametrize(("kind", "channels"), KINDS)
def test_a_black_background_is_unknown_to_the_pixel(kind: type, channels: int) -> None:
    """Whoever cuts objects out of the dark by this mask gets their outlines, in every number type."""
    scene = light_field(np.where(DISC, texture(), 0), kind=kind, channels=channels)
    np.testing.assert_array_equal(unknown_in(scene), ~DISC)


@pytest.mark.parametrize("noise", [1 / 255, 3 / 255, 8 / 255])
@pytest.mark.parametrize(("kind", "channels"), KINDS)
def test_noise_does_not_hide_a_black_background(noise: float, kind: type, channels: int) -> None:
    """A real camera's black is never 0; nor must noise on an object make it unknown."""
    found = unknown_in(light_field(np.where(DISC, texture(), 0), noise, kind, channels))
    assert (found[~DISC]).mean() > 0.97
    assert not found[DISC].any()


def test_few_bits_in_many_are_no_darkness() -> None:
    """12 bits stored as 16 make a whole picture dark; none of it is unknown but what is dark within it."""
    scene = light_field(np.where(DISC, texture(), 0) / 16, kind=np.uint16)
    np.testing.assert_array_equal(unknown_in(scene), ~DISC)


@pytest.mark.parametrize("noise", [0, 2 / 255])
def test_overexposed_sky_is_unknown(noise: float) -> None:
    sky = np.where(Y < 30, 1.2, texture(0.2, 0.8))
    found = unknown_in(light_field(np.clip(sky, 0, 1.1), noise=noise))
    assert found[:30].mean() > 0.97
    assert not found[30:].any()


def test_a_surface_of_full_colour_is_known() -> None:
    """A red car has its depth: overexposed is what is at full scale in all channels."""
    picture = np.repeat(texture(0.2, 0.8)[..., None], 3, axis=2)
    picture[:30] = 1, 0.2, 0.2
    assert not unknown_in(light_field(picture)).any()


@pytest.mark.parametrize("level", [0.03, 0.5, 0.98])
@pytest.mark.parametrize("noise", [0, 2 / 255])
def test_a_bare_wall_between_known_borders_is_known(level: float, noise: float) -> None:
    """Its border tells its depth, and planes are put there rightly, be it dark, grey or white."""
    wall = (np.abs(Y - 36) < 25) & (np.abs(X - 48) < 35)
    assert not unknown_in(light_field(np.where(wall, level, texture(0.1, 0.95)), noise)).any()


def test_a_small_black_thing_belongs_to_what_it_is_on() -> None:
    dot = (np.abs(Y - 30) < 4) & (np.abs(X - 40) < 3)
    assert not unknown_in(light_field(np.where(dot, 0, texture()))).any()


@pytest.mark.parametrize("kind", [np.uint8, np.uint16])
def test_a_dark_textured_object_is_known(kind: type) -> None:
    """A black cat before a bright wall: a few grey levels of texture are enough for its depth."""
    cat = np.where(DISC, texture(0, 8 / 255), texture())
    assert not unknown_in(light_field(cat, kind=kind)).any()


@pytest.mark.parametrize(("noise", "offset"), [(0, 0), (1.5 / 255, 0), (1.5 / 255, 6 / 255), (3 / 255, 6 / 255)])
def test_the_corners_that_a_lens_leaves_dark_are_unknown(noise: float, offset: float) -> None:
    """Stray light lifts them above black, noise makes them uneven; depth there is as void as ever."""
    found = unknown_in(light_field(np.where(CORNERS, 0, texture(0.1)), noise, offset=offset))
    # thin ends of the corners, where the circle meets the sides, may be left
    thick = cv2.morphologyEx(CORNERS.astype(np.uint8), cv2.MORPH_OPEN, np.ones((7, 7), np.uint8)) > 0
    assert found[thick].mean() > 0.97
    assert not found[~CORNERS].any()


# --- beyond the other views


def test_what_hardly_any_other_view_holds_is_unknown() -> None:
    """At a camera's step of half a picture the outer views hold nothing of it; a match there is chance."""
    scene = light_field(texture())
    corner = scene.seen_from((0, 0))
    disparity = np.full((H, W), 60, np.float32)
    # from the corner view, everything moves up and left by 60 pixels a step
    expected = np.zeros((H, W), bool)
    for y, x in np.ndindex(H, W):
        held = [(t, s) for t in range(3) for s in range(3) if (t, s) != (0, 0) and y >= 60 * t and x >= 60 * s]
        expected[y, x] = len(held) < 2
    found = held_by_few(corner, disparity)
    assert (found != expected).mean() < 0.02  # the outermost half pixel
    assert 0.2 < found.mean() < 0.95
    assert not held_by_few(corner, np.full((H, W), 5, np.float32))[10:, 10:].any()


def test_missing_views_hold_nothing() -> None:
    scene = light_field(texture())
    present = np.zeros((3, 3), bool)
    present[1, 1] = present[1, 2] = present[1, 0] = True
    row = LightField(scene.views, "row", present=present)
    found = held_by_few(row, np.full((H, W), 10, np.float32))
    np.testing.assert_array_equal(found, np.broadcast_to((X < 10) | (X > W - 11), (H, W)))


@pytest.mark.parametrize("nothing", [np.nan, np.inf])
def test_what_has_no_disparity_is_held_by_no_view(nothing: float) -> None:
    """Maps of other programs have holes: one of them must not stop everything, nor pass for known."""
    scene = light_field(texture())
    disparity = np.full((H, W), 5, np.float32)
    disparity[30:34, 20:30] = nothing
    found = held_by_few(scene, disparity)
    np.testing.assert_array_equal(found[10:-10, 10:-10], ~np.isfinite(disparity)[10:-10, 10:-10])


# --- in the final maps


@pytest.mark.parametrize("variant", [name for name in VARIANTS if name not in needing_files()])
def test_every_variant_tells_what_is_unknown_and_changes_no_depth(variant: str) -> None:
    scene = light_field(np.where(DISC, texture(), 0))
    few = {} if variant == "no_sepi" else {"initial": {"num_disparities": 11}}
    maps = estimate_depth(scene, variant, few)
    unknown = maps.extra["unknown"]
    assert unknown.dtype == bool
    assert unknown[~DISC].all()
    assert not maps.confidence[unknown].any()
    assert maps.confidence[DISC].mean() > 0.1
    assert np.isfinite(maps.disparity).all()


def test_marking_leaves_all_else_as_it_was() -> None:
    scene = light_field(np.where(DISC, texture(), 0))
    before = StageMaps(texture().astype(np.float32), texture().astype(np.float32), {"occluded": DISC})
    after = with_unknown(scene, before)
    np.testing.assert_array_equal(after.disparity, before.disparity)
    np.testing.assert_array_equal(after.confidence[DISC], before.confidence[DISC])
    assert after.confidence.dtype == np.float32
    assert after.extra.keys() == {"occluded", "unknown"}


# --- real light fields


def real_mask(real_data: Path, name: str, **options: object) -> tuple[np.ndarray, np.ndarray]:
    """Unknown pixels of a real light field, and its reference view's brightness."""
    if not (real_data / name).exists():
        pytest.skip(f"real light field not found at {real_data / name}")
    scene = read_light_field(real_data / name, options=ReadOptions(**options), check_order=False)
    known = np.zeros(scene.shape, np.float32) if scene.ground_truth is None else scene.ground_truth
    return unknown_pixels(scene, known), scene.reference_view.max(axis=2)


@pytest.mark.parametrize("name", ["hci_new/cotton", "hci_new/antinous", "real/t_rex", "real/legoknights3"])
def test_pictures_that_are_seen_all_over_have_no_unknown_pixels(real_data: Path, name: str) -> None:
    """Dark floor, black helmets and white paper are surfaces: their depth must stay in the cloud."""
    found, _ = real_mask(real_data, name)
    assert not found.any()


def test_what_surrounds_a_glow_in_the_dark_is_unknown(real_data: Path) -> None:
    """Two glowing things in the dark: all but them, and their glow, is a guess."""
    found, brightness = real_mask(real_data, "real/seahorse5/camImagesFlat")
    assert 0.9 < found.mean() < 0.96
    assert not found[brightness > 0.1].any()


def test_a_lenss_dark_corners_are_unknown(real_data: Path) -> None:
    found, brightness = real_mask(real_data, "lytro/2067")
    assert found[[0, 0, -1, -1], [0, -1, 0, -1]].all()
    assert 0.02 < found.mean() < 0.03
    H, W = found.shape
    y, x = np.mgrid[:H, :W]
    assert not found[np.hypot((y - H / 2) / H, (x - W / 2) / W) < 0.5].any()
    assert (found | (brightness > 0)).mean() > 0.998
