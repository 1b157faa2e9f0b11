"""Maps of all views: each must be of its own view's pixels, and all of them of the same surfaces."""

import json
from dataclasses import replace
from functools import cache
from pathlib import Path

import h5py
import numpy as np
import numpy.typing as npt
import pytest
from error_lines import done
from geometries import standing
from several_threads import SEVERAL

import sepi
from bench.all_views import disagreement, moved_pixels
from sepi.camera import Camera
from sepi.extensions.views.all_views import AllViews, estimate_all_views
from sepi.extensions.views.files import write_all_views
from sepi.io.disparity_maps import read_pfm, write_pfm
from sepi.io.hdf5 import read_attributes, write_light_field
from sepi.io.provenance import result_attributes
from sepi.io.result_folder import write_result
from sepi.kernels import carried_map as carried_map_kernels
from sepi.lightfield import FloatMap, LightField
from sepi.matching.carried_map import TOLERANCE, carried_map, corner_disparities
from sepi.scenes import render, true_disparity, write_hci
from sepi.stage import StageMaps

pytestmark = pytest.mark.slow


SIZE, VIEWS = 96, 5
LAYERS = "stripes"
"""Upright stripes before a plane: two layers, with gaps that each view opens elsewhere."""


@cache
def layers() -> LightField:
    return render(LAYERS, size=SIZE, views=VIEWS)


def truth_of(light_field: LightField) -> FloatMap:
    size = light_field.shape[0]
    views = [true_disparity(light_field.name, size=size, baseline=b) for b in light_field.baselines.reshape(-1, 2)]
    return np.stack(views).reshape(*light_field.grid, size, size)


# --- carrying one map -------------------------------------------------------------------------------------------------


def plain_corners(disparity: FloatMap, tolerance: float) -> npt.NDArray[np.float64]:
    """``corner_disparities`` as plain NumPy: every pixel's plane at its corners, averaged over those that agree."""
    d = disparity.astype(np.float64)

    def slope(axis: int) -> npt.NDArray[np.float64]:
        steps = np.diff(d, axis=axis)
        ends = [(0, 0), (0, 0)]
        ends[axis] = (1, 0)
        before = np.pad(steps, ends, constant_values=np.inf)
        ends[axis] = (0, 1)
        after = np.pad(steps, ends, constant_values=np.inf)
        return np.where(np.abs(before) <= np.abs(after), before, after)

    down, across = slope(0), slope(1)
    H, W = d.shape
    corners = np.empty((H, W, 4))
    for y, x, (n, (cy, cx)) in (
        (y, x, c)
        for y in range(H)
        for x in range(W)
        for c in enumerate([(-0.5, -0.5), (-0.5, 0.5), (0.5, 0.5), (0.5, -0.5)])
    ):
        own = d[y, x] + cy * down[y, x] + cx * across[y, x]
        around = [(y + i, x + j) for i in {0, int(2 * cy)} for j in {0, int(2 * cx)}]
        values = [
            d[i, j] + (y + cy - i) * down[i, j] + (x + cx - j) * across[i, j]
            for i, j in around
            if 0 <= i < H and 0 <= j < W
        ]
        corners[y, x, n] = np.mean([value for value in values if abs(value - own) <= tolerance])
    return corners


def plain_carry(disparity: FloatMap, corners: npt.NDArray[np.float64], v: float, u: float, stretch: float) -> FloatMap:
    """``carry`` as plain NumPy: each triangle is asked at every pixel of the view."""
    H, W = disparity.shape
    nearest = np.full((H, W), carried_map_kernels.EMPTY)
    row, column = np.mgrid[:H, :W]
    for y, x in np.ndindex(H, W):
        points = [(y, x, float(disparity[y, x]))]
        points += [
            (y + i, x + j, float(corners[y, x, n]))
            for n, (i, j) in enumerate([(-0.5, -0.5), (-0.5, 0.5), (0.5, 0.5), (0.5, -0.5)])
        ]
        seen = [np.array([py - d * v, px - d * u, d]) for py, px, d in points]
        for n in range(4):
            a, b, c = seen[0], seen[1 + (n - 1) % 4], seen[1 + n]
            matrix = np.array([[b[1] - a[1], c[1] - a[1]], [b[0] - a[0], c[0] - a[0]]])
            area = np.linalg.det(matrix)
            if not 5e-4 < area <= 0.5 * stretch:
                continue
            parts = np.linalg.solve(matrix, np.stack([column - a[1], row - a[0]]).reshape(2, -1)).reshape(2, H, W)
            inside = (parts.min(axis=0) >= -1e-3) & (parts.sum(axis=0) <= 1 + 1e-3)
            d = a[2] + parts[0] * (b[2] - a[2]) + parts[1] * (c[2] - a[2])
            nearest = np.where(inside & (d > nearest), d, nearest)
    return nearest.astype(np.float32)


