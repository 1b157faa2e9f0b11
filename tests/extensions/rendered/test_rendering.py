"""Path-traced scenes: pictures, truth and masks must agree, or every score made from them is wrong."""

import importlib.util
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from error_lines import done
from scipy import ndimage
from small_worlds import CAMERAS, ball, bar, depth_of_room, lamp_above, room, taking

import sepi
from sepi.cli.main import main
from sepi.errors import SepiError
from sepi.extensions.rendered import patterns, shapes, tracing
from sepi.extensions.rendered.exposure import READ, WHITE, Exposure, exposed
from sepi.extensions.rendered.render_file import MASKS, Render, masks_in, read_render, seen_bits
from sepi.extensions.rendered.rendering import render_world
from sepi.extensions.rendered.sampling import pictured, planned
from sepi.extensions.rendered.surfaces import FirstSurface, raster_of
from sepi.extensions.rendered.tracing import Tracer
from sepi.extensions.rendered.world import Light, Material, Rig, Sun, Thing, World
from sepi.extensions.rendered.worlds import RENDERED, world_of
from sepi.scenes.folder import write_hci
from sepi.workflow.rendered_scenes import NOISE_LEVELS


def rendered(folder: Path, world: World, **values: object) -> Render:
    path = folder / "room.h5"
    path.unlink(missing_ok=True)
    render_world("room", world, taking(**values), path)
    return read_render(path)


@pytest.fixture(scope="module")
def plain(tmp_path_factory: pytest.TempPathFactory) -> Render:
    """A wall and a floor, evenly lit."""
    return rendered(tmp_path_factory.mktemp("room"), room(), size=96, samples=9)


def steps(render: Render) -> list[tuple[int, int]]:
    rows, columns = render.views.shape[:2]
    return [(t, s) for t in range(rows) for s in range(columns) if (t, s) != render.centre]


def carried(values: np.ndarray, render: Render, view: tuple[int, int]) -> np.ndarray:
    """What another view has at the points that the reference view sees; NaN outside."""
    d = render.disparity[render.centre].astype(float)
    y, x = np.mgrid[: d.shape[0], : d.shape[1]]
    down, across = render.positions[view]
    at = [y - d * down, x - d * across]
    return ndimage.map_coordinates(values.astype(float), at, order=1, mode="constant", cval=np.nan)


def test_planes_have_the_disparity_of_their_formula(plain: Render) -> None:
    rig = Rig(room(), 96, (3, 3))
    expected = rig.disparity(depth_of_room(96, rig.focal_px))
    # but for the row in which they meet
    assert (
        np.abs(plain.disparity[plain.centre] - expected)[np.abs(np.arange(96) - 48 - rig.focal_px / 5) > 1].max() < 1e-4
    )
    assert rig.disparity(np.array([1.2, 3.0])) == pytest.approx([2.0, -1.5])


def test_truth_of_every_view_is_of_the_same_points(plain: Render) -> None:
    """If this fails, the truth of some view is not where its picture is."""
    for view in steps(plain):
        apart = np.abs(carried(plain.disparity[view], plain, view) - plain.disparity[plain.centre])
        # across the line where wall and floor meet there is nothing to interpolate
        assert np.nanquantile(apart, 0.95) < 1e-3
        turned = carried(plain.normal[view][..., 1], plain, view) - plain.normal[plain.centre][..., 1]
        assert np.nanquantile(np.abs(turned), 0.95) < 1e-3
    assert plain.normal[plain.centre][5, 5].tolist() == [0, 0, -1]
    assert plain.normal[plain.centre][90, 5].tolist() == [0, -1, 0]


def test_points_have_one_colour_in_all_views(tmp_path: Path) -> None:
    """By the light of a sun alone, which leaves no noise of paths."""
    sun = Sun((0.3, 0.6, 1.0), (4.0, 4.0, 4.0))
    sunny = room(light=Light(suns=[sun], exposure=0.7, depth=2))
    render = rendered(tmp_path, sunny, size=96, samples=4)
    light_field = exposed(render, Exposure())
    centre = light_field.views[light_field.reference_position].astype(float)
    assert 40 < np.median(centre) < 200
    for view in steps(render):
        seen = np.stack([carried(light_field.views[view][..., c], render, view) for c in range(3)], axis=-1)
        assert np.nanmedian(np.abs(seen - centre)) <= 1


