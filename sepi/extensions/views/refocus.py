"""The command ``sepi refocus``: a folder of refocused images, with an index of where each is focused."""

import csv
import math
import os
import re
from collections.abc import Iterable, Sequence
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Any

import click
import numpy as np
import numpy.typing as npt

from sepi.camera import Camera
from sepi.cli.input_options import Geometry, Reading, camera_flags, default_folder, read_light_field_of, reading_flags
from sepi.errors import SepiError
from sepi.io.files import atomic_folder, atomic_path, naming, remove_files
from sepi.io.images import write_png
from sepi.lightfield import FloatMap, LightField, full_scale
from sepi.process.command import PATH, SepiCommand, progress_bar
from sepi.stage import part_of

INDEX = "focus.csv"
"""Name of the index: a row for each image."""

COLUMNS = ("file", "disparity", "depth_m", "x", "y")
"""Columns of the index; a value is empty if it is unknown or does not apply."""

ALL_IN_FOCUS = "all_in_focus.png"

ANIMATION = "focus.webp"
"""Endless animation of the focal stack from the nearest to the farthest image and back."""

# of an image of the animation
_PAUSE = 120
_QUALITY = 85

_MADE = re.compile(rf"focus_\d+\.png|{re.escape(ALL_IN_FOCUS)}|{re.escape(ANIMATION)}")


def stack_names(count: int) -> list[str]:
    """Names of the images of a focal stack: ``focus_01.png`` and so on."""
    digits = max(2, len(str(count)))
    return [f"focus_{number:0{digits}}.png" for number in range(1, count + 1)]


def write_refocused(
    folder: Path, rows: list[dict[str, str]], pictures: Iterable[FloatMap], dtype: npt.DTypeLike, *, animated: bool
) -> list[str]:
    """Write pictures and their index, and return the names of the files.

    A new folder appears whole or not at all. In an existing folder, files that an earlier index names are replaced once
    all new files are written, or removed; other files stay. Equal content gives equal bytes.

    Parameters
    ----------
    folder : Path
        Made if missing.
    rows : list of dict
        Row of the index for each picture, with the name of its file.
    pictures : iterable of ndarray, shape (H, W, C), float32
        Pictures in 0..1, consumed one by one.
    dtype : dtype
        That of the views: uint8 gives images of 8 bit, all others of 16 bit.
    animated : bool
        Also write the focal stack as an animation.

    Raises
    ------
    SepiError
        If the folder is a file, cannot be written or holds other files of these names, or the installed Pillow cannot
        write animations.
    """
    if animated:
        rows = [*rows, {"file": ANIMATION}]
    made, before = [*(row["file"] for row in rows), INDEX], _earlier_files(folder / INDEX)
    others = [name for name in made if name not in before and os.path.lexists(folder / name)]
    if others:
        raise SepiError(f"{folder}: {others[0]} there was not written by 'sepi refocus'; choose another folder")
    with atomic_folder(folder, add=True) as temporary:
        frames = []
        for name, picture in zip(made, pictures, strict=False):
            write_png(temporary / name, _levels(picture, dtype))
            if animated and name != ALL_IN_FOCUS:
                frames.append(_levels(picture, np.uint8))
        if animated:
            _write_animation(temporary / ANIMATION, frames)
        with (temporary / INDEX).open("w", encoding="ascii", newline="") as file:
            index = csv.DictWriter(file, COLUMNS, lineterminator="\n")
            index.writeheader()
            index.writerows(rows)
    remove_files(folder, set(before).difference(made))
    return made


def _levels(picture: FloatMap, dtype: npt.DTypeLike) -> npt.NDArray[Any]:
    """Levels of an image (H, W, C) in 0..1 for a PNG: (H, W) if grey; 8 bit for uint8, else 16 bit."""
    held = np.uint8 if np.dtype(dtype) == np.uint8 else np.uint16
    levels = np.rint(picture.astype(np.float64) * full_scale(held)).astype(held)
    return levels[..., 0] if levels.shape[2] == 1 else levels


