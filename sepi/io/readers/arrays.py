"""Light fields that arrive as one array."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from sepi.errors import SepiError
from sepi.io.readers.camera_positions import reordered
from sepi.io.readers.options import Numbers, ReadOptions, arrange_numbers, position_of, unarranged
from sepi.io.readers.scales import Scale, scale_of
from sepi.lightfield import BoolMap, LightField

Array = npt.NDArray[np.generic]

# "N" is the number t * S + s of a view
_LAYOUTS = ("TSHWC", "TSHW", "NHWC")
_AXES_HELP = "T, S: row and column of the view; H, W: of the pixel; C: colour"
# positions that a note lists
_LISTED = 12


def light_field_from_array(array: Array, path: Path, options: ReadOptions, *, axes: str | None = None) -> LightField:
    """A light field from an array of all its views.

    Views that are all zeros, or NaN throughout, are taken as missing (light field cameras have none in the corners,
    and their software pads with zeros), unless all views are. A fourth channel is left out: transparency, or a weight.

    Parameters
    ----------
    array : ndarray of 4 or 5 axes, integers or floats
        uint8 and uint16 span their whole range; floats 0..1. Others are 0 to 255 or 65535, as 8 or 16 bit.
    path : Path
        Where it comes from: name and source of the light field.
    options : ReadOptions
        ``axes``, ``grid``, ``central``, ``order``, ``exclude``, ``view`` and ``white`` are used.
    axes : str, optional
        Order of the axes where the format fixes it, as ``options.axes`` gives it elsewhere; guessed from the shape
        where neither is given.

    Returns
    -------
    LightField
        Views uint8, uint16 or float32 at their positions, zero where missing. Not arranged where the views have one
        axis and no grid is given.

    Raises
    ------
    SepiError
        If the axes cannot be told apart or contradict the options, the values are of another type or range, or a view
        that is not excluded holds some values that are not finite.
    """
    source = str(path)
    _require_pixel_type(source, array.dtype)
    given = axes or options.axes
    letters = _found_axes(source, array.shape, options.grid) if given is None else _checked_axes(source, array, given)
    stack, channel_notes = _as_stack(source, array, letters, options.grid)
    arranged = "N" not in letters or options.grid is not None
    if not arranged:
        options = unarranged(options)
    numbers = arrange_numbers(source, stack.shape[:2], options)
    scale = scale_of(source, stack, numbers, options.white)
    views: Array = np.zeros((*numbers.shape, *stack.shape[2:]), scale.dtype)
    # those left out are not even looked at
    unknown = _fill(views, stack, numbers, scale)
    present: BoolMap = np.any(views, axis=(2, 3, 4))
    black = [(t, s) for t, s in np.argwhere((numbers >= 0) & ~present).tolist() if (t, s) not in unknown]
    if not present.any():
        # a light field that is all black is none with all views missing
        for position in black:
            present[position] = True
        black = []
    reference = options.view or (numbers.shape[0] // 2, numbers.shape[1] // 2)
    if arranged and reference in [*black, *unknown]:
        raise SepiError(
            f"{source}: view {reference[0]},{reference[1]} is black (all zeros) or NaN, so taken as missing; depth is "
            "made for it, unless --view ROW,COLUMN names another"
        )
    assumed = [] if given else [f"axes taken as {' '.join(letters)}; --axes sets them otherwise"]
    missing = [*_missing_notes("all zeros", black), *_missing_notes("NaN throughout", unknown)]
    return LightField(
        views=views,
        name=path.stem,
        source=source,
        present=present,
        view=options.view,
        notes=(*assumed, *channel_notes, *scale.notes, *missing),
        arranged=arranged,
    )


def rearrange(light_field: LightField, options: ReadOptions) -> LightField:
    """A light field whose views are arranged as asked for; ground truth and masks stay with the view they belong to."""
    numbers = arrange_numbers(light_field.source or light_field.name, light_field.grid, options)
    T, S = light_field.grid
    if np.array_equal(numbers, np.arange(T * S).reshape(T, S)):
        return light_field
    # -1 picks the last view, which `present` then leaves out
    views = light_field.views.reshape(T * S, *light_field.views.shape[2:])[numbers]
    present = light_field.present.ravel()[numbers] & (numbers >= 0)
    views[~present] = 0
    missing = light_field.missing
    if missing is not None:
        missing = missing.reshape(T * S, *missing.shape[2:])[numbers] & present[..., None, None]
    positions, row_spacing = reordered(light_field.positions, light_field.row_spacing, options.order, numbers)
    view, truth, masks = options.view, None, {}
    position = position_of(numbers, light_field.reference_position[0] * S + light_field.reference_position[1])
    if position is not None and (light_field.view is not None or light_field.ground_truth is not None):
        view, truth, masks = position, light_field.ground_truth, dict(light_field.masks)
    return replace(
        light_field,
        views=views,
        present=present,
        view=view,
        ground_truth=truth,
        masks=masks,
        positions=positions,
        row_spacing=row_spacing,
        missing=missing,
    )


def with_white(views: Array, present: BoolMap, path: Path, white: float) -> Array:
    """Views (T, S, H, W, C) that have another value for white than their type says."""
    numbers = np.where(present, np.arange(present.size).reshape(present.shape), -1)
    scale = scale_of(str(path), views, numbers, white)
    scaled: Array = np.zeros(views.shape, scale.dtype)
    _fill(scaled, views, numbers, scale)
    return scaled


def _require_pixel_type(source: str, kind: np.dtype[Any]) -> None:
    if kind.kind not in "iuf" or kind.itemsize > 8:
        raise SepiError(f"{source}: values of type {kind}; expected integers such as uint8, or floats within 0..1")


def _checked_axes(source: str, array: Array, text: str) -> str:
    letters = text.upper()
    if sorted(letters) not in [sorted(layout) for layout in _LAYOUTS]:
        raise SepiError(
            f"{source}: --axes {text}: expected T, S, H and W once each, and C where there are colours, in the array's "
            f"order, such as HWTSC ({_AXES_HELP})"
        )
    if len(letters) != array.ndim:
        raise SepiError(f"{source}: --axes {text} names {len(letters)} axes, the array has {array.ndim}: {array.shape}")
    return letters


def _found_axes(source: str, shape: tuple[int, ...], grid: tuple[int, int] | None) -> str:
    """The order of the axes that the shape suggests."""
    found: list[str] = []
    if len(shape) == 5:
        channel = _channel_axis(shape)
        if channel is not None:
            pair = _pairs_in_order((*shape[:channel], *shape[channel + 1 :]))
            found = [letters[:channel] + "C" + letters[channel:] for letters in pair]
    elif len(shape) == 4:
        found = _pairs_in_order(shape)
        # a narrow third axis is rather a grid's than a picture's
        if shape[3] in (1, 3, 4) and shape[2] > 4:
            if grid is not None and shape[0] == math.prod(grid):
                return "NHWC"
            if grid is None and (not found or math.isqrt(shape[0]) ** 2 == shape[0]):
                found.append("NHWC")
            elif not found and grid is not None:
                raise SepiError(
                    f"{source}: {shape[0]} views of shape {shape[1:]} make no grid of {grid[0]}x{grid[1]}; "
                    "say their grid with --grid ROWSxCOLUMNS"
                )
    else:
        raise SepiError(f"{source}: expected an array of 4 or 5 axes, got {len(shape)}: {shape}")
    if len(found) == 1:
        return found[0]
    raise SepiError(
        f"{source}: the shape {shape} does not tell which axis is which; say it with --axes, such as "
        f"--axes {'TSHWC' if len(shape) == 5 else 'TSHW'} ({_AXES_HELP})"
    )


def _channel_axis(shape: tuple[int, ...]) -> int | None:
    """The axis of colours: the last one if it can be, else the only one that can be; None where that is not clear."""
    if shape[-1] in (1, 3, 4):
        # RGB and alpha, or a 4 x 4 grid of RGB views
        return None if shape[-1] == 4 and 3 in shape[:-1] else len(shape) - 1
    colours = [axis for axis, size in enumerate(shape) if size in (3, 4)]
    fitting = colours or [axis for axis, size in enumerate(shape) if size == 1]
    return fitting[0] if len(fitting) == 1 else None


def _pairs_in_order(shape: tuple[int, ...]) -> list[str]:
    """TSHW where the first two of four axes are clearly smaller than the others, HWTS the other way round."""
    first, last = shape[:2], shape[2:]
    if 2 * max(first) <= min(last):
        return ["TSHW"]
    return ["HWTS"] if 2 * max(last) <= min(first) else []


def _as_stack(source: str, array: Array, letters: str, grid: tuple[int, int] | None) -> tuple[Array, list[str]]:
    """The array as views (T, S, H, W, C), without copying, and what was assumed."""
    size = dict(zip(letters, array.shape, strict=True))
    if 0 in array.shape:
        raise SepiError(f"{source}: the array is empty: {array.shape}")
    if size.setdefault("C", 1) not in (1, 3, 4):
        raise SepiError(
            f"{source}: the axis of colours (axes {' '.join(letters)}) has size {size['C']}; expected 1, 3 or 4"
        )
    notes = ["4th channel (transparency or weight) left out"] if size["C"] == 4 else []
    if "N" in letters and grid is None:
        grid = 1, size["N"]
    elif "N" not in letters and grid not in (None, (size["T"], size["S"])):
        raise SepiError(
            f"{source}: --grid {grid[0]}x{grid[1]}, but the array has {size['T']}x{size['S']} views "
            f"(axes {' '.join(letters)})"
        )
    rows, columns = grid or (size["T"], size["S"])
    if rows * columns != size.get("N", rows * columns):
        raise SepiError(f"{source}: {size['N']} views make no grid of {rows}x{columns}; --grid ROWSxCOLUMNS sets it")
    views = array.transpose([letters.index(letter) for letter in "NTSHWC" if letter in letters])
    views = views.reshape(rows, columns, size["H"], size["W"], size["C"])
    # grey stays grey, the fourth channel goes
    return views[..., :3], notes


def _fill(views: Array, stack: Array, numbers: Numbers, scale: Scale) -> list[tuple[int, int]]:
    """Put the views in their positions; those that are NaN throughout stay zero and are returned."""
    unknown = []
    for t, s in np.argwhere(numbers >= 0).tolist():
        view = stack[divmod(int(numbers[t, s]), stack.shape[1])]
        if view.dtype.kind == "f" and np.isnan(view).all():
            unknown.append((t, s))
        elif scale.divisor == 1:
            views[t, s] = view
        else:
            values = view / scale.divisor
            views[t, s] = np.rint(values) if scale.dtype.kind == "u" else values
    return unknown


def _missing_notes(what: str, positions: Sequence[tuple[int, int]]) -> list[str]:
    listed = " ".join(f"{t},{s}" for t, s in positions[:_LISTED])
    more = f" and {len(positions) - _LISTED} more" if len(positions) > _LISTED else ""
    return [f"views that are {what} taken as missing: {listed}{more}"] if positions else []