def bumpy_map() -> FloatMap:
    """A slanted surface with a step and noise, so that pixels are joined, cut and hidden."""
    y, x = np.mgrid[:13, :15]
    rng = np.random.default_rng(4)
    return (0.03 * y - 0.05 * x + 1.1 * (x > 6) + 0.02 * rng.standard_normal(y.shape)).astype(np.float32)


def test_corners_are_what_plain_numpy_makes_of_them() -> None:
    """Otherwise slanted surfaces would tear, or depth steps be bridged, when they are carried."""
    disparity = bumpy_map()
    found = corner_disparities(disparity)
    np.testing.assert_allclose(found, plain_corners(disparity, TOLERANCE), atol=1e-5)


@pytest.mark.parametrize(("v", "u"), [(0.0, 0.0), (1.3, -2.4), (-3.0, 2.0)])
def test_carried_surfaces_are_what_plain_numpy_draws(v: float, u: float) -> None:
    """Otherwise views would show surfaces where they are not."""
    disparity = bumpy_map()
    corners = corner_disparities(disparity)
    nearest, origin = np.empty_like(disparity), np.empty(disparity.shape, np.int32)
    carried_map_kernels.carry(disparity, corners, v, u, nearest, origin)
    np.testing.assert_allclose(nearest, plain_carry(disparity, corners, v, u, 2.0), atol=1e-4)
    seen = origin >= 0
    np.testing.assert_array_equal(seen, nearest != carried_map_kernels.EMPTY)
    # the pixel that is seen is the one whose place this is, to half a pixel and the slope of its surface
    row, column = np.divmod(origin[seen], disparity.shape[1])
    y, x = np.nonzero(seen)
    assert np.abs(row - nearest[seen] * v - y).max() <= 0.51
    assert np.abs(column - nearest[seen] * u - x).max() <= 0.51


@pytest.mark.parametrize("baseline", [(0.0, 4.0), (-3.0, 0.5), (2.6, -3.7)])
def test_a_slanted_plane_is_carried_exactly(baseline: tuple[float, float]) -> None:
    """Otherwise slanted surfaces would get holes, or stairs, in the other views."""
    found = carried_map(true_disparity("slanted_plane", size=SIZE), baseline)
    truth = true_disparity("slanted_plane", size=SIZE, baseline=baseline)
    seen = np.isfinite(found)
    assert np.abs(found - truth)[seen].max() < 1e-4
    # seen is what the map's own view holds, without a hole
    at = np.indices(truth.shape) + truth * np.array(baseline)[:, None, None]
    beyond = np.maximum(-0.5 - at, at - (SIZE - 0.5)).max(axis=0)
    assert seen[beyond < -0.01].all()
    assert not seen[beyond > 0.01].any()


# --- all views --------------------------------------------------------------------------------------------------------