def _write_animation(path: Path, frames: Sequence[npt.NDArray[Any]]) -> None:
    from PIL import Image, features

    if not features.check("webp"):
        raise SepiError(f"{path}: the installed Pillow has no WebP, which animations need")
    first, *more = (Image.fromarray(frame).convert("RGB") for frame in [*frames, *frames[-2:0:-1]])
    with atomic_path(path) as temporary:
        first.save(temporary, "WEBP", save_all=True, append_images=more, duration=_PAUSE, loop=0, quality=_QUALITY)


def _earlier_files(index: Path) -> list[str]:
    """Names of an earlier index and of the images in it; empty if there is none."""
    # a user's own file of this name stays, whatever it holds
    with suppress(OSError, UnicodeDecodeError, csv.Error):
        with index.open(encoding="ascii", newline="") as file:
            rows = list(csv.reader(file))
        if rows and tuple(rows[0]) == COLUMNS:
            return [INDEX, *(row[0] for row in rows[1:] if row and _MADE.fullmatch(row[0]))]
    return []


_STEPS = 9


@click.command(cls=SepiCommand)
@click.argument("light_field_path", metavar="INPUT", type=PATH)
@click.argument("result_path", metavar="[RESULT]", type=PATH, required=False)
@click.option("-o", "--output", type=PATH, help="Folder to write; default: NAME-refocused for an INPUT called NAME.")
@click.option(
    "--steps",
    type=click.IntRange(1, 999),
    help=f"Pictures from the nearest to the farthest surface; default: {_STEPS} without --disparity and --at.",
)
@click.option(
    "--disparity",
    "disparities",
    type=float,
    multiple=True,
    help="Focus at this disparity, pixels per view step; repeatable.",
)
@click.option(
    "--at", "pixels", type=click.IntRange(min=0), nargs=2, multiple=True, metavar="X Y", help="Pixel to focus on."
)
@click.option(
    "--aperture",
    type=float,
    help="Radius of the aperture in view steps; a smaller one has more in focus. Default: all views.",
)
@click.option("--animation", is_flag=True, help="Also write the stack as an animation, focus.webp.")
@click.option("--threads", type=click.IntRange(min=1), help="Threads to use; default: one per core.")
@camera_flags
@reading_flags
def refocus(
    light_field_path: Path,
    result_path: Path | None,
    output: Path | None,
    steps: int | None,
    disparities: tuple[float, ...],
    pixels: tuple[tuple[int, int], ...],
    aperture: float | None,
    animation: bool,
    threads: int | None,
    geometry: Geometry | None,
    reading: Reading,
) -> None:
    """Refocus the light field INPUT.

    RESULT is the map of INPUT: a folder that 'sepi depth' wrote, or a disparity map of another program (PFM, HDF5,
    .npy, 'disparity_16bit.png'). The folder records how INPUT was read. The command writes

    \b
    all_in_focus.png   mean of all views that see a pixel: as sharp as the view, less noise
    focus_01.png ...   focal stack: pictures of a large lens, focused from near to far
    focus.csv          disparity of each picture, and its depth in metres if the camera is known

    --at counts from 0 at the top left and needs RESULT; --disparity is in pixels per view step. Repeat both at will.

    Without RESULT, the stack covers INPUT's own or estimated disparity range; the gaps between the views show where it
    is out of focus, and there is no all_in_focus.png.

    \b
    Examples:
      sepi refocus cotton cotton-depth
      sepi refocus cotton cotton-depth --at 250 310 --aperture 3
      sepi refocus cotton --disparity -0.5 --disparity 1
    """
    from sepi.extensions.views import refocusing
    from sepi.io.result_files import require_target
    from sepi.process.threads import available_cores, use_threads

    use_threads(threads or available_cores())
    folder = output or default_folder(light_field_path, "refocused")
    require_target(folder)
    if light_field_path.resolve() == folder.resolve():
        raise SepiError(f"{folder}: is the light field itself; choose another folder for the pictures")
    if pixels and result_path is None:
        raise SepiError("--at: needs RESULT for the disparity of the pixel; 'sepi depth INPUT' makes it")
    light_field = read_light_field_of(light_field_path, result_path, reading)
    surfaces = known = None
    camera = light_field.camera
    if result_path is not None:
        surfaces, known, stored = _read_result(result_path, light_field_path, light_field, reading)
        camera = camera or stored
    if geometry is not None:
        camera = geometry(shape=light_field.shape)
    for value in disparities:
        if not math.isfinite(value):
            raise SepiError(f"--disparity {value}: expected a finite number of pixels per view step")
    foci: list[tuple[float, tuple[int, ...]]] = [(value, ()) for value in disparities]
    if known is not None:
        foci += [(_disparity_at(result_path, known, *pixel), pixel) for pixel in pixels]
    if steps or not foci:
        foci += [(value, ()) for value in _through(light_field, result_path, known, steps or _STEPS)]
    # from near to far
    foci.sort(key=lambda focus: -focus[0])
    depths = [] if camera is None else camera.depth(np.array([at for at, _ in foci], np.float32)).tolist()
    rows = [{"file": ALL_IN_FOCUS}] if surfaces is not None else []
    metres = [f"{depth:.6g}" for depth in depths] or [""] * len(foci)
    for name, (disparity, pixel), depth in zip(stack_names(len(foci)), foci, metres, strict=True):
        rows.append(dict(zip(COLUMNS, (name, f"{disparity:.6g}", depth, *map(str, pixel)), strict=False)))
    # fails before a picture is computed
    refocusing.views_within(light_field, aperture)
    makers = [partial(refocusing.refocus, light_field, at, surfaces, aperture=aperture) for at, _ in foci]
    if surfaces is not None:
        makers.insert(0, partial(refocusing.all_in_focus, light_field, surfaces))
    with progress_bar(light_field.name) as progress:
        pictures = (make(progress=part_of(progress, number, len(makers))) for number, make in enumerate(makers))
        files = write_refocused(folder, rows, pictures, light_field.views.dtype, animated=animation)
    told = ", ".join(f"{at:.3g}" for at, _ in foci)
    told_depths = f" ({', '.join(f'{depth:.3g}' for depth in depths)} m)" if depths else ""
    click.echo(f"focused at: {told} pixels per view step{told_depths}")
    if surfaces is None:
        click.echo("no all_in_focus.png: it needs RESULT, which 'sepi depth' makes")
    click.echo(f"written to {folder}/: {' '.join(files)}")