def test_the_folder_is_as_the_benchmark_lays_it_out(plain: Render, tmp_path: Path) -> None:
    write_hci(exposed(plain, Exposure()), tmp_path / "room", plain.settings)
    light_field = sepi.read_light_field(tmp_path / "room")
    rig = Rig(room(), 96, (3, 3))
    depth = light_field.camera.depth(light_field.ground_truth)
    assert np.allclose(depth[:40], 3.0, rtol=1e-4)
    assert np.allclose(depth[90:], depth_of_room(96, rig.focal_px)[90:], rtol=1e-4)
    known = light_field.require_disparity_range()
    assert known.source == "parameters"
    assert known.minimum == -1.5
    # signs, and the order of the grid
    result = CliRunner().invoke(main, ["check", str(tmp_path / "room")])
    assert (result.exit_code, "wrong" in result.output) == (0, False), result.output
    estimate = sepi.estimate_depth(light_field, "fast").disparity
    assert np.median(np.abs(estimate - light_field.ground_truth)) < 0.02


def test_no_number_of_threads_changes_a_picture() -> None:
    """Mitsuba makes blocks smaller for many threads, and seeds each: machines with many cores had other bytes."""
    import drjit

    world = room()
    tracer = Tracer(world, Rig(world, 48, (1, 1)))
    at = tracer.position(0, 0)
    found = []
    for threads in (1, 16):
        drjit.set_thread_count(threads)
        found.append(tracer.picture(at, 3, 2))
    drjit.set_thread_count(1)
    assert np.array_equal(*found)


def test_paths_are_traced_where_views_differ() -> None:
    """A matte room takes few, a mirror all; a bar too thin for the rays through middles is not painted over."""
    world = room(ball(0.3, Material(kind="mirror")), bar(depth=1.5, width=0.01))
    size, samples = 64, 64
    rig = Rig(world, size, (9, 9))
    tracer = Tracer(world, rig)
    at = tracer.position(0, 0)
    seen = tracer.surfaces.first(at)
    passes, _, whole = planned(tracer, at, seen, samples, 0)
    taken = np.zeros((size, size), int)
    for pixels, before, paths, _ in passes:
        where = pixels[..., 0], pixels[..., 1]
        assert (taken[where] <= samples + before).all()
        taken[where] = before + paths
    shown, mirror = pictured(passes, size), seen.thing == 2
    # a tile of another kind may hold some of the mirror's border
    inside = ndimage.minimum_filter(mirror, 3)
    assert set(np.unique(taken[inside])) == {samples}
    assert set(np.unique(taken[~whole])) <= {12, samples}
    assert (taken == 3).mean() > 0.5
    assert taken.mean() < samples / 4
    # tiles lie where they belong
    many = tracer.picture(at, 9, 64)
    assert np.corrcoef(shown[mirror].ravel(), many[mirror].ravel())[0, 1] > 0.9
    assert abs(shown.mean() / many.mean() - 1) < 0.03
    # the bar is a quarter of a pixel wide and stands between the middle columns
    assert not whole[:20, 31:33].any()
    # the wall is whole up to what stands before it, but for the pixels that show both
    beside = ndimage.maximum_filter(mirror, 3) & ~mirror
    assert whole[beside].any()