def test_every_view_of_two_layers_is_close_to_the_truth() -> None:
    """Other views' maps are of no use if they are much worse than the reference view's, or do not fit together."""
    truth, baselines = truth_of(layers()), layers().baselines
    found = estimate_all_views(layers(), variant="fast")
    assert found.disparity.dtype == found.confidence.dtype == np.float32
    assert found.confidence.min() >= 0
    assert found.confidence.max() <= 1
    error = np.abs(found.disparity - truth)
    of_views = error.mean(axis=(2, 3))
    assert of_views.mean() < 0.05
    assert of_views.max() < 0.08
    assert (error > 0.07).mean() < 0.07
    mean, bad = disagreement(found.disparity, baselines)
    assert mean < 0.05
    assert bad < 6
    # what the reference view does not see must be better than a guess from what is beside it
    reference = found.disparity[2, 2]
    ours, guessed, pixels = 0.0, 0.0, 0
    for position in ((0, 0), (0, 3), (1, 4), (3, 0), (4, 4)):
        gap = np.isnan(carried_map(reference, tuple(baselines[position])))
        pixels += int(gap.sum())
        ours += float(error[position][gap].sum())
        naive = moved_pixels(reference, baselines[position])
        guessed += float(np.abs(naive - truth[position])[gap].sum())
    assert pixels > 1000
    assert ours < 0.5 * guessed


def test_the_reference_views_map_is_the_one_that_is_given() -> None:
    """`sepi depth --all-views` must not tell two things about one view."""
    light_field = render("pyramids", size=64, views=3)
    maps = sepi.estimate_depth(light_field, "fast")
    found = sepi.estimate_all_views(light_field, maps, "fast", edge_views=0)
    np.testing.assert_array_equal(found.disparity[1, 1], maps.disparity)
    np.testing.assert_array_equal(found.confidence[1, 1], maps.confidence)
    for name in ("sigma", "low", "high"):
        np.testing.assert_array_equal(getattr(found, name)[1, 1], maps.extra[name])


def barred(disparity: FloatMap) -> StageMaps:
    """A map with error bars, twice as wide above as below, that tell its surfaces apart."""
    sigma = np.where(disparity > 0, np.float32(0.25), np.float32(0.0625))
    bars = {"sigma": sigma, "low": disparity - sigma, "high": disparity + 2 * sigma}
    return StageMaps(disparity, np.full_like(disparity, 0.9), bars)


@pytest.fixture
def from_the_reference_view(monkeypatch: pytest.MonkeyPatch) -> AllViews:
    """All views as the reference view's true map alone tells of them."""
    monkeypatch.setattr("sepi.extensions.views.all_views.anchor_views", lambda light_field: [(2, 2)])
    maps = barred(np.asarray(layers().ground_truth, np.float32))
    return estimate_all_views(layers(), maps, edge_views=0)


def test_error_bars_go_with_the_surfaces(from_the_reference_view: AllViews) -> None:
    """A view's interval must be that of the surface which it sees, about the disparity which it has there."""
    found = from_the_reference_view
    for layer, sigma in ((found.disparity > 0, 0.25), (found.disparity <= 0, 0.0625)):
        shown = layer & ~found.extended
        assert shown.sum() > 10000
        np.testing.assert_array_equal(found.sigma[shown], sigma)
        np.testing.assert_allclose((found.disparity - found.low)[shown], sigma, atol=1e-5)
        np.testing.assert_allclose((found.high - found.disparity)[shown], 2 * sigma, atol=1e-5)


def test_what_no_map_shows_may_be_anywhere(from_the_reference_view: AllViews) -> None:
    """The background was extended there: a narrow interval would be a claim about what nobody saw."""
    found, known = from_the_reference_view, layers().require_disparity_range()
    assert found.extended.sum() > 1000
    assert (found.low[found.extended] <= known.minimum).all()
    assert (found.high[found.extended] >= known.maximum).all()
    np.testing.assert_allclose(found.sigma[found.extended], (known.maximum - known.minimum) / 12**0.5, rtol=1e-5)
    assert (found.high - found.low)[~found.extended].max() < 0.76


