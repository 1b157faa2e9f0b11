"""The disparity range found from the views must hold every surface, and not be so wide that candidates are wasted."""

import itertools
from pathlib import Path

import cv2
import numpy as np
import pytest
from real_scenes import views_of

from sepi.errors import SepiError, SepiWarning
from sepi.inspection.coarse_sweep import coarse_sweep
from sepi.inspection.disparity_range import estimate_range, settle_range, unmatched
from sepi.lightfield import DisparityRange, LightField
from sepi.scenes import SCENES, render


def texture(seed: int, height: int = 96, width: int = 96) -> np.ndarray:
    """Noise that survives the filters, (height, width) float32 in 0..1."""
    rng = np.random.default_rng(seed)
    return cv2.GaussianBlur(rng.random((height, width), np.float32), (0, 0), 1.0) * 3 - 1


def planes(back: float, front: float, square: int, size: int = 96, grid: tuple[int, int] = (5, 5)) -> LightField:
    """A textured square of disparity ``front`` before a plane of disparity ``back``, both whole or half pixels."""
    T, S = grid
    margin = 160
    ground = texture(1, 2 * (size + 2 * margin), 2 * (size + 2 * margin))
    paint = texture(2, square, square)
    views = np.empty((T, S, size, size, 1), np.float32)
    for t, s in itertools.product(range(T), range(S)):
        dt, ds = t - T // 2, s - S // 2
        # twice the resolution, so that half pixels are exact
        y, x = round(2 * (margin + back * dt)), round(2 * (margin + back * ds))
        views[t, s, :, :, 0] = cv2.blur(ground, (2, 2))[y : y + 2 * size : 2, x : x + 2 * size : 2]
        top, left = round((size - square) / 2 - front * dt), round((size - square) / 2 - front * ds)
        views[t, s, top : top + square, left : left + square, 0] = paint
    return LightField(np.clip(views, 0, 1), "planes")


def holds(known: DisparityRange, low: float, high: float, slack: float = 0.0) -> bool:
    return known.minimum <= low + slack and known.maximum >= high - slack


@pytest.mark.parametrize("name", SCENES)
def test_built_in_scenes(name: str) -> None:
    # the tips of the pyramids are too small otherwise
    light_field = render(name, size=128, views=7) if name == "pyramids" else render(name, size=96, views=5)
    ground_truth = light_field.ground_truth
    known = estimate_range(light_field)
    assert known.source == "estimated"
    assert holds(known, ground_truth.min(), ground_truth.max(), slack=0.05)
    assert known.maximum - known.minimum < 1.5 * np.ptp(ground_truth) + 0.8


@pytest.mark.parametrize(("name", "every"), [("cotton", 2), ("antinous", 1)])
def test_real_scenes(hci: Path, name: str, every: int) -> None:
    """Each second view is the same scene with disparities twice as large."""
    whole = views_of(hci / name)
    ground_truth = whole.ground_truth
    known = estimate_range(LightField(whole.views[::every, ::every], name))
    assert holds(known, every * ground_truth.min(), every * ground_truth.max())
    assert known.maximum - known.minimum < 1.35 * every * np.ptp(ground_truth)


# where a scene's nearest and most distant surfaces have texture; what JPEG leaves of cotton's is little in any part
PARTS = {"cotton": np.s_[128:384, :], "antinous": np.s_[128:384, 128:384]}
WHOLE = ("cotton", "JPEG of quality 30")