def test_masks_say_what_a_pixel_shows(tmp_path: Path) -> None:
    """A bar, and balls of mirror, glass and lacquer; the bar hides the wall behind it as geometry says."""
    lacquer = ball(0.0, Material((0.7, 0.1, 0.1), "glossy", 0.1), y=0.55, radius=0.35)
    balls = [ball(-0.45, Material(kind="mirror")), ball(0.45, Material(kind="glass")), lacquer]
    world = room(bar(depth=1.5, width=0.06), *balls)
    render = rendered(tmp_path, world, size=96, samples=1)
    masks = masks_in(render.masks[render.centre])
    assert list(masks) == list(MASKS)
    rig = Rig(world, 96, (3, 3))
    d_bar, d_wall = rig.disparity(np.array([1.5, 3.0]))
    # the row lies above the balls: a bar of 0.06 m, and the wall
    half = rig.focal_px * 0.03 / 1.5
    columns = np.abs(np.arange(96) + 0.5 - 48) < half
    assert (masks["thin"][10] == columns).all()
    hidden = masks["occluded"][10]
    reach = half + d_bar - d_wall
    from_middle = np.abs(np.arange(96) + 0.5 - 48)
    assert not hidden[from_middle > reach + 1].any()
    assert hidden[(from_middle > half + 1) & (from_middle < reach - 1)].all()
    assert not hidden[columns].any()
    for name, x in (("mirror", -0.45), ("glass", 0.45)):
        column = round(48 + rig.focal_px * x / 1.9)
        assert masks[name][round(48 + rig.focal_px * 0.3 / 1.9), column]
        assert not (masks[name] & (masks["textured"] | masks["textureless"])).any()
    assert masks["glossy"].any()
    # painted walls are textured, lacquer of one colour is not
    assert masks["textured"][3, 3]
    assert (masks["glossy"] & masks["textureless"]).sum() > 0.4 * masks["glossy"].sum()
    assert not masks["alone"].any()


def test_what_one_view_alone_sees_is_told() -> None:
    """A wall seen through a slit: the columns beside it are hidden from the one view, those that leave it are not."""
    disparities = np.zeros((2, 4, 12), np.float32)
    # the other view stands two steps to the right, and a board of disparity 2 before it hides columns 4 to 7
    disparities[1, :, 4:8] = 2
    positions = np.array([(0, 0), (0, 2)], float)
    bits = seen_bits(disparities, positions)[0]
    for name in ("occluded", "alone"):
        # all of them, whether a mirror would swap right and left or not
        assert masks_in(bits)[name][1].nonzero()[0].tolist() == [4, 5, 6, 7]
    # what lies outside the other picture is hidden by nothing, and seen by nobody else
    shifted = seen_bits(np.ones((2, 4, 12), np.float32), positions)[0]
    assert not masks_in(shifted)["occluded"].any()
    assert masks_in(shifted)["alone"][1].nonzero()[0].tolist() == [0, 1]


def test_noise_is_that_of_the_stated_sensor(plain: Render) -> None:
    """Electrons' variance is their number and what reading adds; a scene with a tenth of the light has a tenth."""
    linear = Exposure(gamma=1.0, bits=16)
    clean = exposed(plain, linear).views / 65535
    for level in NOISE_LEVELS[1:]:
        for light in (1.0, 0.1):
            dim = Render(**{**vars(plain), "light": light})
            noisy = exposed(dim, linear.model_copy(update={"noise": level})).views / 65535
            inside = (clean > 0.1) & (clean < 0.15)
            expected = np.sqrt(clean[inside].mean() / (WHITE[level] * light) + (READ / WHITE[level] / light) ** 2)
            # of what is not cut off at black and white
            if light == 1.0:
                assert (noisy - clean)[inside].std() == pytest.approx(expected, rel=0.03)
                assert abs((noisy - clean)[inside].mean()) < expected / 50
            else:
                assert (noisy - clean)[inside].std() > 2.0 * expected / np.sqrt(10)
    again, other = (exposed(plain, Exposure(noise="low", noise_seed=seed)) for seed in (1, 2))
    assert np.array_equal(again.views, exposed(plain, Exposure(noise="low")).views)
    assert not np.array_equal(again.views, other.views)
    assert (again.name, other.name, exposed(plain, Exposure()).name) == ("room_low", "room_low_2", "room")


def test_a_lens_blurs_what_is_out_of_focus(tmp_path: Path) -> None:
    """Across the edge of a bar before the wall the blur is as wide as its disparity says, and none is in focus."""
    widths = {}
    for depth in (1.2, 1.92253):
        world = room(bar(depth=depth, width=0.5, material=Material((0.9, 0.9, 0.9))))
        render = rendered(tmp_path, world, size=128, views=1, samples=32, lens=2.0)
        row = render.views[0, 0][30].astype(float).mean(axis=-1)
        edge = (row[64:] - row[-10]) / (row[64] - row[-10])
        widths[depth] = np.flatnonzero(edge < 0.25)[0] - np.flatnonzero(edge < 0.75)[0]
    # a disc of 2 lens |d| = 8 pixels goes from a quarter to three of them in 0.4 of its width
    assert 2 <= widths[1.2] <= 4
    assert widths[1.92253] <= 1