@pytest.mark.parametrize("geometry", ["closer rows", "off the grid", "one row"])
def test_any_arrangement_of_views(geometry: str) -> None:
    """Views that stand otherwise, in grey, seen from a corner, or missing, must not move surfaces to elsewhere."""
    size, views = 64, 3
    where = standing(geometry, (views, views)) if geometry != "one row" else {}
    light_field = render("curved_occluders", size=size, views=views, **where)
    truth, present = truth_of(light_field), np.ones((views, views), bool)
    if geometry == "closer rows":
        light_field = replace(light_field, views=light_field.views[..., 1:2].copy()).seen_from((2, 0))
    if geometry == "off the grid":
        present[0, 0] = present[2, 1] = False
        light_field = replace(light_field, present=present)
    if geometry == "one row":
        truth, present = truth[1:2], present[1:2]
        light_field = replace(light_field, views=light_field.views[1:2], present=present)
    found = estimate_all_views(light_field, variant="fast")
    assert np.isnan(found.disparity[~present]).all()
    assert (found.confidence[~present] == 0).all()
    assert np.isfinite(found.disparity[present]).all()
    # tiny pictures of a scene with steps of 4: moved the wrong way, they would be wrong nearly everywhere
    assert np.median(np.abs(found.disparity - truth)[present]) < 0.03


# --- the command ------------------------------------------------------------------------------------------------------


def test_the_command_writes_a_map_of_every_view(tmp_path: Path) -> None:
    """What users call: the file beside the usual ones, which stay the same to the byte, and gone when not asked for.

    Equal input gives equal bytes with any number of threads; the map of a missing view is none.
    """
    scene = tmp_path / "pyramids"
    write_hci(render("pyramids", size=64, views=3), scene)
    words = ["depth", str(scene), "--variant", "fast", "--exclude", "0,2", "-o"]
    # the last one into the folder of one before
    for folder, number, more in (("all", 1, ["--all-views"]), ("again", SEVERAL, ["--all-views"]), ("again", 1, [])):
        if not more:
            again = (tmp_path / "again" / "all_views.h5").read_bytes()
        called = done(*words, tmp_path / folder, "--threads", number, *more)
        assert ("all_views.h5" in called.output) == bool(more)
    plain = {path.name: path.read_bytes() for path in (tmp_path / "again").iterdir()}
    both = {path.name: path.read_bytes() for path in (tmp_path / "all").iterdir()}
    assert both.pop("all_views.h5") == again
    # result.h5 lists the files that were written with it
    for files in (plain, both):
        del files["result.h5"]
    assert both == plain
    one, other = (read_attributes(tmp_path / name / "result.h5") for name in ("again", "all"))
    assert other.pop("files") == "all_views.h5 " + one.pop("files")
    assert list(map(str, other.values())) == list(map(str, one.values()))
    with h5py.File(tmp_path / "all" / "all_views.h5") as file:
        for name in ("disparity", "sigma", "low", "high"):
            assert file[name].attrs["units"] == "pixels per view step"
        assert file.attrs["variant"] == "fast"
        np.testing.assert_array_equal(file["disparity"][1, 1], np.load(tmp_path / "all" / "disparity.npy"))
        present = np.arange(9).reshape(3, 3) != 2
        np.testing.assert_array_equal(file["present"][()], present)
        # 0 would look like a map that was made
        assert np.isnan(file["baselines"][0, 2]).all()
        np.testing.assert_array_equal(np.isfinite(file["disparity"][()]).all(axis=(2, 3)), present)
        assert np.isnan(file["disparity"][0, 2]).all()
        for t, s in np.argwhere(present).tolist():
            truth = true_disparity("pyramids", size=64, baseline=(t - 1, s - 1))
            assert np.median(np.abs(file["disparity"][t, s] - truth)) < 0.03


# --- what is made of them ---------------------------------------------------------------------------------------------

CAMERA = Camera(scale=30.0, offset=6.0, focal_px=90.0)


@cache
def small() -> tuple[LightField, FloatMap]:
    """A light field with a camera and without view 0,2, and the truth of all its views."""
    scene = replace(render(LAYERS, size=64, views=3), camera=CAMERA, present=np.arange(9).reshape(3, 3) != 2)
    return scene, truth_of(scene)


