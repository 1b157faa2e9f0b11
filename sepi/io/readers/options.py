"""Options for reading a light field, and the arrangement of its views in a grid.

Readers find a grid of views in the files, the *given* grid. :class:`ReadOptions` turn it into the light field's grid:
``central`` keeps its middle, ``order`` flips and transposes it, ``exclude`` leaves views out. The positions in
``exclude`` and ``view`` are those in the light field's grid, as ``sepi info`` counts them.

Examples
--------
Two orders of a grid of 2 x 3 views:

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
from sepi.validation import described, is_finite, require_known, require_type, whole_pair
from sepi.validation.models import AS_PAIR

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
"""The eight orders of a grid: functions from the given grid to the light field's."""

_PART = re.compile(r"(\d{1,6})[xX](\d{1,6})\+(\d{1,6})\+(\d{1,6})")
_POSITION = re.compile(r"\s*(\d{1,6})\s*,\s*(\d{1,6})\s*")


@dataclass(frozen=True)
class ReadOptions:
    """Options that the user gives for a light field; None or empty: the reader decides.

    Attributes
    ----------
    grid : tuple of int, optional
        Rows and columns of the given grid.
    pattern : str, optional
        File name of a view with ``{row}`` and ``{column}``, or ``{number}``, for folders of images; ``*`` matches any
        text.
    axes : str, optional
        Order of the axes of an array, such as ``"HWTSC"``: T, S (row and column of the view) or N (both in one); H, W
        (of the pixel); C (colour).
    variable : str, optional
        Name of the array in a file that holds several.
    central : int, optional
        Keep only the ``n x n`` views in the middle of the given grid; ``n`` is odd.
    order : str
        One of :data:`ORDERS`.
    exclude : tuple of str
        Views to leave out: positions ``"T,S"`` or file names.
    view : tuple of int, optional
        Position ``(t, s)`` of the reference view; default: the centre view.
    row_spacing : float, optional
        Distance of neighbouring rows of views in the light field's grid, in view steps.
    white : float, optional
        Value of white if it is not the highest of the type: 1023 in files of 10 bits.
    images : str, optional
        Folder of the images of calibrated cameras, if they are not beside the model.
    reference : str, optional
        Image of a calibrated camera that becomes the reference view; default: the most central one.
    crop_of : str, optional
        For cropped views: size of the whole image, and column and row in it of a view's first pixel,
        ``"512x512+100+80"``. Sensor size, principal point and ``parameters.cfg`` belong to the whole image.
    follow_links : bool
        Read views that are links to files outside their folder.

    Raises
    ------
    SepiError
        If a value is of another type or out of range.

    Examples
    --------
    Images named by column and row, without the corners:

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
        """``crop_of`` as :func:`sepi.camera.camera_from` takes it."""
        found = _PART.fullmatch(self.crop_of or "")
        return None if found is None else (int(found[1]), int(found[2]), int(found[3]), int(found[4]))


def cut_like_views(values: Map, shape: tuple[int, int], part: Part | None) -> Map:
    """Map of the whole image, cropped like views of this ``shape`` (:attr:`ReadOptions.part`).

    A map that does not have the size of the whole image stays unchanged.
    """
    if part is None or values.shape == shape or values.shape != part[1::-1]:
        return values
    left, top = part[2:]
    return values[top : top + shape[0], left : left + shape[1]]


def arrange_numbers(
    source: str, grid: tuple[int, int], options: ReadOptions, names: Mapping[str, int] | None = None
) -> Numbers:
    """Number in the given grid of the view at each position of the light field's grid.

    Parameters
    ----------
    source : str
        Path, for messages.
    grid : (int, int)
        Rows and columns ``(T, S)`` of the given grid.
    options : ReadOptions
    names : mapping of str to int, optional
        Number ``t * S + s`` of each file, for views excluded by name; -1 for files that are not views.

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
        # around the centre view of the light field; an even grid has one more row before it than after it
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
    """Options that apply before the grid of the views is known."""
    names = tuple(view for view in options.exclude if not is_position(view))
    return replace(options, central=None, order=AS_GIVEN, exclude=names, view=None)


def in_grid(options: ReadOptions) -> ReadOptions:
    """Options that still apply once the grid is found: files were excluded before."""
    return replace(options, exclude=tuple(filter(is_position, options.exclude)))


def position_of(numbers: Numbers, number: int) -> tuple[int, int] | None:
    """Position ``(t, s)`` of a view of the given grid; None if it was left out."""
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
        raise SepiError(f"{source}: --exclude {view}: expected a position ROW,COLUMN or the file of a view{found}")
    return names[view]


def _require_inside(source: str, numbers: Numbers, position: tuple[int, int]) -> None:
    T, S = numbers.shape
    if not (0 <= position[0] < T and 0 <= position[1] < S):
        raise SepiError(f"{source}: view {position[0]},{position[1]} lies outside the grid of {T}x{S}, counted from 0")
