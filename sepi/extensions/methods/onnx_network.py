"""Learned methods: a network in an ONNX file as the initial depth.

``onnx`` runs any network that takes views of a light field and gives the disparity of its reference view, on the CPU by
ONNX Runtime [1]_. The package brings no network and no weights; docs/reproduce/compared.md says how to export one from
PyTorch or TensorFlow. The parameters describe the inputs and outputs of the network:

- ``inputs``: for each input of the network, in its order, which views it takes and how their axes lie, as
  ``"VIEWS: AXES"``. Views are ``all``, ``row`` and ``column`` (through the reference view), ``diagonal`` (down to the
  right), ``antidiagonal`` (down to the left; both are counted by ``t``), or ``each``: as many inputs as there are
  views, row by row. Axes are written as for einops [2]_: ``t s y x c`` for rows and columns of views, rows and columns
  of pixels and channels, ``1`` for an axis of length one, and several in brackets for their product;
- ``scale`` and ``offset`` of the colours, which lie in 0..1 before, ``grey`` for one channel, ``reversed`` for axes of
  views that the network counts from the other end;
- ``disparity_scale`` and ``disparity_offset`` that make pixels per view step, nearer positive, of its output;
- ``margin``: by how many pixels the output is smaller on each side (networks without padding); ``tile`` and
  ``overlap``: for processing a large image in tiles.

Networks give no confidence: it is 1 at every pixel.

References
----------
.. [1] https://onnxruntime.ai
.. [2] Rogozhnikov: Einops: clear and reliable tensor manipulations with Einstein-like notation. ICLR 2022.
"""

import re
from collections.abc import Iterator
from itertools import product
from pathlib import Path
from typing import Any, Literal, Self

import numpy as np
import numpy.typing as npt
from pydantic import Field, model_validator

from sepi.errors import SepiError
from sepi.extensions.methods.costs import GREY, Previous
from sepi.kernels import thread_count
from sepi.lightfield import FloatMap, LightField, as_unit_float
from sepi.matching.view_subsets import grid_steps
from sepi.stage import Choice, Parameters, Progress, StageMaps

VIEWS = ("all", "row", "column", "diagonal", "antidiagonal", "each")
"""Words for the views of an input."""

_AXES = "t s y x c"


class OnnxParameters(Parameters):
    """The network's file, inputs and outputs."""

    model: str | None = Field(None, description="path of the ONNX file; it must be given")
    inputs: tuple[str, ...] = Field(("all: 1 (t s c) y x",), min_length=1, description="'VIEWS: AXES' of each input")
    grid: tuple[int, int] | None = Field(None, description="rows, columns of views round the reference view; null: all")
    reversed: tuple[Literal["t", "s"], ...] = Field((), description="axes of views that the network takes reversed")
    grey: bool = Field(False, description="whether the network takes one channel, brightness")
    scale: float = Field(1.0, description="factor of the input colours, which are 0..1")
    offset: float = Field(0.0, description="added to the input colours after the factor")
    output: str | None = Field(None, description="name of the output with the disparity; null: the first")
    disparity_scale: float = Field(1.0, description="factor from the output to pixels per view step")
    disparity_offset: float = Field(0.0, description="added to the output after the factor, pixels per view step")
    margin: int = Field(0, ge=0, le=200, description="width that the output lacks on each side, pixels")
    tile: int | None = Field(None, ge=8, description="width of the output's tiles, pixels; null: one for all")
    overlap: int = Field(16, ge=0, description="overlap of neighbouring tiles, pixels")

    @model_validator(mode="after")
    def _can_be_followed(self) -> Self:
        for text in self.inputs:
            views, _, axes = text.partition(":")
            if views.strip() not in VIEWS or not re.fullmatch(r"[tsyxc1() ]+", axes):
                raise ValueError(f"inputs: expected 'VIEWS: AXES' such as 'row: 1 s y x', got '{text}'")
        if self.tile is not None and self.tile <= 2 * self.overlap:
            raise ValueError(f"tile: expected more than twice the overlap of {self.overlap}")
        return self

    @property
    def files(self) -> tuple[str, ...]:
        """The network's file."""
        return () if self.model is None else (self.model,)


def onnx(light_field: LightField, previous: Previous, parameters: OnnxParameters, progress: Progress) -> StageMaps:
    """Depth by a network.

    Returns
    -------
    StageMaps
        ``disparity``, float32, and a ``confidence`` of 1 everywhere; shape (H, W).

    Raises
    ------
    SepiError
        If ONNX Runtime is not installed, the file is not a network, or its inputs or outputs differ from the
        parameters.
    """
    session = _session(parameters)
    views, reference = _chosen_views(light_field, parameters)
    disparity = np.empty(light_field.shape, np.float32)
    tiles = list(product(*(_spans(length, parameters) for length in light_field.shape)))
    for number, ((rows, inner_y, to_y), (columns, inner_x, to_x)) in enumerate(tiles, start=1):
        given = _arrays(views[:, :, rows[:, None], columns], reference, parameters.inputs)
        shape = len(rows), len(columns)
        disparity[to_y, to_x] = _run(session, given, shape, parameters)[inner_y, inner_x]
        progress(number / len(tiles))
    disparity = disparity * np.float32(parameters.disparity_scale) + np.float32(parameters.disparity_offset)
    # the network's view step is between columns of views
    disparity /= np.float32(grid_steps(light_field)[1])
    return StageMaps(disparity, np.ones_like(disparity))


