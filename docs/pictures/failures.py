"""What may go wrong: light fields that are disturbed, their maps, and what ``sepi`` says of them."""

from __future__ import annotations

import textwrap
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt

from pictures.maps import Titled, error_panel, map_panel, sheet_of, truth_panel, view_panel
from pictures.style import Draw
from sepi.inspection.view_order import check_order
from sepi.io.readers.options import ORDERS
from sepi.lightfield import DisparityRange, LightField, as_unit_float
from sepi.pipeline import estimate_depth
from sepi.report.pictures import map_picture
from sepi.scenes import render

Views = npt.NDArray[np.float64]


def _changed(light_field: LightField, views: Views) -> LightField:
    """The light field with other views, 0..1, as 8 bits."""
    return replace(light_field, views=np.round(255 * np.clip(views, 0, 1)).astype(np.uint8))


def _unit(light_field: LightField) -> Views:
    return as_unit_float(light_field.views).astype(np.float64)


def _ordered(light_field: LightField, order: str) -> LightField:
    """The light field with its views in another order of ``ORDERS``."""
    views: Any = light_field.views
    return replace(light_field, views=ORDERS[order](views))


def _row(sound: LightField, disturbed: LightField, words: str) -> list[Titled]:
    maps = estimate_depth(disturbed)
    title = f"map; mean confidence {float(maps.confidence.mean()):.2f}"
    return [view_panel(disturbed, words), map_panel(sound, maps.disparity, title), error_panel(sound, maps.disparity)]


def order(size: int) -> Draw:
    """Views whose columns run the other way, and views turned by half a turn: near and far exchanged."""
    sound = render("curved_occluders", size=size)
    panels = [view_panel(sound), truth_panel(sound)]
    for name in ("flip-columns", "flip-both"):
        disturbed = _ordered(sound, name)
        # as a range that is estimated would be: of both signs
        wide = replace(disturbed, disparity_range=DisparityRange(-3, 3, "given"))
        panels.append(map_panel(sound, estimate_depth(wide).disparity, f"map after {name}"))
    return sheet_of([panels])


def said_of_order(size: int) -> str:
    """What ``sepi check`` says of them."""
    sound = render("curved_occluders", size=size)
    lines = []
    for name in ("as-given", "flip-columns", "flip-both"):
        found = check_order(_ordered(sound, name))
        lines.append(textwrap.fill(f"{name}: {found.verdict()}", 72, subsequent_indent="    "))
    return "\n".join(lines) + "\n"


def narrow_range(size: int) -> Draw:
    """A range that ends before the nearest and the farthest surfaces."""
    sound = render("curved_occluders", size=size)
    narrow = sound.with_range(DisparityRange(-1.0, 1.0, "given"))
    found, cut = (estimate_depth(field).disparity for field in (sound, narrow))
    return sheet_of(
        [
            [
                truth_panel(sound),
                map_panel(sound, found, "searched from -2.7 to 2.1"),
                map_panel(sound, cut, "searched from -1 to 1"),
                error_panel(sound, cut),
            ]
        ]
    )


def noise(size: int) -> Draw:
    """White noise in every view, of three deviations."""
    sound = render("pyramids", size=size)
    rows = []
    for deviation in (0.05, 0.15, 0.3):
        rng = np.random.default_rng(1)
        views = _unit(sound) + deviation * rng.standard_normal(sound.views.shape)
        rows.append(_row(sound, _changed(sound, views), f"noise of {100 * deviation:g} %"))
    return sheet_of(rows)


def bare(size: int) -> Draw:
    """A scene a third of which carries no texture."""
    sound = render("wall", size=size)
    maps = estimate_depth(sound)
    return sheet_of(
        [
            [
                view_panel(sound),
                truth_panel(sound),
                map_panel(sound, maps.disparity, "map"),
                error_panel(sound, maps.disparity),
                ("confidence", map_picture(maps.confidence, (0, 1), "gray")),
            ]
        ]
    )


def reflection(size: int) -> Draw:
    """A pane that mirrors something far behind the camera: a second picture that moves otherwise."""
    sound = render("pyramids", size=size)
    mirrored = render("fronto_parallel", size=size, views=3).reference_view.astype(np.float64)
    rows = []
    for share in (0.1, 0.3, 0.5):
        rows.append(_row(sound, _behind_pane(sound, mirrored, share), f"{100 * share:g} % mirrored"))
    return sheet_of(rows)


def _behind_pane(sound: LightField, mirrored: Views, share: float) -> LightField:
    """The left half of every view, with ``share`` of a picture that moves by -2 pixels per view step."""
    from scipy.ndimage import shift

    views = _unit(sound)
    left = slice(0, sound.shape[1] // 2)
    for t, s in np.ndindex(sound.grid):
        # seen at (y, x) - d * baseline: the picture is moved by -d * baseline
        down, across = 2 * sound.baselines[t, s]
        moved = shift(mirrored, (down, across, 0), order=1, mode="mirror")
        views[t, s][:, left] = (1 - share) * views[t, s][:, left] + share * moved[:, left]
    return _changed(sound, views)


def crooked(size: int) -> Draw:
    """Views that are not rectified: each is a little aside of where it should be."""
    sound = render("pyramids", size=size)
    return sheet_of([_row(sound, _jittered(sound, by), f"views aside by {by:g} px") for by in (0.1, 0.5, 1.5)])


def _jittered(sound: LightField, by: float) -> LightField:
    from scipy.ndimage import shift

    rng = np.random.default_rng(1)
    views = _unit(sound)
    for t, s in np.ndindex(sound.grid):
        if sound.baselines[t, s].any():
            views[t, s] = shift(views[t, s], (*(by * rng.standard_normal(2)), 0), order=1, mode="nearest")
    return _changed(sound, views)


DRAWINGS: dict[str, Callable[[int], Draw]] = {
    "wrong-order": order,
    "narrow-range": narrow_range,
    "noise": noise,
    "bare": bare,
    "reflection": reflection,
    "crooked": crooked,
}
"""File's name to what draws it at a size in pixels."""