def test_errors_of_cameras_move_pictures_and_not_the_reference(tmp_path: Path) -> None:
    straight = rendered(tmp_path, room(), size=32)
    turned, off = (rendered(tmp_path, room(), size=32, position_error=0.3, rotation_error=r) for r in (0.1, 0.2))
    assert np.array_equal(turned.views[1, 1], off.views[1, 1])
    assert not np.array_equal(turned.views[0, 0], off.views[0, 0])
    assert np.array_equal(straight.disparity[1, 1], off.disparity[1, 1])
    assert np.array_equal(turned.masks[1, 1], off.masks[1, 1])
    assert off.positions[1, 1].tolist() == [0, 0]
    assert off.turns[1, 1].tolist() == [0, 0, 0]
    assert 0.1 < np.std((off.positions - straight.positions)[:, :, 0]) < 0.6
    assert not np.array_equal(straight.disparity[0, 0], off.disparity[0, 0])
    wide = rendered(tmp_path, room(), size=32, baseline=2.0)
    assert np.allclose(wide.disparity[1, 1], 2 * straight.disparity[1, 1], atol=1e-5)


def test_lights_and_surfaces_do_what_they_say() -> None:
    """A lamp shines to the stated side, a sun where it is not shaded, a mirror shows what is before it."""

    def mean(world: World) -> np.ndarray:
        tracer = Tracer(world, Rig(world, 32, (1, 1)))
        return tracer.picture(tracer.position(0, 0), 0, 16)

    lamp = lamp_above()
    below = mean(room(light=Light(lamps=[lamp])))[-4:].mean()
    turned = type(lamp)(lamp.corner, lamp.down, lamp.across, lamp.radiance)
    assert below > 0.05
    assert mean(room(light=Light(lamps=[turned])))[-4:].mean() < 0.2 * below
    sunny = mean(room(light=Light(suns=[Sun((0.0, 1.0, 0.0), (3.0, 3.0, 3.0))])))
    assert sunny[-4:].mean() > 5 * sunny[:8].mean()
    panorama = np.zeros((64, 128, 3), np.float32)
    # red above and behind the camera: a mirror that faces it shows red
    panorama[:32, :32, 0] = panorama[:32, -32:, 0] = 1
    mirror = shapes.rectangle((-4, -4, 3), (8, 0, 0), (0, 8, 0))
    seen = mean(World([Thing(mirror, Material(kind="mirror"))], CAMERAS, Light(panorama)))
    assert seen[:8, 8:24, 0].mean() > 0.5
    assert seen[-8:].mean() < 0.05


def test_a_missing_renderer_is_one_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    find = importlib.util.find_spec
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None if name == "mitsuba" else find(name))
    result = CliRunner().invoke(main, ["scenes", "--rendered", "sticks", "-o", str(tmp_path / "new")])
    assert result.exit_code == 1
    assert len(result.output.splitlines()) == 1
    assert "need Mitsuba 3: python -m pip install 'sepi[render]'" in result.output
    assert not (tmp_path / "new").exists()


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["stick"], "did you mean 'sticks'"),
        (["sticks", "--set", "lens=-1"], "--set.lens"),
        (["sticks", "--set", "lens"], "expected KEY=VALUE"),
    ],
)
def test_a_wrong_option_is_one_line(words: list[str], told: str, tmp_path: Path) -> None:
    result = CliRunner().invoke(main, ["scenes", "--rendered", *words, "-o", str(tmp_path / "new")])
    assert result.exit_code == 1
    assert len(result.output.splitlines()) == 1
    assert told in result.output
    assert not (tmp_path / "new").exists()


