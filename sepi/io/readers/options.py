"""How to read a light field where its files do not say it all, and how its views are put in their positions.

Readers find a grid of views in the files, the *given* grid. What :class:`ReadOptions` asks for turns it into the
light field's grid: ``central`` cuts out its middle, ``order`` flips and transposes it, ``exclude`` leaves views out.
Positions that a user gives (``exclude``, ``view``) are always those in the light field's own grid, as ``sepi info``
counts them.

Examples
--------
What the orders do to a grid of 2 x 3 views:

>>> import numpy as np
>>> from sepi.io.readers.options import ORDERS
>>> list(ORDERS)[:5]
['as-given', 'flip-rows', 'flip-columns', 'flip-both', 'transpose']
>>> views = np.arange(6).reshape(2, 3)
>>> ORDERS["flip-rows"](views).tolist()
[[3, 4, 5], [0, 1, 2]]
>>> ORDERS["transpose"](views).tolist()
[[0, 3], [1, 4], [2, 5]]
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from types import NoneType
from typing import Annotated, Any

import numpy as np
import numpy.typing as npt
from pydantic import Field

from sepi.camera import Part
from sepi.errors import SepiError
from sepi.models import AS_PAIR
from sepi.validation import described, is_finite, require_known, require_type, whole_pair

Numbers = npt.NDArray[np.int64]
Map = npt.NDArray[Any]

Index = Annotated[int, Field(ge=0)]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
_Count = Annotated[int, Field(ge=1)]

AS_GIVEN = "as-given"

ORDERS: dict[str, Callable[[Numbers], Numbers]] = {
    AS_GIVEN: lambda grid: grid,
    "flip-rows": lambda grid: grid[::-1],
    "flip-columns": lambda grid: grid[:, ::-1],
    "flip-both": lambda grid: grid[::-1, ::-1],
    "transpose": lambda grid: grid.T,
    "transpose-flip-rows": lambda grid: grid.T[::-1],
    "transpose-flip-columns": lambda grid: grid.T[:, ::-1],
    "transpose-flip-both": lambda grid: grid.T[::-1, ::-1],
}
"""The eight ways to lay out a grid: each takes the given grid to the light field's."""

_PART = re.compile(r"(\d{1,6})[xX](\d{1,6})\+(\d{1,6})\+(\d{1,6})")
_POSITION = re.compile(r"\s*(\d{1,6})\s*,\s*(\d{1,6})\s*")


@dataclass(frozen=True)
class ReadOptions:
    """What the user says about a light field; None or empty where the reader is to find out.

    Attributes
    ----------
    grid : tuple of int, optional
        Rows and columns of the given grid.
    pattern : str, optional
        File name of a view with ``{row}`` and ``{column}``, or ``{number}``, for folders of pictures; ``*`` stands for
        anything.
    axes : str, optional
        Axes of an array in order, of the letters T, S (view row and column; N for both in one), H, W, C: ``"HWTSC"``.
    variable : str, optional
        Name of the array in a file that holds several.
    central : int, optional
        Keep only the ``n x n`` views in the middle of the given grid; ``n`` is odd.
    order : str
        One of :data:`ORDERS`.
    exclude : tuple of str
        Views to leave out: positions ``"T,S"`` or file names.
    view : tuple of int, optional
        Position ``(t, s)`` of the view whose depth is made; the centre view unless given.
    row_spacing : float, optional
        Distance from one row of views to the next in the light field's grid, as a multiple of that from one column to
        the next.
    white : float, optional
        Value that stands for white where it is not the highest of the type: 1023 in files of 10 bits.
    images : str, optional
        Folder of the pictures of calibrated cameras, where the model's own folder does not lead to them.
    reference : str, optional
        Picture of a calibrated camera whose depth is made; that of the most central one unless given.
    crop_of : str, optional
        Where the views were cut out of the pictures that the camera took: the size of those, and the column and row in
        them of a view's first pixel, ``"512x512+100+80"``. Sensor size, principal point and ``parameters.cfg`` belong
        to the whole picture.
    follow_links : bool
        Read views that are links to files outside their folder.

    Raises
    ------
    SepiError
        If a value is of another type, or a number that it cannot be.

    Examples
    --------
    Pictures named by column and row, of which the corner ones are left out:

    >>> from pathlib import Path
    >>> import cv2
    >>> import sepi
    >>> from sepi.scenes import render
    >>> light_field = render("pyramids", size=96, views=3)
    >>> Path("pictures").mkdir()
    >>> for t in range(3):
    ...     for s in range(3):
    ...         written = cv2.imwrite(f"pictures/x{s}_y{t}.png", light_field.views[t, s, :, :, ::-1])
    >>> corners = ("0,0", "0,2", "2,0", "2,2")
    >>> options = sepi.ReadOptions(pattern="x{column}_y{row}.png", exclude=corners)
    >>> cross = sepi.read_light_field("pictures", options=options)
    >>> cross.present.astype(int).tolist()
    [[0, 1, 0], [1, 1, 1], [0, 1, 0]]
    >>> bool((cross.views[0, 1] == light_field.views[0, 1]).all())
    True
    """

    grid: Annotated[tuple[_Count, _Count] | None, AS_PAIR] = None
    pattern: str | None = None
    axes: str | None = None
    variable: str | None = None
    central: _Count | None = None
    order: str = AS_GIVEN
    exclude: tuple[str, ...] = ()
    view: Annotated[tuple[Index, Index] | None, AS_PAIR] = None
    row_spacing: Positive | None = None
    white: Positive | None = None
    images: str | None = None
    reference: str | None = None
    crop_of: str | None = None
    follow_links: bool = False

    def __post_init__(self) -> None:
        for name, example in (("grid", "(5, 7)"), ("view", "(2, 3)")):
            if (value := getattr(self, name)) is not None:
                object.__setattr__(self, name, whole_pair(f"options: {name}", value, f"two whole numbers {example}"))
        for name in ("pattern", "axes", "variable", "images", "reference", "crop_of"):
            require_type(f"options: {name}", getattr(self, name), (str, NoneType), "text")
        require_type("options: central", self.central, (int, np.integer, NoneType), "a whole number")
        require_type("options: exclude", self.exclude, (tuple, list), 'positions and names such as ("0,0", "a.png")')
        for view in self.exclude:
            require_type("options: exclude", view, str, 'positions "T,S" or names of files')
        object.__setattr__(self, "exclude", tuple(self.exclude))
        if self.crop_of is not None and _PART.fullmatch(self.crop_of) is None:
            raise SepiError(f"options: crop_of: expected WIDTHxHEIGHT+X+Y, got {described(self.crop_of)}")
        for name in ("row_spacing", "white"):
            if (number := getattr(self, name)) is not None and not (is_finite(number) and number > 0):
                raise SepiError(f"options: {name}: expected a number above 0, got {described(number)}")

    @property
    def part(self) -> Part | None:
        """What ``crop_of`` says, as :func:`sepi.camera.camera_from` takes it."""
        found = _PART.fullmatch(self.crop_of or "")
        return None if found is None else (int(found[1]), int(found[2]), int(found[3]), int(found[4]))