def _read_result(
    path: Path, light_field_path: Path, light_field: LightField, reading: Reading
) -> tuple[FloatMap, FloatMap, Camera | None]:
    """The map to focus by, the same with NaN at unknown pixels, and its camera if it records one."""
    from sepi.io.all_views import read_disparity_at, read_origin_at
    from sepi.io.result_folder import read_result

    view = reading.options.view
    disparity = read_disparity_at(path, view)
    if disparity.shape != light_field.shape:
        views = f"the views of {light_field_path} are {light_field.shape} (height, width)"
        raise SepiError(f"{path}: is {disparity.shape}, but {views}")
    if read_origin_at(path, view) is None:
        return disparity, disparity, None
    result = read_result(path, view)
    return disparity, np.where(result.unknown, np.float32(np.nan), disparity), result.camera


def _through(light_field: LightField, path: Path | None, known: FloatMap | None, count: int) -> list[float]:
    """Disparities from the nearest to the farthest surface of the map, else over the light field's range."""
    from sepi.extensions.views.refocusing import evenly_spaced, focal_stack
    from sepi.inspection.disparity_range import settle_range

    if known is not None:
        with naming(str(path)):
            return focal_stack(known, count)
    limits = settle_range(light_field).require_disparity_range()
    return evenly_spaced(limits.minimum, limits.maximum, count)


def _disparity_at(path: Path | None, known: FloatMap, x: int, y: int) -> float:
    height, width = known.shape
    if not (x < width and y < height):
        raise SepiError(f"--at {x} {y}: outside the picture; X goes from 0 to {width - 1}, Y from 0 to {height - 1}")
    if not math.isfinite(known[y, x]):
        raise SepiError(f"--at {x} {y}: {path} has no disparity for this pixel; choose one beside it")
    return float(known[y, x])