@pytest.mark.parametrize("name", ["cotton", "antinous"])
@pytest.mark.parametrize("kind", ["noise of 10/255", "JPEG of quality 30", "grey", "half size", "16 bit"])
def test_disturbed_real_scenes(hci: Path, name: str, kind: str) -> None:
    """Blocks of JPEG match those a block further, and noise stretches what is measured: candidates would be wasted."""
    from bench.disturbed import DISTURBANCES

    whole, part = views_of(hci / name), PARTS[name] if (name, kind) != WHOLE else np.s_[:, :]
    change, factor = DISTURBANCES[kind]
    # the views in the middle move as all do, and of those only a row and a column are looked at
    views = whole.views[2:7, 2:7, *part]
    row, column = (change(LightField(np.ascontiguousarray(line), name)).views for line in (views[2:3], views[:, 2:3]))
    present = np.zeros((5, 5), bool)
    present[2] = present[:, 2] = True
    disturbed = np.zeros((5, 5, *row.shape[2:]), row.dtype)
    disturbed[2], disturbed[:, 2] = row[0], column[:, 0]
    known = estimate_range(LightField(disturbed, name, present=present))
    low, high = factor * np.quantile(whole.ground_truth[part], [0.0025, 0.9975])
    assert holds(known, low, high)
    assert known.maximum - known.minimum < 1.5 * (high - low)


@pytest.mark.parametrize(("back", "front"), [(-2, 3), (0.5, 1.5), (4, 7), (-9, -6), (-14, -12)])
def test_two_planes(back: float, front: float) -> None:
    known = estimate_range(planes(back, front, square=30))
    assert holds(known, back, front)
    assert known.maximum - known.minimum < 1.3 * (front - back) + 1


GRIDS = [(1, 2), (3, 3), (5, 5)]


@pytest.mark.parametrize("grid", GRIDS)
@pytest.mark.parametrize(("back", "front", "square"), [(4, 20, 60), (4, 24, 14), (24, -10, 14)])
def test_steps_of_tens_of_pixels(grid: tuple[int, int], back: float, front: float, square: int) -> None:
    """A search that ends where most of the picture matches never sees what is nearer, large or small."""
    known = estimate_range(planes(back, front, square, size=200, grid=grid))
    assert holds(known, min(back, front), max(back, front))
    assert known.maximum - known.minimum < 1.2 * abs(front - back) + 1


@pytest.mark.parametrize("back", [0, 60])
def test_two_pictures_match_by_chance_nowhere_else(back: float) -> None:
    """Repeated paint fits in many places, a faint wall in noise anywhere; with one other view nothing contradicts."""
    rng = np.random.default_rng(2)
    views = planes(back, back + 6, square=60, size=200, grid=(1, 2)).views.copy()
    repeated = np.tile(texture(4, 12, 12), (5, 30))
    paint = 0.9 * repeated + 0.1 * texture(6, 60, 360)
    for s in range(2):
        views[0, s, 130:190, :, 0] = paint[:, 80 + back * (s - 1) :][:, :200]
        views[0, s, :50] = 0.5
    views += rng.normal(0, 0.015, views.shape).astype(np.float32)
    known = estimate_range(LightField(np.clip(views, 0, 1), "pair"))
    assert holds(known, back, back + 6)
    assert known.maximum - known.minimum < 1.5 * 6 + 1


def test_small_object_far_in_front_is_found() -> None:
    """A range without it would smear it over the background."""
    assert holds(estimate_range(planes(-1, 6, square=10, size=128)), -1, 6)


def test_noise_on_a_wall_is_not_texture() -> None:
    """Anything matches anything there; one lucky match among thousands would stretch the range to the search's ends."""
    square = planes(1, 1, square=40, size=128).views
    t, s, y, x, _ = np.indices(square.shape)
    outside = np.maximum(abs(y + t - 2 - 64), abs(x + s - 2 - 64)) > 20
    views = np.where(outside, 0.5, square) + np.random.default_rng(5).normal(0, 0.02, square.shape)
    known = estimate_range(LightField(views.astype(np.float32), "wall"))
    assert holds(known, 1, 1)
    assert known.maximum - known.minimum < 2


def test_missing_views_are_not_looked_at() -> None:
    light_field = planes(-2, 3, square=30)
    present = np.ones((5, 5), bool)
    present[2, 0] = present[0, 2] = present[1, 1] = False
    views = light_field.views.copy()
    views[~present] = np.nan
    assert holds(estimate_range(LightField(views, "sparse", present=present)), -2, 3)


