"""The light field: a grid of views of one scene, its geometry, and its ground truth.

Conventions, shared by every module:

- views are ``(T, S, H, W, C)``: ``t`` is the row of the view grid (top to bottom), ``s`` its column (left to right);
- the centre view is ``(T // 2, S // 2)``; the *reference* view, whose depth is estimated, is the centre view unless
  another one is chosen;
- disparity ``d`` is in pixels per view step, positive when nearer than the focus plane; the reference-view
  pixel ``(y, x)`` is seen in view ``(t, s)`` at ``(y - d * (t - t0), x - d * (s - s0))``;
- a view step is the distance from one column of views to the next. If rows are another distance apart, or views stand
  off the grid, ``baselines`` replaces ``(t - t0, s - s0)``.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from types import NoneType
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from sepi.camera import Camera
from sepi.camera.rig import Rig
from sepi.errors import SepiError, one_line
from sepi.validation import described, is_finite, require_known, require_type, whole_pair

if TYPE_CHECKING:
    from sepi.process.workspace import Workspace

FloatMap = npt.NDArray[np.float32]
FloatArray = npt.NDArray[np.float64]
BoolMap = npt.NDArray[np.bool_]

Truth = tuple[FloatMap | None, Mapping[str, BoolMap]]
"""Ground truth of the reference view, and masks by name, for scores only."""

RANGE_SOURCES = ("parameters", "given", "estimated")
"""Sources of a disparity range."""

LOWEST, HIGHEST = -0.5, 1.5
"""Limits of float views, beyond 0..1 because resampling overshoots."""

_LARGEST_ODD_GRID = 1000
"""Most views of a grid with more rows and columns than a view has pixels; with more, the axes are mistaken."""

_GENEROUS = 100
"""Largest disparity range, as a multiple of the disparities that other views can show; a wide range only costs time."""

MIN_SIZE = 2
"""Least height and width of a view in pixels, for interpolation."""


@dataclass(frozen=True)
class DisparityRange:
    """Range of the candidate disparities.

    Attributes
    ----------
    minimum, maximum : float
        Pixels per view step; ``minimum < maximum``, both finite.
    source : str
        Source of the range: ``"parameters"`` (the scene's own file), ``"given"`` (flag or configuration) or
        ``"estimated"`` (from the views).

    Raises
    ------
    SepiError
        If a bound is not finite, or ``minimum`` not below ``maximum``.

    Examples
    --------
    >>> from sepi import DisparityRange
    >>> known = DisparityRange(-1.5, 1.5, "given")
    >>> known.candidates(4).tolist()
    [-1.5, -0.5, 0.5, 1.5]
    >>> DisparityRange(2, -2, "given")  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    sepi.errors.SepiError: disparity range (given): expected two finite numbers MIN < MAX ..., got 2 and -2
    """

    minimum: float
    maximum: float
    source: str

    def __post_init__(self) -> None:
        if not (is_finite(self.minimum) and is_finite(self.maximum) and self.minimum < self.maximum):
            raise SepiError(
                f"disparity range ({self.source}): expected two finite numbers MIN < MAX in pixels per view step, "
                f"got {described(self.minimum)} and {described(self.maximum)}"
            )

    def candidates(self, count: int) -> FloatMap:
        """Candidate disparities, uniform, both ends included.

        Parameters
        ----------
        count : int
            Number of candidates, at least 2.

        Returns
        -------
        ndarray, shape (count,), float32
            Pixels per view step, rising.
        """
        return np.linspace(self.minimum, self.maximum, count).astype(np.float32)


@dataclass(frozen=True)
class LightField:
    """A light field: views, their geometry, and ground truth if known.

    Attributes
    ----------
    views : ndarray, shape (T, S, H, W, C), uint8, uint16 or float32
        C is 1 or 3 (RGB). Integers span their whole range, floats 0..1.
    name : str
        Name of the scene.
    source : str
        Path that the light field was read from, or ``"built-in"``.
    present : ndarray, shape (T, S), bool
        Views that exist; the reference view must. Default: all.
    disparity_range : DisparityRange or None
        None if unknown; it can be estimated from the views.
    ground_truth : ndarray, shape (H, W), float32, or None
        Ground-truth disparity of the reference view, for evaluation only.
    masks : mapping of str to ndarray, shape (H, W), bool
        Named regions for evaluation (``"occluded"``, ``"textureless"``, ...).
    view : tuple of int or None
        Grid position ``(t0, s0)`` of the reference view; None: the centre view.
    row_spacing : float
        Distance from one row of views to the next, in view steps.
    positions : ndarray, shape (T, S, 2), float64, or None
        Position of each view, ``(down, across)`` in view steps from a common origin; None: on the grid, at
        ``(row_spacing * t, s)``. Positions of missing views do not count.
    camera : Camera or None
        Geometry that turns disparity into metric depth, if known.
    notes : tuple of str
        What the reader assumed or left out, for the user.
    arranged : bool
        False: the views stand in one row, in their order, and their grid is not yet known. Nothing can be matched until
        then, and the centre of the row may be missing.
    settled : bool
        True: ``row_spacing`` is known, and is not estimated from the views.
    reading : str
        Flags or options with which the source was read, as JSON, to read it the same way again.
    rig : Rig or None
        Position of the views in the world, and the calibrated cameras that they were rectified from, if any.
    missing : ndarray, shape (T, S, H, W), bool, or None
        Pixels that views lack because their cameras looked elsewhere; None: no pixels. Views repeat their nearest pixel
        there, so that filters end as at a picture's border, and stages compare nothing with it. (Compared methods that
        know no border do compare it.)
    files : ndarray, shape (T, S), str, or None
        Name of each view's file in the source's folder; None if views have no files of their own.
    directions : tuple of int
        1 or -1 if file names tell that the coordinates of cameras grow or fall from row to row, and from column to
        column; 0: unknown.
    workspace : Workspace or None
        Intermediate results that stages share (:mod:`sepi.process.workspace`); not part of the light field.

    Raises
    ------
    SepiError
        If a shape or dtype is not as above, floats are not finite or far outside 0..1, the row spacing is not positive,
        or the reference view lies outside the grid or is missing.

    Examples
    --------
    From an array of 3 x 4 grey views of 48 x 64 pixels, of which the first is missing:

    >>> import numpy as np
    >>> from sepi import LightField
    >>> views = np.random.default_rng(0).random((3, 4, 48, 64, 1)).astype(np.float32)
    >>> present = np.ones((3, 4), bool)
    >>> present[0, 0] = False
    >>> light_field = LightField(views, "noise", present=present)
    >>> light_field.grid, light_field.shape, light_field.reference_position
    ((3, 4), (48, 64), (1, 2))

    A pixel of disparity 2 is seen in the view below and to the left two pixels higher and two to the right:

    >>> (-2 * light_field.baselines[2, 1]).tolist()
    [-2.0, 2.0]
    """

    views: npt.NDArray[Any]
    name: str
    source: str = ""
    present: BoolMap = field(default=None)  # type: ignore[arg-type]
    disparity_range: DisparityRange | None = None
    ground_truth: FloatMap | None = None
    masks: Mapping[str, BoolMap] = field(default_factory=dict)
    view: tuple[int, int] | None = None
    row_spacing: float = 1.0
    positions: npt.NDArray[np.float64] | None = None
    camera: Camera | None = None
    notes: tuple[str, ...] = ()
    arranged: bool = True
    settled: bool = False
    reading: str = ""
    rig: Rig | None = None
    missing: BoolMap | None = None
    files: npt.NDArray[np.str_] | None = field(default=None, repr=False, compare=False)
    directions: tuple[int, int] = (0, 0)
    workspace: Workspace | None = field(default=None, repr=False, compare=False)

    def __post_init__(self) -> None:
        for key, (kind, expected) in _TYPES.items():
            require_type(f"{self.name}: {key}", getattr(self, key), kind, expected)
        for note in self.notes:
            require_type(f"{self.name}: notes", note, str, "a tuple of texts")
        if self.present is None:
            object.__setattr__(self, "present", np.ones(self.views.shape[:2], bool))
        if self.view is not None:
            position = whole_pair(f"{self.name}: view", self.view, "two whole numbers (t, s)")
            object.__setattr__(self, "view", position)
        # file names need not be printable text, but text that is printed and stored must be
        for key in ("name", "source"):
            object.__setattr__(self, key, _shown(getattr(self, key)))
        object.__setattr__(self, "notes", tuple(map(_shown, self.notes)))
        self._require_views()
        self._require_positions()
        if self.ground_truth is not None:
            object.__setattr__(self, "ground_truth", self.ground_truth.astype(np.float32, copy=False))
        if self.disparity_range is not None:
            require_known(f"{self.name}: source of the disparity range", [self.disparity_range.source], RANGE_SOURCES)

    def _require(self, holds: object, message: str) -> None:
        if not holds:
            raise SepiError(f"{self.name}: {message}")

    def _require_array(self, what: str, array: object, shape: tuple[int, ...], kinds: str) -> None:
        if array is not None:
            require_type(f"{self.name}: {what}", array, np.ndarray, "an array")
            assert isinstance(array, np.ndarray)
            expected = f"must be {'bool' if kinds == 'b' else 'numbers'} of shape {shape}"
            got = f"{array.dtype} of shape {array.shape}"
            self._require(array.shape == shape and array.dtype.kind in kinds, f"{what} {expected}, got {got}")

    def _require_views(self) -> None:
        """Raise unless the views have the right form, and the reference view and another one are present."""
        v, expected = self.views, "views must have shape (T, S, H, W, C)"
        self._require(v.ndim == 5 and v.shape[4] in (1, 3) and v.size, f"{expected} with C = 1 or 3, got {v.shape}")
        rows, columns, height, width, _ = v.shape
        self._require(
            rows <= height or columns <= width or rows * columns <= _LARGEST_ODD_GRID,
            f"{expected}, got a grid of {rows}x{columns} views of {width}x{height} pixels; "
            "views.transpose(2, 3, 0, 1, 4) puts (H, W, T, S, C) right",
        )
        self._require(rows * columns > 1, f"depth needs at least two views, got a grid of {rows}x{columns}")
        least = f"{MIN_SIZE}x{MIN_SIZE} pixels, got {width}x{height}"
        self._require(min(height, width) >= MIN_SIZE, f"views must be at least {least}")
        known = v.dtype in (np.uint8, np.uint16, np.float32)
        self._require(known, f"views must be uint8, uint16 or float32, got {v.dtype}")
        self._require_array("present", self.present, v.shape[:2], "b")
        self._require_array("missing", self.missing, v.shape[:4], "b")
        self._require_array("positions", self.positions, (rows, columns, 2), "fiu")
        self._require_array("ground_truth", self.ground_truth, self.shape, "fiu")
        for name, mask in self.masks.items():
            require_type(f"{self.name}: mask {name}", mask, np.ndarray, "an array")
            self._require_array(f"mask {name}", mask, self.shape, "b")
        t, s = self.reference_position
        ends = f"rows go from 0 to {rows - 1}, columns from 0 to {columns - 1}"
        self._require(0 <= t < rows and 0 <= s < columns, f"view {t},{s} lies outside the grid; {ends}")
        which = "centre view" if (t, s) == (rows // 2, columns // 2) else "view"
        self._require(
            self.present[t, s] or not self.arranged,
            f"the {which} (t, s) = {(t, s)} is missing, but its depth is estimated; choose another by --view (view=)",
        )
        others = f"depth needs at least two views, only the {which} {t},{s} is present"
        self._require(self.present.sum() > 1, others)
        if v.dtype == np.float32:
            _require_unit(self.name, v[self.present])

    def _require_positions(self) -> None:
        """Raise unless the views stand at different places."""
        spacing, at = self.row_spacing, self.positions
        message = f"row_spacing must be a positive number, got {described(spacing)}"
        self._require(is_finite(spacing) and spacing > 0, message)
        if at is not None:
            self._require(np.isfinite(at[self.present]).all(), "positions must be finite")
            same = len(np.unique(at[self.present], axis=0)) == 1
            self._require(not same, "positions must differ, got the same for all views")

    def require_seen_range(self) -> None:
        """Raise if the range goes far beyond the disparities that another view can show.

        Raises
        ------
        SepiError
            If it does, or the range is unknown.
        """
        known = self.require_disparity_range()
        others = without_reference(self, self.present)
        moved = np.abs(self.baselines[others]) / self.shape
        farthest = 1 / float(moved.max(axis=1).min())
        if max(abs(known.minimum), abs(known.maximum)) > _GENEROUS * farthest:
            raise SepiError(
                f"{self.name}: disparity range ({known.source}): {known.minimum:g} to {known.maximum:g} pixels per "
                f"view step; expected less than {farthest:g}, beyond which no other view shows the same points"
            )

    @property
    def reference_position(self) -> tuple[int, int]:
        """Grid position ``(t0, s0)`` of the reference view."""
        return self.view or (self.views.shape[0] // 2, self.views.shape[1] // 2)

    @property
    def from_centre(self) -> tuple[float, float]:
        """Baseline ``(down, across)`` from the grid's centre view to the reference view, in view steps."""
        (t, s), centre = self.reference_position, (self.grid[0] // 2, self.grid[1] // 2)
        if self.positions is not None and self.present[centre]:
            down, across = (self.positions[t, s] - self.positions[centre]).tolist()
            return down, across
        return (t - centre[0]) * self.row_spacing, float(s - centre[1])

    @property
    def reference_rig(self) -> Rig | None:
        """The rig with its origin at the reference view, and only that view's camera; None without a rig."""
        if self.rig is None or self.positions is None:
            return None
        at = self.reference_position
        return replace(self.rig.seen_from(self.positions[at]), views={at: self.rig.views[at]})

    @property
    def shape(self) -> tuple[int, int]:
        """Height and width of a view in pixels."""
        return self.views.shape[2], self.views.shape[3]

    @property
    def grid(self) -> tuple[int, int]:
        """Number of view rows and columns ``(T, S)``."""
        return self.views.shape[0], self.views.shape[1]

    @property
    def baselines(self) -> npt.NDArray[np.float64]:
        """Baseline ``(down, across)`` from the reference view to each view, in view steps; shape (T, S, 2).

        A pixel ``(y, x)`` of disparity ``d`` is seen in view ``(t, s)`` at ``(y, x) - d * baselines[t, s]``. Zero for
        missing views.
        """
        positions = self.positions
        if positions is None:
            positions = np.stack(np.meshgrid(*map(np.arange, self.grid), indexing="ij"), axis=2).astype(np.float64)
            positions[..., 0] *= self.row_spacing
        return np.where(self.present[..., None], positions - positions[self.reference_position], 0.0)

    @property
    def reach(self) -> float:
        """Distance of the farthest view from the reference view along either axis, in view steps."""
        return float(np.abs(self.baselines).max())

    @property
    def rgb_views(self) -> npt.NDArray[Any]:
        """The views with three channels, as all stages see them; shape (T, S, H, W, 3), read-only.

        Grey becomes three equal channels without a copy, so that a light field gives the same maps in grey and in RGB.
        """
        return np.broadcast_to(self.views, (*self.views.shape[:4], 3))

    @property
    def reference_view(self) -> FloatMap:
        """The reference view with three channels, in 0..1; shape (H, W, 3), float32."""
        return as_unit_float(self.rgb_views[self.reference_position])

    def require_disparity_range(self) -> DisparityRange:
        """The disparity range.

        Returns
        -------
        DisparityRange

        Raises
        ------
        SepiError
            If it is unknown.
        """
        if self.disparity_range is None:
            raise SepiError(f"{self.name}: disparity range unknown; expected one (MIN MAX, pixels per view step)")
        return self.disparity_range

    def with_range(self, disparity_range: DisparityRange) -> LightField:
        """The same light field with another disparity range.

        Parameters
        ----------
        disparity_range : DisparityRange
            The new range.

        Returns
        -------
        LightField
            Shares its arrays with this one.
        """
        return replace(self, disparity_range=disparity_range)

    def seen_from(self, view: tuple[int, int]) -> LightField:
        """The same light field with another reference view, without the ground truth and masks of the old one.

        Parameters
        ----------
        view : tuple of int
            Grid position ``(t, s)``, counted from 0.

        Returns
        -------
        LightField
            Shares its views with this one; the same object if it has this reference view already.

        Raises
        ------
        SepiError
            If there is no such view.

        Examples
        --------
        >>> from sepi.scenes import render
        >>> corner = render("dots", size=64, views=3).seen_from((0, 0))
        >>> corner.from_centre, corner.ground_truth is None
        ((-1.0, -1.0), True)
        """
        view = whole_pair(f"{self.name}: view", view, "two whole numbers (t, s)")
        if view == self.reference_position:
            return self
        return replace(self, view=view, ground_truth=None, masks={})


# field to its types, and what they are called
_TYPES: dict[str, tuple[type | tuple[type, ...], str]] = {
    **dict.fromkeys(("name", "source", "reading"), (str, "text")),
    "views": (np.ndarray, "an array of shape (T, S, H, W, C)"),
    "disparity_range": ((DisparityRange, NoneType), "a DisparityRange"),
    "camera": ((Camera, NoneType), "a Camera"),
    "notes": ((tuple, list), "a tuple of texts"),
    "masks": (Mapping, "names with arrays"),
}


def _shown(text: str) -> str:
    return one_line(text.encode("utf-8", "replace").decode())


def _require_unit(name: str, values: npt.NDArray[Any]) -> None:
    """Raise unless floats are finite and about 0..1 (:data:`LOWEST` to :data:`HIGHEST`)."""
    low, high = float(values.min()), float(values.max())
    if not (low >= LOWEST and high <= HIGHEST):
        raise SepiError(f"{name}: float views must be finite and within 0..1, got {low:g} to {high:g}")


def as_unit_float(values: npt.NDArray[Any]) -> FloatMap:
    """Pixel values as float32 in 0..1, rows contiguous; integers are divided by the largest value of their type.

    Parameters
    ----------
    values : ndarray, of any shape, uint8, uint16 or float
        Floats are taken as they are.

    Returns
    -------
    ndarray, of the same shape, float32

    Examples
    --------
    >>> import numpy as np
    >>> from sepi.lightfield import as_unit_float
    >>> [round(value, 3) for value in as_unit_float(np.array([0, 51, 255], np.uint8)).tolist()]
    [0.0, 0.2, 1.0]
    """
    values = np.ascontiguousarray(values)
    if np.issubdtype(values.dtype, np.integer):
        largest = np.iinfo(values.dtype).max
        return np.asarray(values.astype(np.float32) / np.float32(largest), np.float32)
    return values.astype(np.float32)


def require_light_field(value: object) -> None:
    """Raise unless a value is a light field, and not a path, for example."""
    require_type("light field", value, LightField, "a LightField, as sepi.read_light_field makes it")


def without_reference(light_field: LightField, views: BoolMap) -> BoolMap:
    """These views (T, S) without the reference view."""
    others = views.copy()
    others[light_field.reference_position] = False
    return others


def full_scale(dtype: npt.DTypeLike) -> float:
    """Pixel value that means 1.0."""
    return float(np.iinfo(dtype).max) if np.issubdtype(dtype, np.integer) else 1.0
