"""Views that are none of the scene's are named, all of them and no other: a false name costs a good view."""

import warnings
from functools import cache
from pathlib import Path

import cv2
import numpy as np
import pytest

from sepi.inspection.view_order import odd_views
from sepi.io.readers.options import ReadOptions
from sepi.lightfield import LightField
from sepi.reading import read_light_field
from sepi.scenes import SCENES, render


@cache
def views_of(name: str) -> np.ndarray:
    return render(name, size=96, views=5).views


def flags(views: np.ndarray) -> str:
    return " ".join(line[line.index("--exclude") :] for line in odd_views(LightField(views, "field")))


def excluded(*places: tuple[int, int]) -> str:
    return " ".join(f"--exclude {t},{s}" for t, s in places)


ROW = tuple((0, s) for s in range(5))
ODD = {
    "black": [(0, 0)],
    "white": [(4, 2)],
    "upside down": [(1, 3)],
    "of another scene": [(2, 2)],
    "a row of another scene": ROW,
    "a row upside down": ROW,
    "a row black": ROW,
    "a copy": [(0, 1), (3, 3)],
}


def spoilt(kind: str) -> np.ndarray:
    views = views_of("curved_occluders").copy()
    for t, s in ODD[kind]:
        if kind.endswith("black") or kind == "white":
            views[t, s] = 0 if kind.endswith("black") else 255
        elif kind.endswith("upside down"):
            views[t, s] = views[t, s, ::-1, ::-1].copy()
        else:
            views[t, s] = views_of("dots")[t, s] if "scene" in kind else views[3, 3]
    return views


@pytest.mark.parametrize("kind", ODD)
def test_the_odd_views_are_named_and_no_others(kind: str) -> None:
    assert flags(spoilt(kind)) == excluded(*ODD[kind])


def test_views_in_a_wrong_order_are_none_of_another_scene() -> None:
    """Neighbours in the grid are none in space then, and a good view would be left out for the order's fault."""
    views = views_of("curved_occluders").reshape(25, 96, 96, 3)
    assert not flags(views[np.random.default_rng(1).permutation(25)].reshape(5, 5, 96, 96, 3))


@pytest.mark.parametrize("name", SCENES)
def test_no_view_of_a_built_in_scene_is_odd(name: str) -> None:
    """Neither in noise and the dark, nor where views are few or small."""
    views, rng = views_of(name), np.random.default_rng(2)
    noisy = [np.clip(views + rng.normal(0, sigma, views.shape), 0, 255).astype(np.uint8) for sigma in (20, 80)]
    dark = views.copy()
    dark[0] //= 12
    for some in (views, *noisy, dark, views[:1, :2], views[:, :, :20, :20], views // 30):
        assert not flags(some)


def test_what_is_named_can_be_left_out_by_the_flags(tmp_path: Path) -> None:
    """By the files' names, which are what the user sees; then nothing is said of the rest."""
    for (t, s), view in zip(np.ndindex(5, 5), spoilt("upside down").reshape(25, 96, 96, 3), strict=True):
        assert cv2.imwrite(str(tmp_path / f"my view_{5 * t + s}.png"), view[..., ::-1])
    with pytest.warns(match=r"of another scene.* --exclude 'my view_8\.png'$"):
        read_light_field(tmp_path)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        left = read_light_field(tmp_path, options=ReadOptions(exclude=("my view_8.png",)))
    assert np.argwhere(~left.present).tolist() == [[1, 3]]