@pytest.mark.parametrize("grid", [(1, 5), (5, 1), (2, 2), (4, 3)])
def test_other_grids(grid: tuple[int, int]) -> None:
    assert holds(estimate_range(planes(-2, 3, square=40, grid=grid)), -2, 3)


def test_large_pictures_are_reduced_and_disparities_are_not() -> None:
    light_field = planes(-2, 3, square=30)
    large = np.repeat(np.repeat(light_field.views, 10, axis=2), 10, axis=3)
    known = estimate_range(LightField(large[1:4, 1:4], "large"))
    assert holds(known, -20, 30)
    assert known.maximum - known.minimum < 75


@pytest.mark.parametrize("level", [0.0, 0.5])
def test_views_without_texture_say_so(level: float) -> None:
    with pytest.raises(SepiError, match=r"blank: the disparity range cannot be estimated.*MIN MAX"):
        estimate_range(LightField(np.full((3, 3, 40, 40, 3), level, np.float32), "blank"))


def test_given_range_wins_over_the_scenes_own() -> None:
    light_field = planes(-2, 3, square=30)
    own = light_field.with_range(DisparityRange(-2.5, 3.5, "parameters"))
    assert settle_range(own, (-3, 4)).disparity_range == DisparityRange(-3, 4, "given")
    assert settle_range(own) is own
    assert settle_range(light_field).require_disparity_range().source == "estimated"
    with pytest.raises(SepiError, match="MIN < MAX"):
        settle_range(own, (1, 1))


def test_dark_corners_are_no_surfaces() -> None:
    """A lens leaves the corners of Lytro pictures black; their edges move from view to view as nothing in the scene."""
    light_field = render("wall", size=96, views=5)
    clean = estimate_range(light_field)
    y, x = np.mgrid[:96, :96] - 47.5
    views = light_field.views.copy()
    for t, s in np.ndindex(5, 5):
        views[t, s][np.hypot(y - 4 * (t - 2), x - 4 * (s - 2)) > 57] = 1
    vignetted = LightField(views, "vignetted")
    known = estimate_range(vignetted)
    assert known.minimum == pytest.approx(clean.minimum, abs=0.3)
    assert known.maximum == pytest.approx(clean.maximum, abs=0.3)


@pytest.mark.parametrize("limits", [(-1e9, 1e9), (0, 48), (-48, 1)])
def test_a_range_beyond_the_views_is_refused(limits: tuple[float, float]) -> None:
    """A typing error in the range would otherwise be hours of work on candidates that no view can show."""
    light_field = LightField(np.zeros((3, 3, 32, 48, 1), np.uint8), "toy", source="toy.npy")
    with pytest.raises(SepiError, match=r"toy\.npy: disparity range \(given\) .* less than the 48 pixels of a view"):
        settle_range(light_field, limits)
    assert settle_range(light_field, (-47, 47)).require_disparity_range().maximum == 47


@pytest.mark.parametrize("grid", GRIDS)
@pytest.mark.parametrize(("back", "front"), [(-2, 3), (4, 20)])
@pytest.mark.parametrize("noise", [0, 0.02])
def test_what_matches_nowhere_is_told(grid: tuple[int, int], back: float, front: float, noise: float) -> None:
    """The map stays within the range, and its intervals too: nothing else says that a surface is not in it."""
    views = planes(back, front, square=80, size=200, grid=grid).views
    views = np.clip(views + np.random.default_rng(3).normal(0, noise, views.shape), 0, 1).astype(np.float32)
    light_field = LightField(views, "toy", source="toy.npy")
    # a warning is an error here
    assert settle_range(light_field).require_disparity_range().source == "estimated"
    assert settle_range(light_field, (back - 1, front + 2)).require_disparity_range().source == "given"
    cut = light_field.with_range(DisparityRange(back - 1, front - 1.5, "parameters"))
    # of what all views show of the picture, the square
    shown = 200 - 2 * (max(abs(back - 1), abs(front - 1.5)) + 4)
    square = (80 / shown) ** 2 if grid[0] > 1 else 80 / shown * 80 / 192
    assert unmatched(cut) == pytest.approx(square, rel=0.3)
    with pytest.warns(SepiWarning, match=r"^toy\.npy: \d\d % of the textured .*\(parameters\).*--disparity-range$"):
        settle_range(cut)
    assert unmatched(light_field.with_range(DisparityRange(back + 1.5, front + 2, "given"))) > 0.5


