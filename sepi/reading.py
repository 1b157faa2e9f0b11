"""Light fields of any format, read and checked, with a warning if the views seem to be in the wrong order."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path
from types import NoneType

import numpy as np

from sepi.errors import SepiError, warn
from sepi.inspection import view_order
from sepi.inspection.arrangement import arrange, settle_row_spacing
from sepi.inspection.array_axes import fitting_axes
from sepi.inspection.coded_views import told_of_coding
from sepi.inspection.view_layouts import Views
from sepi.io.provenance import reading_record
from sepi.io.readers.arrays import UnclearAxesError
from sepi.io.readers.formats import format_of, read
from sepi.io.readers.options import ReadOptions, in_grid, unarranged
from sepi.io.readers.view_grid import with_row_spacing
from sepi.lightfield import DisparityRange, LightField
from sepi.process.memory import take_blas_buffer
from sepi.validation import described, require_type

# 16-bit views darker than this, a sixteenth of the full scale, have fewer bits or hardly any light
_NARROW = 4096


def read_light_field(
    path: str | Path,
    *,
    disparity_range: tuple[float, float] | None = None,
    file_format: str | None = None,
    options: ReadOptions | None = None,
    check_order: bool = True,
    truth: bool = True,
) -> LightField:
    """A light field read from a file or folder of any known format.

    Parameters
    ----------
    path : str or Path
        File or folder.
    disparity_range : tuple of float, optional
        ``(minimum, maximum)`` in pixels per view step; default: the scene's own.
    file_format : str, optional
        ``"exported"``, ``"hci"``, ``"images"``, ``"eslf"``, ``"mosaic"``, ``"tiff-stack"``, ``"matlab"``, ``"numpy"``,
        ``"hci-2013"``, ``"openlf"``, ``"hdf5"`` or ``"sepi"``; default: recognised from the files.
    options : ReadOptions, optional
        Grid, name pattern, axes, order, views to leave out, reference view, row spacing or white, if the files do not
        tell them.
    check_order : bool
        Check the views: warn (:class:`SepiWarning`) if another order fits clearly better, and measure an unknown row
        spacing.
    truth : bool
        Whether to read ground truth and masks.

    Returns
    -------
    LightField
        Its ``disparity_range`` is None if neither the scene nor the caller gives one.

    Raises
    ------
    SepiError
        If there is no such file, the format is unknown, the files are damaged or contradict each other or the options,
        the grid of the views is ambiguous, or the views have no contrast to match.
    MemoryError
        If a limit on the process's address space is too small to check the views.

    Examples
    --------
    An array with the grid of views last, as some programs store it. Its sizes tell the axes; otherwise
    ``sepi.ReadOptions`` names them.

    >>> import numpy as np
    >>> import sepi
    >>> from sepi.scenes import render
    >>> views = render("pyramids", size=96, views=5).views  # (T, S, H, W, C)
    >>> np.save("pyramids.npy", views.transpose(2, 3, 0, 1, 4))
    >>> light_field = sepi.read_light_field("pyramids.npy", disparity_range=(-1.5, 1.5))
    >>> light_field.grid, light_field.shape, light_field.disparity_range.source
    ((5, 5), (96, 96), 'given')
    >>> bool((light_field.views == views).all())
    True
    """
    require_type("light field", path, (str, os.PathLike), "the path of a file or folder")
    path = Path(path)
    require_type(f"{path}: options", options, (ReadOptions, NoneType), "sepi.ReadOptions")
    options = options or ReadOptions()
    given = None if disparity_range is None else _given_range(path, disparity_range)
    # before the views take the memory
    take_blas_buffer()
    try:
        light_field = read(path, options, file_format, truth=truth)
    except UnclearAxesError as unclear:
        light_field = _with_axes(path, options, file_format, unclear)
    if light_field.rig is not None and light_field.disparity_range is None:
        with_depths = format_of(path, file_format).with_depths
        if with_depths is not None:
            light_field = with_depths(path, light_field, options, given)
    if not light_field.arranged:
        light_field = arrange(light_field, in_grid(options))
    _require_contrast(path, light_field)
    if check_order:
        views = Views(light_field)
    if options.row_spacing is not None:
        light_field = with_row_spacing(light_field, options.row_spacing)
    elif check_order:
        light_field = settle_row_spacing(light_field, views)
    record = reading_record(options, file_format)
    if record:
        # a file of this package may name other files, read with other options
        light_field = replace(light_field, source=str(path), reading=record)
    if given is not None:
        light_field = light_field.with_range(given)
    if coded := told_of_coding(light_field):
        light_field = replace(light_field, notes=(*light_field.notes, coded))
    found = [_depth_warning(light_field)]
    if check_order:
        checked = view_order.check_order(light_field, options.order, views)
        del views
        if light_field.rig is not None and checked.clear and checked.warning():
            raise SepiError(
                f"{path}: the views fit the poses only if turned over; expected poses of cameras that look along their "
                "z axis, with y down, and rotations from the world to the camera (OpenCV, COLMAP)"
            )
        found += [*view_order.odd_views(light_field), checked.warning()]
        if light_field.rig is None and (note := checked.note()):
            others = (note for note in light_field.notes if not note.startswith(view_order.SIGN_OPEN))
            light_field = replace(light_field, notes=(*others, note))
    for warning in filter(None, found):
        warn(f"{path}: {warning}")
    return light_field


def _with_axes(path: Path, options: ReadOptions, file_format: str | None, unclear: UnclearAxesError) -> LightField:
    """An array with ambiguous axes, read with those for which its views fit together."""
    tried = {axes: read(path, replace(unarranged(options), axes=axes), file_format) for axes in unclear.readings}
    axes = fitting_axes(tried)
    if axes is None:
        raise unclear
    light_field = read(path, replace(options, axes=axes), file_format)
    note = f"axes taken as {' '.join(axes)}, for which the views fit together; set others by --axes"
    return replace(light_field, notes=(note, *light_field.notes))


def _given_range(path: Path, bounds: tuple[float, float]) -> DisparityRange:
    try:
        minimum, maximum = bounds
    except (TypeError, ValueError) as error:
        raise SepiError(f"{path}: disparity_range: expected (minimum, maximum), got {described(bounds)}") from error
    return DisparityRange(minimum, maximum, "given")


def _depth_warning(light_field: LightField) -> str | None:
    """Warning about 16-bit files with fewer bits, since stages see nearly black views; None if all is well."""
    view = light_field.views[light_field.reference_position]
    brightest = int(view.max()) if view.dtype == np.uint16 else _NARROW
    if brightest >= _NARROW:
        return None
    bits = brightest.bit_length()
    advice = f"if the files have {bits} bits, give --white {2**bits - 1}"
    return f"the brightest pixel is {brightest} of 65535; {advice}"


def _require_contrast(path: Path, light_field: LightField) -> None:
    reference_view = light_field.reference_view
    if (reference_view == reference_view[0, 0]).all():
        colour = "black" if not reference_view.any() else "of one colour"
        t, s = light_field.reference_position
        raise SepiError(f"{path}: view {t},{s} is all {colour}; depth needs views with contrast")
    views = light_field.views
    places = np.argwhere(light_field.present)
    if all(np.array_equal(views[t, s], views[light_field.reference_position]) for t, s in places):
        raise SepiError(
            f"{path}: all {len(places)} views are the same picture; expected views from different places (was one "
            "copied over the others?)"
        )
