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
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

from sepi.errors import SepiError

# the command line needs the flags alone: NumPy and pydantic are imported when an option is used
if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

    from sepi.camera import Part
    from sepi.validation.models import Count, Grid, Position, Positive

AS_GIVEN = "as-given"

ORDERS: dict[str, Callable[[npt.NDArray[np.int64]], npt.NDArray[np.int64]]] = {
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

POSITION = re.compile(r"\s*(\d{1,6})\s*,\s*(\d{1,6})\s*")
"""Position of a view in text, ``T,S``."""

_PART = re.compile(r"(\d{1,6})[xX](\d{1,6})\+(\d{1,6})\+(\d{1,6})")


def _option(description: str, metavar: str | None = None, default: Any = None) -> Any:
    return field(default=default, metadata={"help": description, "metavar": metavar})


@dataclass(frozen=True)
class ReadOptions:
    """Options that the user gives for a light field; None or empty: the reader decides.

    Flags of the command line, keys of the configuration and checks are made from this class.

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

    grid: Grid = _option("Grid of views in the files.", "ROWSxCOLUMNS")
    pattern: str | None = _option("Names of views: 'view_{row}_{column}.png' or 'img{number}.jpg'; * is any text.")
    axes: str | None = _option(
        "Axes of an array in order, such as HWTSC: T S (view row, column; N for both in one), H W and C (colour)."
    )
    variable: str | None = _option("Name of the array in a .mat, .npz or HDF5 file with several.")
    central: Count | None = _option("Use only the N x N views in the middle.", "N")
    order: str = _option("Order of the views: a name that 'sepi check' prints.", default=AS_GIVEN)
    exclude: tuple[str, ...] = _option("Leave out a view: ROW,COLUMN from 0, or file; repeatable.", "VIEW", default=())
    view: Position = _option("View whose depth is estimated; default: the centre view.", "ROW,COLUMN")
    row_spacing: Positive | None = _option("Distance of rows of views in steps of columns, if they differ.", "F")
    white: Positive | None = _option("Value of white: 1023 for 10 bits, 4095 for 12.", "W")
    images: str | None = _option("Pictures of calibrated cameras, if not beside the model.", "FOLDER")
    reference: str | None = _option(
        "Picture of the calibrated camera whose depth is estimated; default: the most central one.", "PICTURE"
    )
    crop_of: str | None = _option(
        "For crops: width and height of the whole picture, and column and row in it of a view's first pixel. "
        "Sensor size and calibration are those of the whole picture.",
        "WxH+X+Y",
    )
    follow_links: bool = _option("Read views that are links to files outside their folder.", default=False)

    def __post_init__(self) -> None:
        from sepi.validation.models import model_of, validated

        if isinstance(self.crop_of, str) and self.part is None:
            raise SepiError(f"options.crop_of: expected WIDTHxHEIGHT+X+Y, got {self.crop_of!r}")
        for name, value in vars(validated(model_of(ReadOptions), vars(self), "options")).items():
            object.__setattr__(self, name, value)

    @property
    def part(self) -> Part | None:
        """``crop_of`` as :func:`sepi.camera.camera_from` takes it."""
        found = _PART.fullmatch(self.crop_of or "")
        return None if found is None else (int(found[1]), int(found[2]), int(found[3]), int(found[4]))


def is_position(view: str) -> bool:
    """Whether a view to exclude is named by its position."""
    return POSITION.fullmatch(view) is not None


def unarranged(options: ReadOptions) -> ReadOptions:
    """Options that apply before the grid of the views is known."""
    names = tuple(view for view in options.exclude if not is_position(view))
    return replace(options, central=None, order=AS_GIVEN, exclude=names, view=None)


def in_grid(options: ReadOptions) -> ReadOptions:
    """Options that still apply once the grid is found: files were excluded before."""
    return replace(options, exclude=tuple(filter(is_position, options.exclude)))