def cut_like_views(values: Map, shape: tuple[int, int], part: Part | None) -> Map:
    """A map of the whole picture cut as views of this ``shape`` were, which :attr:`ReadOptions.part` says; else itself.

    It stays as it is where it has another size than the whole picture.
    """
    if part is None or values.shape == shape or values.shape != part[1::-1]:
        return values
    left, top = part[2:]
    return values[top : top + shape[0], left : left + shape[1]]


def arrange_numbers(
    source: str, grid: tuple[int, int], options: ReadOptions, names: Mapping[str, int] | None = None
) -> Numbers:
    """Which view of the given grid stands at each position of the light field's grid.

    Parameters
    ----------
    source : str
        Path, for messages.
    grid : (int, int)
        Rows and columns ``(T, S)`` of the given grid.
    options : ReadOptions
    names : mapping of str to int, optional
        Number ``t * S + s`` of each file, so that views can be excluded by name; -1 for files that are no views.

    Returns
    -------
    ndarray, int64
        Number ``t * S + s`` in the given grid; -1 for excluded views.

    Raises
    ------
    SepiError
        If ``central``, ``order``, ``exclude`` or ``view`` does not fit the grid.
    """
    T, S = grid
    require_known("order", [options.order], ORDERS)
    numbers, side = np.arange(T * S).reshape(T, S), options.central
    if side is not None:
        # around the centre view, as the light field's convention has it; an even grid has one row more before it
        top, left = T // 2 - side // 2, S // 2 - side // 2
        if side < 1 or side % 2 == 0 or top < 0 or left < 0 or top + side > T or left + side > S:
            raise SepiError(f"{source}: the central {side}x{side} views of {T}x{S}; expected an odd number that fits")
        numbers = numbers[top : top + side, left : left + side]
    numbers = ORDERS[options.order](numbers)
    if options.view is not None:
        _require_inside(source, numbers, options.view)
    excluded = [_excluded(source, view, numbers, names or {}) for view in options.exclude]
    return np.where(np.isin(numbers, excluded), -1, numbers)


def is_position(view: str) -> bool:
    """Whether a view to exclude is named by its position."""
    return _POSITION.fullmatch(view) is not None


def unarranged(options: ReadOptions) -> ReadOptions:
    """What of the options means something before the grid of the views is known."""
    names = tuple(view for view in options.exclude if not is_position(view))
    return replace(options, central=None, order=AS_GIVEN, exclude=names, view=None)


def in_grid(options: ReadOptions) -> ReadOptions:
    """What of the options is left to do when the grid of the views is found: files were excluded before."""
    return replace(options, exclude=tuple(filter(is_position, options.exclude)))


def position_of(numbers: Numbers, number: int) -> tuple[int, int] | None:
    """Where a view of the given grid stands, ``(t, s)``; None where it was left out."""
    positions = np.argwhere(numbers == number)
    return (int(positions[0][0]), int(positions[0][1])) if len(positions) else None


def _excluded(source: str, view: str, numbers: Numbers, names: Mapping[str, int]) -> int:
    match = _POSITION.fullmatch(view)
    if match is not None:
        position = int(match[1]), int(match[2])
        _require_inside(source, numbers, position)
        return int(numbers[position])
    if view not in names:
        found = f" (found: {', '.join(sorted(names)[:3])}, ...)" if names else ""
        raise SepiError(f"{source}: view '{view}' to exclude: expected a position ROW,COLUMN or a view's file{found}")
    return names[view]


def _require_inside(source: str, numbers: Numbers, position: tuple[int, int]) -> None:
    T, S = numbers.shape
    if not (0 <= position[0] < T and 0 <= position[1] < S):
        raise SepiError(f"{source}: view {position[0]},{position[1]} lies outside the grid of {T}x{S}, counted from 0")