@pytest.fixture
def exact(here: Path) -> FloatMap:
    """A light field ``scene.h5``, ``maps`` with the truth of all its views, and ``corner``, that of view
    2,0 alone, in the current folder; the truth.
    """
    scene, truth = small()
    sure = np.full(scene.shape, 0.9, np.float32)
    nothing = np.zeros(scene.shape, bool)
    nothing[5, 6] = True
    write_light_field("scene.h5", scene)
    write_light_field("other.h5", replace(scene, views=scene.views[:, ::-1], present=scene.present[:, ::-1]))
    for name, light_field in (("maps", scene), ("corner", scene.seen_from((2, 0)))):
        maps = barred(truth[light_field.reference_position])
        write_result(name, light_field, maps.updated(maps.disparity, sure, unknown=nothing & (name == "corner")))
    maps_of = {
        (t, s): {"disparity": truth[t, s], "confidence": sure, "extended": nothing, **barred(truth[t, s]).extra}
        for t, s in np.argwhere(scene.present).tolist()
    }
    attributes = result_attributes(scene, StageMaps(truth[1, 1], sure))
    write_all_views(Path("maps/all_views.h5"), scene, maps_of.items(), attributes)
    return truth


def call(*words: str) -> str:
    return done(*words).stdout


def test_a_view_of_all_makes_what_a_result_of_that_view_makes(exact: FloatMap) -> None:
    """Metres, points and maps of any view: all but the reference view's were out of reach."""
    call("points", "corner", "-o", "corner.ply")
    call("points", "maps", "--view", "2,0")
    assert Path("maps/points_2_0.ply").read_bytes() == Path("corner.ply").read_bytes()
    call("convert", "maps/all_views.h5", "view.pfm", "--view", "2,0")
    np.testing.assert_array_equal(read_pfm(Path("view.pfm")), exact[2, 0])
    call("convert", "maps", "metres.pfm", "--view", "2,0", "--map", "depth")
    np.testing.assert_array_equal(read_pfm(Path("metres.pfm")), CAMERA.depth(exact[2, 0]))
    for name, values in barred(exact[2, 0]).extra.items():
        call("convert", "maps", "view.pfm", "--view", "2,0", "--map", name)
        np.testing.assert_array_equal(read_pfm(Path("view.pfm")), values)
    call("refocus", "scene.h5", "maps", "--view", "2,0", "--disparity", "1", "-o", "one")
    call("refocus", "scene.h5", "corner", "--disparity", "1", "-o", "two")
    assert Path("one/all_in_focus.png").read_bytes() == Path("two/all_in_focus.png").read_bytes()


def test_a_view_of_all_is_scored_against_its_own_truth(exact: FloatMap) -> None:
    write_pfm("truth.pfm", exact[2, 0])
    for estimate in ("maps", "maps/all_views.h5"):
        scores = json.loads(call("evaluate", estimate, "truth.pfm", "--view", "2,0", "--json"))
        assert scores["paper"]["all"]["mse100"] == 0
    # the reference view's, with the regions of the light field
    assert json.loads(call("evaluate", "maps/all_views.h5", "scene.h5", "--json"))["paper"]["all"]["mse100"] == 0
    assert "written" in call("compare", "maps", "corner", "--view", "2,0")


@pytest.mark.parametrize("kind", ["colmap", "nerfstudio"])
def test_poses_have_the_depth_of_every_view(exact: FloatMap, kind: str) -> None:
    """Carried from one view, depth ends where that view sees nothing: behind things, and at borders."""
    call("poses", "scene.h5", "maps", "--to", kind, "-o", "out")
    for t, s in ((0, 0), (2, 0), (1, 2)):
        name = f"view_{t:02}_{s:02}"
        if kind == "nerfstudio":
            depth = np.load(f"out/depths/{name}.npy") / 1000
        else:
            content = Path(f"out/stereo/depth_maps/{name}.png.geometric.bin").read_bytes()
            depth = np.frombuffer(content.split(b"&", 3)[3], "<f4").reshape(64, 64)
        expected = CAMERA.depth(exact[t, s])
        expected[5, 6] = 0
        np.testing.assert_allclose(depth, expected, rtol=1e-6)
        if kind == "nerfstudio":
            sigma = CAMERA.depth_sigma(exact[t, s], barred(exact[t, s]).extra["sigma"])
            sigma[5, 6] = 0
            np.testing.assert_allclose(np.load(f"out/depth_sigmas/{name}.npy") / 1000, sigma, rtol=1e-6)