@pytest.fixture
def coarse_patterns(monkeypatch: pytest.MonkeyPatch) -> None:
    """Random fields that repeat after an eighth of a pattern, and few texels: as bright, in a fraction of the time."""
    field, decoded = patterns.field, tracing.srgb_decoded

    def repeated(seed: int, finest: float, coarsest: float, texels: int = 1024, stretch: float = 1.0) -> np.ndarray:
        return np.tile(field(seed, finest, coarsest, texels // 8, stretch), (8, 8))

    monkeypatch.setattr(patterns, "field", repeated)
    monkeypatch.setattr(
        tracing, "srgb_decoded", lambda colours: decoded(colours[::4, ::4] if colours.ndim == 3 else colours)
    )


def regular_waves(world: World, seen: FirstSurface) -> Iterator[float]:
    """Cycles per pixel at 512 of the strongest wave of each regular pattern that fills a hundredth of the picture."""
    for number in np.flatnonzero(np.bincount(seen.thing.ravel()) > 0.01 * seen.thing.size):
        raster = raster_of(world.things[number].material.pattern).mean(axis=2)
        power = np.abs(np.fft.fft2(raster - raster.mean())) ** 2
        # grain has thousands of waves; half of a wave's power lies at the opposite one
        if power.max() > 0.04 * power.sum() > 0:
            rows, columns = (np.fft.fftfreq(n, 1 / n) for n in power.shape)
            row, column = np.unravel_index(power.argmax(), power.shape)
            phase = seen.uv.astype(float) @ [columns[column], rows[row]]
            steps = np.diff(phase, axis=1)[:-1], np.diff(phase, axis=0)[:, :-1]
            face, here = seen.face, seen.thing[:-1, :-1] == number
            here &= (face[:-1, :-1] == face[1:, :-1]) & (face[:-1, :-1] == face[:-1, 1:])
            if here.any():
                yield float(np.median(np.hypot(*steps)[here])) * len(face) / 512


@pytest.mark.usefixtures("coarse_patterns")
@pytest.mark.parametrize("name", RENDERED)
def test_every_ray_of_a_scene_meets_something(name: str) -> None:
    """At the corners of a 9x9 grid, too; disparities stay in what the scene says, and regular texture below moire."""
    world = world_of(name)
    rig = Rig(world, 128, (9, 9))
    tracer = Tracer(world, rig)
    near, far = world.cameras.at_near, world.cameras.at_far
    slack = 0.1 * (near - far)
    for corner in ((-4, -4), (4, 4), (0, 0)):
        seen = tracer.surfaces.first(tracer.position(*corner))
        assert np.isfinite(seen.depth).all()
        disparity = rig.disparity(seen.depth)
        assert far - slack <= disparity.min()
        # corners of so small pictures look far down
        assert disparity.max() <= near + slack or corner != (0, 0)
    assert RENDERED[name].fine or max(regular_waves(world, seen), default=0) <= 0.4
    light = tracer.picture(tracer.position(0, 0), 0, 16)
    assert 0.02 < np.median(light) < 0.6
    assert (light.max(axis=2) > 1).mean() < 0.08


@pytest.mark.system
def test_a_scene_as_a_user_renders_it(tmp_path: Path) -> None:
    """One command writes folders at two noise levels from one render; the most accurate variant reads the clean one."""
    words = ["scenes", "--rendered", "wires", "-o", str(tmp_path), "--size", "256", "--views", "5", "--samples", "16"]
    done(*words, "--noise", "off", "--noise", "low")
    light_field = sepi.read_light_field(tmp_path / "wires")
    noisy = sepi.read_light_field(tmp_path / "wires_low")
    with pytest.raises(SepiError, match=r"wires\.h5: .* the scene's folder"):
        sepi.read_light_field(tmp_path / "wires.h5")
    assert set(light_field.masks) == set(MASKS)
    assert np.array_equal(light_field.ground_truth, noisy.ground_truth)
    errors = [np.median(np.abs(sepi.estimate_depth(one).disparity - one.ground_truth)) for one in (light_field, noisy)]
    assert errors[0] < 0.03
    assert errors[1] < 0.1
    # the render is there: another level takes no more paths
    done(*words, "--noise", "high", "--all-views")
    assert len(list((tmp_path / "wires_high").glob("gt_disp_lowres_Cam*.pfm"))) == 25
    refused = CliRunner().invoke(main, [*words, "--samples", "4", "--noise", "low", "--set", "noise_seed=2"])
    assert refused.exit_code == 1
    assert "was rendered with other options" in refused.output
