"""Light that views share must be that of the same point, or a scene's shadows move with the camera."""

import numpy as np
from small_worlds import ball, bar, room, taking

from sepi.rendered.render_file import read_render
from sepi.rendered.rendering import render_world
from sepi.rendered.rig import rig_of
from sepi.rendered.shared_light import with_shared_light
from sepi.rendered.tracing import Tracer
from sepi.rendered.world import Material

SIZE, VIEWS = 48, 5


def test_a_plane_seen_by_all_views_has_the_mean_of_their_light() -> None:
    """Of nine views of a plane of disparity one, exactly: the paint of each stays, the light is one."""
    rng = np.random.default_rng(0)
    positions = np.array([(t, s) for t in (-1, 0, 1) for s in (-1, 0, 1)], float)
    falling = rng.uniform(0.5, 1.5, (9, 20, 20, 3)).astype(np.float32)
    paint = rng.uniform(0.2, 0.8, (9, 20, 20, 3)).astype(np.float32)
    plane = np.ones((9, 20, 20), np.float32)
    things = np.zeros((9, 20, 20), np.int16)
    shown = with_shared_light(falling * paint, paint, plane, things, things == 0, positions)
    expected = np.mean([falling[n, 10 - int(t), 10 - int(s)] for n, (t, s) in enumerate(positions)], axis=0)
    assert np.allclose(shown[4, 10, 10], expected * paint[4, 10, 10], rtol=1e-5)
    # what another thing, another depth, or gloss shows is not asked
    for change in ("things", "disparities", "matte"):
        arrays = {"disparities": plane.copy(), "things": things.copy(), "matte": things == 0}
        arrays[change][0] = {"things": 1, "disparities": 2, "matte": False}[change]
        kept = with_shared_light(falling * paint, paint, **arrays, positions=positions)
        fewer = np.mean([falling[n, 10 - int(t), 10 - int(s)] for n, (t, s) in enumerate(positions) if n], axis=0)
        assert np.allclose(kept[4, 10, 10], fewer * paint[4, 10, 10], rtol=1e-5), change
        assert np.allclose(kept[0, 5, 5], falling[0, 5, 5] * paint[0, 5, 5], rtol=1e-5)


def test_noise_falls_and_the_picture_stays(tmp_path: object) -> None:
    """Against 512 paths a pixel: far less noise than of 16 on walls, none added in shadows, at rims, on gloss."""
    world = room(bar(depth=1.5, width=0.15), ball(0.3, Material(kind="mirror")))
    path = tmp_path / "room.h5"  # type: ignore[operator]
    render_world("room", world, taking(size=SIZE, views=VIEWS, samples=16), path)
    render = read_render(path)
    rig = rig_of(world, SIZE, (VIEWS, VIEWS))
    good, noisy = (Tracer(world, rig, samples) for samples in (512, 16))
    at = good.position(0, 0)
    truth, raw = good.picture(at, 1), noisy.picture(at, 12)
    masks = render.masks_of(render.centre)
    shown = render.views[render.centre].astype(np.float32)
    walls = (masks["textured"] | masks["textureless"]) & ~masks["discontinuities"] & ~masks["mirror"]

    def deviation(picture: np.ndarray, where: np.ndarray) -> float:
        # two of a thousand paths that met a lamp would be all of it
        return float(np.sqrt(np.mean(np.sort(np.square(picture - truth)[where].ravel())[:-20])))

    assert deviation(shown, walls) < 0.45 * deviation(raw, walls)
    assert abs((shown - truth)[walls].mean()) < 0.01 * truth[walls].mean()
    rims = masks["discontinuities"] & ~masks["mirror"]
    assert deviation(shown, rims) < 1.02 * deviation(raw, rims)
    # the mirror is as its paths made it
    assert np.allclose(shown[masks["mirror"]], raw[masks["mirror"]], rtol=2e-3, atol=1e-4)
