"""Light that views share must be that of the same point, or a scene's shadows move with the camera."""

from typing import Any

import numpy as np
import pytest
from small_worlds import ball, bar, room, taking

from sepi.extensions.rendered.render_file import masks_in, read_render
from sepi.extensions.rendered.rendering import render_world
from sepi.extensions.rendered.sampling import alike_light
from sepi.extensions.rendered.tracing import Tracer
from sepi.extensions.rendered.world import Material, Rig
from sepi.kernels import reprojection as kernels

SIZE, VIEWS = 48, 5


def falling_on_a_plane() -> dict[str, np.ndarray]:
    """Nine views of a plane of disparity one, each with light of its own for each pixel."""
    rng = np.random.default_rng(0)
    positions = np.array([(t, s) for t in (-1, 0, 1) for s in (-1, 0, 1)], float)
    light = rng.uniform(0.5, 1.5, (9, 20, 20, 3)).astype(np.float32)
    things = np.zeros((9, 20, 20), np.int16)
    disparities = np.ones((9, 20, 20), np.float32)
    return {"light": light, "disparities": disparities, "things": things, "whole": things == 0, "baselines": positions}


def gathered(light: Any, disparities: Any, things: Any, whole: Any, baselines: Any, view: int) -> Any:
    """As :func:`sepi.extensions.rendered.sampling.with_shared_light` asks for it."""
    surface = np.where(whole, things, -1).astype(np.int16)
    mean, variance = np.empty_like(light[0]), np.empty_like(disparities[0])
    kernels.gathered_light(light, disparities, surface, baselines, view, 0.02, mean, variance)
    return mean, variance


def test_a_plane_seen_by_all_views_has_the_mean_of_their_light() -> None:
    """What another thing, another depth, or gloss shows is not asked."""
    plane = falling_on_a_plane()
    positions = plane["baselines"]
    kept = {key: values.copy() for key, values in plane.items()}
    for change, value in ((None, 0), ("things", 1), ("disparities", 2), ("whole", False)):
        arrays = {key: values.copy() for key, values in kept.items()}
        if change:
            arrays[change][0] = value
        mean, variance = gathered(**arrays, view=4)
        # the first view stands up and left of the others
        seen = [
            plane["light"][n, 10 - int(t), 10 - int(s)] for n, (t, s) in enumerate(positions) if n or change is None
        ]
        assert np.allclose(mean[10, 10], np.mean(seen, axis=0), rtol=1e-5), change
        assert variance[10, 10] == pytest.approx(np.var(np.sum(seen, axis=1), ddof=1) / len(seen), rel=1e-3)
        own, _ = gathered(**{**arrays, "baselines": positions - positions[0]}, view=0)
        assert change is None or np.allclose(own[5, 5], plane["light"][0, 5, 5], rtol=1e-5), change


def test_equal_light_stays_as_it_is() -> None:
    """Its variance is zero but for rounding; below zero, a pixel would not be like itself, and have no light at all."""
    plane = falling_on_a_plane()
    plane["light"] = np.broadcast_to(plane["light"][4, 10:11, :, :], plane["light"].shape).copy()
    # along the rows of a plane that stands still
    plane["disparities"] = np.zeros_like(plane["disparities"])
    mean, variance = gathered(**plane, view=4)
    assert variance.min() >= 0
    smoothed = alike_light(mean, variance, plane["things"][4])
    # rims, too, whose neighbours are partly beyond the picture
    np.testing.assert_allclose(smoothed, plane["light"][4], rtol=1e-2)


def test_light_is_smoothed_where_it_may_be_the_same_and_not_across_a_shadow() -> None:
    """If this fails, plain walls have grain that is fixed to them, or shadows have no borders."""
    rng = np.random.default_rng(1)
    true = np.full((40, 40, 3), 1.0)
    true[:, 20:] = 0.8
    light = (true + rng.normal(0, 0.04, true.shape)).astype(np.float32)
    things, whole = np.zeros((40, 40), np.int16), np.pad(np.ones((38, 38), bool), 1)
    variance = np.full((40, 40), 3 * 0.04**2, np.float32)
    smooth = alike_light(light, variance, np.where(whole, things, np.int16(-1)))
    assert (smooth - true)[4:-4, 4:16].std() < 0.04 / 4
    assert np.abs(smooth - true)[1:-1, 19:21].mean() < 0.03
    # not from another thing, nor from what is not whole
    things[:, 20:] = 1
    whole[20:] = False
    apart = alike_light(light, 100 * variance, np.where(whole, things, np.int16(-1)))
    assert abs((apart - true)[2:18, 18:20].mean()) < 0.01
    assert np.array_equal(apart[20:], light[20:])


def test_noise_falls_and_the_picture_stays(tmp_path: object) -> None:
    """Against 256 paths a pixel: far less noise than of 16 on walls, none added in shadows, at rims, on gloss."""
    world = room(bar(depth=1.5, width=0.15), ball(0.3, Material(kind="mirror")))
    path = tmp_path / "room.h5"  # type: ignore[operator]
    render_world("room", world, taking(size=SIZE, views=VIEWS, samples=16), path)
    render = read_render(path)
    rig = Rig(world, SIZE, (VIEWS, VIEWS))
    tracer = Tracer(world, rig)
    at = tracer.position(0, 0)
    truth, raw = tracer.picture(at, 1, 256), tracer.picture(at, 12, 16)
    masks = masks_in(render.masks[render.centre])
    shown = render.views[render.centre].astype(np.float32)
    walls = (masks["textured"] | masks["textureless"]) & ~masks["discontinuities"] & ~masks["mirror"]

    def deviation(picture: np.ndarray, where: np.ndarray) -> float:
        # two of a thousand paths that met a lamp would be all of it
        return float(np.sqrt(np.mean(np.sort(np.square(picture - truth)[where].ravel())[:-20])))

    assert deviation(shown, walls) < 0.45 * deviation(raw, walls)
    assert abs((shown - truth)[walls].mean()) < 0.01 * truth[walls].mean()
    rims = masks["discontinuities"] & ~masks["mirror"]
    assert deviation(shown, rims) < 1.02 * deviation(raw, rims)
    assert deviation(shown, masks["mirror"]) < 1.1 * deviation(raw, masks["mirror"])