def sweep_in_numpy(
    reference: np.ndarray, views: np.ndarray, offsets: np.ndarray, candidates: np.ndarray, limit: float, radius: int
) -> np.ndarray:
    """Costs (N, H, W) of the coarse sweep, written the plain way; infinite where too few views see the window."""
    H, W = reference.shape
    costs = np.full((len(candidates), H, W), np.inf)
    rows, columns = np.mgrid[:H, :W]
    for n, d in enumerate(candidates):
        total, seen = np.zeros((H, W)), np.zeros((H, W))
        for view, (dt, ds) in zip(views, offsets, strict=True):
            y, x = rows - d * dt, columns - d * ds
            y0, x0 = np.floor(y).astype(int), np.floor(x).astype(int)
            inside = (y0 >= 0) & (y0 < H - 1) & (x0 >= 0) & (x0 < W - 1)
            y0, x0 = np.where(inside, y0, 0), np.where(inside, x0, 0)
            fy, fx = y - y0, x - x0
            upper = (1 - fx) * view[y0, x0] + fx * view[y0, x0 + 1]
            lower = (1 - fx) * view[y0 + 1, x0] + fx * view[y0 + 1, x0 + 1]
            difference = np.minimum(np.abs(reference - (1 - fy) * upper - fy * lower), limit)
            total += np.where(inside, difference, 0)
            seen += inside
        pixel = np.where(2 * seen >= len(views), total / np.maximum(seen, 1), np.inf)
        for y, x in np.ndindex(H, W):
            window = pixel[max(0, y - radius) : y + radius + 1, max(0, x - radius) : x + radius + 1]
            costs[n, y, x] = window.mean()
    return costs


def test_kernel_equals_its_plain_twin() -> None:
    """The compiled sweep works on blocks of rows and slices; an index off by one shifts every disparity."""
    rng = np.random.default_rng(4)
    reference = rng.random((37, 23), np.float32)
    views = rng.random((4, 37, 23), np.float32)
    offsets = np.array([[0, -2], [0, 1], [1, 0], [-1, 2]], np.float32)
    candidates = np.linspace(-3, 3, 13, dtype=np.float32)
    lowest, second, mean, disparity = coarse_sweep(reference, views, offsets, candidates, 0.4, 2)
    costs = sweep_in_numpy(reference, views, offsets, candidates, 0.4, 2)
    finite = np.isfinite(costs)
    np.testing.assert_allclose(mean, np.where(finite, costs, 0).sum(0) / np.maximum(finite.sum(0), 1), rtol=1e-4)
    best = costs.argmin(0)
    for y, x in np.ndindex(reference.shape):
        n, column = best[y, x], costs[:, y, x]
        if n in (0, len(candidates) - 1) or not np.isfinite(column[[n - 1, n + 1]]).all():
            assert np.isinf(lowest[y, x])
            continue
        assert lowest[y, x] == pytest.approx(column[n], rel=1e-4)
        assert abs(disparity[y, x] - candidates[n]) <= 0.25 + 1e-4
        left = n
        while left > 0 and column[left - 1] >= column[left]:
            left -= 1
        right = n
        while right < len(column) - 1 and column[right + 1] >= column[right]:
            right += 1
        others = np.concatenate([column[:left], column[right + 1 :]])
        assert second[y, x] == pytest.approx(others.min() if others.size else np.inf, rel=1e-4)