def _session(parameters: OnnxParameters) -> Any:
    if parameters.model is None:
        raise SepiError("initial.onnx.model: not given; expected the path of an ONNX file (docs/reproduce/compared.md)")
    if not Path(parameters.model).is_file():
        raise SepiError(f"{parameters.model}: no such file")
    try:
        import einops  # noqa: F401
        import onnxruntime
    except ImportError as error:
        raise SepiError(f"initial.onnx needs the package {error.name}; install sepi[onnx]") from error
    options = onnxruntime.SessionOptions()
    options.use_deterministic_compute = True
    options.intra_op_num_threads = thread_count()
    # errors are raised as exceptions
    options.log_severity_level = 4
    try:
        return onnxruntime.InferenceSession(parameters.model, options, providers=["CPUExecutionProvider"])
    except Exception as error:
        raise SepiError(f"{parameters.model}: not a network that ONNX Runtime reads ({error})") from error


def _chosen_views(light_field: LightField, parameters: OnnxParameters) -> tuple[FloatMap, tuple[int, int]]:
    """The network's views in its colour scale, (t, s, H, W, c) float32, and the index of the reference view.

    Raises
    ------
    SepiError
        If some views are missing.
    """
    rows, columns = parameters.grid or light_field.grid
    t, s = light_field.reference_position
    top, left = (t - rows // 2, s - columns // 2) if parameters.grid else (0, 0)
    if min(top, left) < 0 or top + rows > light_field.grid[0] or left + columns > light_field.grid[1]:
        held = f"{light_field.grid[0]}x{light_field.grid[1]}"
        raise SepiError(f"{light_field.name}: {held} views; the network takes {rows}x{columns} round view {t},{s}")
    part = np.s_[top : top + rows, left : left + columns]
    if not light_field.present[part].all():
        raise SepiError(f"{light_field.name}: the network needs all views of its grid, but some are missing")
    views = as_unit_float(light_field.rgb_views[part])
    if parameters.grey:
        views = (views @ GREY)[..., None]
    views = views * np.float32(parameters.scale) + np.float32(parameters.offset)
    t, s = t - top, s - left
    if "t" in parameters.reversed:
        views, t = views[::-1], rows - 1 - t
    if "s" in parameters.reversed:
        views, s = views[:, ::-1], columns - 1 - s
    return views, (t, s)


def _spans(length: int, parameters: OnnxParameters) -> Iterator[tuple[npt.NDArray[np.intp], slice, slice]]:
    """Tiles along one axis: indices of the views' pixels, the part of the output that is kept, and its position."""
    margin, tile, overlap = parameters.margin, parameters.tile or length, parameters.overlap if parameters.tile else 0
    core = tile - 2 * overlap
    for begin in range(0, length, core):
        end = min(begin + core, length)
        first = begin - overlap - margin
        window = np.clip(np.arange(first, first + tile + 2 * margin), 0, length - 1)
        yield window, np.s_[overlap : overlap + end - begin], np.s_[begin:end]


def _run(session: Any, given: list[FloatMap], shape: tuple[int, int], parameters: OnnxParameters) -> FloatMap:
    """The network's output for a window of the views; its shape is checked."""
    wanted = session.get_inputs()
    if len(given) != len(wanted):
        raise SepiError(f"{parameters.model}: has {len(wanted)} inputs but initial.onnx.inputs describes {len(given)}")
    kinds = {"tensor(float16)": np.float16, "tensor(double)": np.float64}
    named = {}
    for one, array in zip(wanted, given, strict=True):
        named[one.name] = np.ascontiguousarray(array, kinds.get(one.type, np.float32))
    name = parameters.output or session.get_outputs()[0].name
    try:
        found = np.asarray(session.run([name], named)[0], np.float32)
    except Exception as error:
        shapes = ", ".join(f"{key} {array.shape}" for key, array in named.items())
        raise SepiError(f"{parameters.model}: the network does not take {shapes} ({error})") from error
    height, width = (length - 2 * parameters.margin for length in shape)
    if [n for n in found.shape if n != 1] != [n for n in (height, width) if n != 1]:
        where = f"{parameters.model}: output '{name}' of shape {found.shape}"
        raise SepiError(f"{where}; expected {height}x{width} (initial.onnx.margin is {parameters.margin})")
    return found.reshape(height, width)


def _arrays(views: FloatMap, reference: tuple[int, int], inputs: tuple[str, ...]) -> list[FloatMap]:
    """The network's inputs, from views (t, s, y, x, c).

    Raises
    ------
    SepiError
        If the views have no such row, column or diagonal, or an omitted axis is longer than one.
    """
    from einops import EinopsError, rearrange

    found: list[FloatMap] = []
    for text in inputs:
        which, _, axes = text.partition(":")
        left = " ".join(axis if axis in axes else "1" for axis in _AXES.split())
        for selected in _selected(views, reference, which.strip()):
            try:
                found.append(rearrange(selected, f"{left} -> {axes.strip()}"))
            except EinopsError as error:
                lengths = dict(zip(_AXES.split(), selected.shape, strict=True))
                raise SepiError(f"initial.onnx.inputs: '{text}' does not fit views with {lengths}") from error
    return found


def _selected(views: FloatMap, reference: tuple[int, int], which: str) -> list[FloatMap]:
    """The views of an input, or of one input per view for ``each``; each (t, s, y, x, c)."""
    (rows, columns), (t, s) = views.shape[:2], reference
    if which == "each":
        return [views[i : i + 1, k : k + 1] for i in range(rows) for k in range(columns)]
    if "diagonal" not in which:
        return [{"all": views, "row": views[t : t + 1], "column": views[:, s : s + 1]}[which]]
    if rows != columns:
        raise SepiError(f"initial.onnx.inputs: {rows}x{columns} views have no diagonal")
    return [views[range(rows), range(rows)[:: 1 if which == "diagonal" else -1]][:, None]]


CHOICES = {"initial": {"onnx": Choice(OnnxParameters, onnx)}}
