"""Detection of view order and disparity range in correct light fields and in disturbed copies of them.

The view order of a copy is changed in every way. A verdict is *right* if it names the correction, *wrong* if it names
another one, and *open* if it is undecided (or cannot tell near from far).
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from typing import NamedTuple

import cv2
import numpy as np
import numpy.typing as npt

from sepi.errors import SepiError
from sepi.inspection.arrangement import settle_row_spacing
from sepi.inspection.disparity_range import estimate_range
from sepi.inspection.view_order import change_of_order, check_order, turned_by_half
from sepi.io.readers.options import AS_GIVEN, ORDERS
from sepi.lightfield import DisparityRange, LightField, as_unit_float

View = npt.NDArray[np.uint8]


class Disturbance(NamedTuple):
    """A disturbance of a light field, and its factor on disparities."""

    change: Callable[[LightField], LightField]
    factor: float = 1.0


def _each_view(change: Callable[[View, tuple[int, int]], View]) -> Callable[[LightField], LightField]:
    """Change views individually; ``change`` gets an 8-bit view and its baseline in views."""

    def of(light_field: LightField) -> LightField:
        eight = np.rint(255 * np.clip(as_unit_float(light_field.views), 0, 1)).astype(np.uint8)
        t0, s0 = light_field.reference_position
        rows, columns = light_field.grid
        views = [change(eight[t, s], (t - t0, s - s0)) for t, s in np.ndindex(rows, columns)]
        stack = np.stack(views)
        return replace(light_field, views=stack.reshape(rows, columns, *stack.shape[1:]), ground_truth=None, masks={})

    return of


def _jpeg(view: View, baseline: tuple[int, int]) -> View:
    _, data = cv2.imencode(".jpg", view, [cv2.IMWRITE_JPEG_QUALITY, 30])
    return np.asarray(cv2.imdecode(data, cv2.IMREAD_UNCHANGED), np.uint8).reshape(view.shape)


def _noise(view: View, baseline: tuple[int, int]) -> View:
    rng = np.random.default_rng([abs(baseline[0]), abs(baseline[1]), baseline[0] > 0, baseline[1] > 0])
    return np.asarray(np.clip(np.rint(view + rng.normal(0, 10, view.shape)), 0, 255), np.uint8)


def _grey(view: View, baseline: tuple[int, int]) -> View:
    return np.asarray(np.rint(view.mean(axis=2, keepdims=True)), np.uint8)


def _half(view: View, baseline: tuple[int, int]) -> View:
    size = (view.shape[1] // 2, view.shape[0] // 2)
    return np.asarray(cv2.resize(view, size, interpolation=cv2.INTER_AREA), np.uint8).reshape(size[1], size[0], -1)


def _darkened(light_field: LightField) -> LightField:
    """The outermost views at a fifth of their brightness, with the noise of a camera."""
    rows, columns = light_field.grid
    rng = np.random.default_rng(0)
    t, s = np.mgrid[:rows, :columns]
    border = ((t == 0) | (t == rows - 1)) & (rows > 2) | ((s == 0) | (s == columns - 1)) & (columns > 2)
    border[light_field.reference_position] = False
    views = light_field.views.copy()
    scale = 255 if views.dtype == np.uint8 else 65535 if views.dtype == np.uint16 else 1.0
    dark = 0.2 * views[border] + rng.normal(0, 0.01 * scale, views[border].shape)
    views[border] = np.clip(dark, 0, scale).astype(views.dtype)
    return replace(light_field, views=views)


def _every_second(light_field: LightField) -> LightField:
    (t0, s0), (rows, columns) = light_field.reference_position, light_field.grid
    kept = np.s_[t0 % 2 :: 2, s0 % 2 :: 2]
    if min(light_field.views[kept].shape[:2]) < 2 <= min(rows, columns) or max(light_field.views[kept].shape[:2]) < 3:
        return light_field
    return replace(light_field, views=light_field.views[kept], present=light_field.present[kept], positions=None)


def _sixteen_bit(light_field: LightField) -> LightField:
    values = np.rint(65535 * np.clip(as_unit_float(light_field.views), 0, 1)).astype(np.uint16)
    return replace(light_field, views=values)


def _crop(light_field: LightField) -> LightField:
    """The central half of each side."""
    H, W = light_field.shape
    part = np.s_[:, :, H // 4 : H // 4 + max(H // 2, 2), W // 4 : W // 4 + max(W // 2, 2)]
    return replace(light_field, views=light_field.views[part], ground_truth=None, masks={})


DISTURBANCES = {
    "as it is": Disturbance(lambda light_field: light_field),
    "dark border views": Disturbance(_darkened),
    "noise of 10/255": Disturbance(_each_view(_noise)),
    "JPEG of quality 30": Disturbance(_each_view(_jpeg)),
    "grey": Disturbance(_each_view(_grey)),
    "half size": Disturbance(_each_view(_half), 0.5),
    "every second view": Disturbance(_every_second, 2.0),
    "16 bit": Disturbance(_sixteen_bit),
    "middle quarter": Disturbance(_crop),
}
"""Name to disturbance."""


class Verdicts(NamedTuple):
    """Results for one disturbed light field: how often the order was right, open and wrong, and the range."""

    orders: Counter[str]
    range: DisparityRange | None
    row_spacing: float


def disturbed_verdicts(light_field: LightField, turns: Iterable[str] = ORDERS) -> Iterator[tuple[str, Verdicts]]:
    """Each disturbance of a light field with correct view order, and its verdicts for the orders ``turns``."""
    for name, disturbance in DISTURBANCES.items():
        changed = disturbance.change(_bare(light_field))
        spaced = settle_row_spacing(changed)
        orders = Counter(_verdict(changed, turn) for turn in turns)
        try:
            known = estimate_range(spaced)
        except SepiError:
            known = None
        yield name, Verdicts(orders, known, spaced.row_spacing)


def _bare(light_field: LightField) -> LightField:
    """The light field without its known properties."""
    return replace(light_field, disparity_range=None, ground_truth=None, masks={}, camera=None, view=None)


def _verdict(light_field: LightField, turn: str) -> str:
    """Verdict on the light field with a changed view order."""
    (rows, columns), right = light_field.grid, change_of_order(turn, AS_GIVEN)
    numbers = ORDERS[turn](np.arange(rows * columns).reshape(rows, columns))
    views = light_field.views.reshape(rows * columns, *light_field.views.shape[2:])[numbers]
    turned = LightField(views, light_field.name, present=light_field.present.ravel()[numbers])
    found = check_order(settle_row_spacing(turned))
    if not found.clear:
        return "open"
    if found.sign_clear:
        return "right" if found.best in _same(right, turned.grid) else "wrong"
    possible = {*_same(right, turned.grid), *_same(turned_by_half(right), turned.grid)}
    return "open" if found.best in possible else "wrong"


def _same(order: str, grid: tuple[int, int]) -> set[str]:
    """Orders with the same effect on a grid; for a single row or column there are several."""
    numbers = np.arange(grid[0] * grid[1]).reshape(grid)
    return {other for other in ORDERS if np.array_equal(ORDERS[other](numbers), ORDERS[order](numbers))}
