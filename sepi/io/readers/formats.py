"""Formats of light fields: finding the format of a path, reading it, and its size from headers alone."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import partial
from importlib import import_module
from itertools import islice
from pathlib import Path
from typing import Any, NamedTuple

import h5py

from sepi.errors import SepiError
from sepi.io.disparity_maps import is_disparity
from sepi.io.files import DEFLATE_RATIO, naming
from sepi.io.hdf5 import has_dataset
from sepi.io.images import SUFFIXES, picture_header
from sepi.io.readers import array_files, exported, hci, image_folder
from sepi.io.readers.array_files import Arrays, hdf5_arrays, light_field_of, no_light_field
from sepi.io.readers.arrays import is_likely, readings, with_white
from sepi.io.readers.options import ReadOptions
from sepi.io.readers.view_files import has_rows
from sepi.lightfield import DisparityRange, LightField, Truth
from sepi.registry import Known
from sepi.validation import require_known


class Format(NamedTuple):
    """One format of light fields.

    Attributes
    ----------
    name, description : str
        For messages.
    matches : callable
        Whether a path looks like this format; quick. An error of reading counts as no.
    read : callable
        Light field of a path and :class:`ReadOptions`.
    options : tuple of str
        Options that the format uses, of those that not every one does.
    scales : bool
        Whether it reads values of any scale, and uses the option ``white``.
    loose : bool
        Whether it also matches what another format describes better; formats of extensions are asked before.
    read_truth : callable, optional
        Ground truth and masks alone, if ``read`` gives a light field without them; default: both come from ``read``.
    truth_files : callable
        Files of a path with ground truth and masks.
    size_of : callable, optional
        Number of views, height, width and bytes of a pixel at a path.
    files_of : callable, optional
        Files that are read of a path with options, and pictures of the size of a view.
    with_depths : callable, optional
        The light field, read again if its cameras need the depth of the scene, which is given or found.
    """

    name: str
    description: str
    matches: Callable[[Path], bool]
    read: Callable[[Path, ReadOptions], LightField]
    options: tuple[str, ...] = ()
    scales: bool = True
    loose: bool = False
    read_truth: Callable[[Path, ReadOptions], Truth] | None = None
    truth_files: Callable[[Path], Sequence[Path]] = lambda _: ()
    size_of: Callable[[Path], tuple[int, int, int, int]] | None = None
    files_of: Callable[[Path, ReadOptions], tuple[Sequence[Path], Sequence[Path]]] | None = None
    with_depths: Callable[[Path, LightField, ReadOptions, DisparityRange | None], LightField] | None = None


# most light fields that a message names
_LISTED = 3

# poses of LLFF, Gaussian splatting and NeuS
_POSES = ("poses_bounds.npy", "cameras.json", "cameras_sphere.npz")

# options that only some formats use
_SOME = ("grid", "pattern", "axes", "variable", "images", "reference", "follow_links")


# assumed where no header tells: a view of the benchmark
_USUAL_SIDE = 512
_USUAL_VIEWS = 81
_RGB = 3


class Size(NamedTuple):
    """Size of a light field.

    Attributes
    ----------
    views : int
        Number of views.
    height, width : int
        Size of a view in pixels.
    pixel_bytes : int
        Bytes of a decoded pixel: 3 for RGB of 8 bit.
    """

    views: int
    height: int
    width: int
    pixel_bytes: int = _RGB


def _size_of_array(arrays_in: Callable[[Path], Arrays], path: Path) -> Size:
    """Size of the views in the largest array that the file can hold, in the first order of its axes that is likely."""
    forms = {(one.shape, one.dtype.itemsize) for one in arrays_in(path).values() if is_likely(one.shape)}
    sizes = {form: math.prod(form[0]) * form[1] for form in forms}
    most = path.stat().st_size * DEFLATE_RATIO
    held = [form for form, size in sizes.items() if 0 < size <= most]
    if not held:
        raise SepiError(f"{path}: holds no array of views")
    shape, itemsize = max(held, key=sizes.__getitem__)
    axes = (readings(shape) or ["NHWC" if len(shape) == 4 else "TSHWC"])[0]
    size = dict(zip(axes, shape[len(shape) - len(axes) :], strict=True))
    views = size.get("N", 1) * size.get("T", 1) * size.get("S", 1)
    return Size(views, size["H"], size["W"], itemsize * size.get("C", 1))


# no digest check for many files: whoever reads the views checks the file
size_in_hdf5 = partial(_size_of_array, partial(hdf5_arrays, check=False))
"""Size of the light field in an HDF5 file, from the shapes of its arrays."""


def format_of_arrays(
    name: str, description: str, matches: Callable[[Path], bool], arrays_in: Callable[[Path], Arrays], **more: Any
) -> Format:
    """Format of files of arrays, of which one is the light field."""

    def read(path: Path, options: ReadOptions) -> LightField:
        return light_field_of(path, arrays_in(path), options)

    size_of = partial(_size_of_array, arrays_in)
    return Format(name, description, matches, read, ("grid", "axes", "variable"), size_of=size_of, **more)


_OWN = {
    # before other folders: its images may have any names
    "exported": Format(
        "exported folder",
        "written by 'sepi export'",
        exported.matches,
        exported.read,
        ("follow_links",),
        truth_files=exported.truth_files,
    ),
    "hci": Format(
        "HCI folder",
        "input_Cam000.png, ...",
        hci.matches,
        hci.read,
        ("grid", "follow_links"),
        read_truth=hci.read_truth,
        truth_files=hci.truth_files,
    ),
    "images": Format(
        "folder of views",
        "a numbered image for each",
        image_folder.matches,
        image_folder.read,
        ("grid", "pattern", "follow_links"),
        loose=True,
    ),
    "numpy": format_of_arrays("NumPy file", ".npy or .npz", array_files.matches_numpy, array_files.numpy_arrays),
    "hdf5": format_of_arrays(
        "HDF5 file", "with an array of all views", array_files.matches_hdf5, hdf5_arrays, loose=True
    ),
    # last, since it takes files too damaged to tell
    "sepi": Format(
        "sepi HDF5",
        "written by this package",
        exported.matches_own,
        exported.read_own,
        scales=False,
        loose=True,
        truth_files=lambda path: (path,),
        size_of=size_in_hdf5,
    ),
}
FORMATS: Known[Format] = Known("readers", _OWN, lambda name, module: import_module(module).FORMATS[name])
"""Word for ``--format`` to format."""


def matching(path: Path) -> Format | None:
    """The format that a path looks like; those of extensions are asked only if no other but a loose one matches."""
    return next((known for known in _as_asked() if _matches(known, path)), None)


def _matches(known: Format, path: Path) -> bool:
    with suppress(SepiError, OSError):
        return known.matches(path)
    return False


def _as_asked() -> Iterator[Format]:
    yield from (known for known in _OWN.values() if not known.loose)
    yield from (FORMATS[word] for word in FORMATS if word not in _OWN)
    yield from (known for known in _OWN.values() if known.loose)


def format_of(path: Path, file_format: str | None = None) -> Format:
    """Format of a light field, from its content.

    Parameters
    ----------
    path : Path
    file_format : str, optional
        Key of :data:`FORMATS`, in place of looking.

    Raises
    ------
    SepiError
        If ``path`` does not exist or has no known format, or ``file_format`` is unknown.
    """
    if file_format is not None:
        require_known("format", [file_format], FORMATS)
    if not path.exists():
        raise SepiError(f"{path}: no such file or folder")
    if file_format is not None:
        return FORMATS[file_format]
    found = matching(path) if path.name not in _POSES else None
    if found is not None:
        return found
    poses = next((one for one in (path, *map(path.joinpath, _POSES)) if one.name in _POSES and one.is_file()), None)
    if poses is not None:
        raise SepiError(
            f"{path}: {poses.name} has camera poses of a kind that is not read; expected transforms.json, a COLMAP "
            "model or a table of cameras; 'sepi calibrate' finds them anew, and a folder of a grid of views needs none"
        )
    inner = list(islice(_inside(path), _LISTED)) if path.is_dir() and not _is_result(path) else []
    if inner:
        named = f", such as {', '.join(map(str, inner))}"
        with suppress(OSError):
            named += "; if they are the rows of one, pass --format images" * has_rows(path, surely=False)
        raise SepiError(f"{path}: a folder of light fields; give one of them{named}")
    expected = ", ".join(f"{known.name} ({known.description})" for known in FORMATS.values())
    raise SepiError(f"{path}: {_what_else(path)}; expected {expected}")


def read(path: Path, options: ReadOptions, file_format: str | None = None, *, truth: bool = True) -> LightField:
    """Read a light field of any known format.

    Parameters
    ----------
    path : Path
        File or folder.
    options : ReadOptions
    file_format : str, optional
        Key of :data:`FORMATS`, in place of looking.
    truth : bool
        False: read no ground truth and masks.

    Returns
    -------
    LightField
        ``disparity_range`` is None if the files do not give it.
    """
    known = format_of(path, file_format)
    _require_used(path, known, options)
    with naming(path):
        light_field = known.read(path, options)
        if not truth:
            light_field = replace(light_field, ground_truth=None, masks={})
        elif known.read_truth is not None:
            ground_truth, masks = known.read_truth(path, options)
            light_field = replace(light_field, ground_truth=ground_truth, masks=masks)
        if options.white is not None and not known.scales:
            views = with_white(light_field.views, light_field.present, path, options.white)
            light_field = replace(light_field, views=views)
        seen = options.view if light_field.arranged else None
        return light_field if seen is None else light_field.seen_from(seen)


def read_truth(path: Path, options: ReadOptions, file_format: str | None = None) -> Truth:
    """Ground truth and masks of the light field that :func:`read` gives with ``truth=False``."""
    known = format_of(path, file_format)
    if known.read_truth is None:
        light_field = read(path, options, file_format)
        return light_field.ground_truth, light_field.masks
    with naming(path):
        return known.read_truth(path, options)


def _require_used(path: Path, known: Format, options: ReadOptions) -> None:
    """Raise if an option is given that the format does not use."""
    for name in _SOME:
        if getattr(options, name) not in (None, False) and name not in known.options:
            others = ", ".join(other.name for other in FORMATS.values() if name in other.options)
            flag = "--" + name.replace("_", "-")
            raise SepiError(f"{path}: {flag} does not apply to this format ({known.name}); it is for: {others}")


def _what_else(path: Path) -> str:
    """Kind of a path that is not a light field, for the message."""
    if _is_result(path):
        return "holds a disparity map, not a light field"
    if any(one.suffix.lower() in (".lfr", ".lfp", ".raw") and one.is_file() for one in (path, *path.glob("*"))):
        return "raw data of a Lytro camera; decode it with the Light Field Toolbox (MATLAB) or PlenoptiCam (Python)"
    if path.is_file() and path.suffix.lower() in SUFFIXES:
        return "a single image; give the folder of all views, or --format mosaic or eslf with --grid ROWSxCOLUMNS"
    if path.is_file() and h5py.is_hdf5(path):
        with suppress(SepiError):
            arrays = hdf5_arrays(path)
            if any(len(one.shape) > 1 for one in arrays.values()):
                return no_light_field(arrays)
    return "not a light field of a known format"


def _is_result(path: Path) -> bool:
    return has_dataset(path / "result.h5" if path.is_dir() else path, "disparity")


def _inside(folder: Path, depth: int = 1) -> Iterator[Path]:
    """Light fields in a folder and its subfolders, as far as they are readable."""
    with suppress(OSError):
        for entry in sorted(folder.iterdir()):
            # reading an empty special file may never end
            if entry.name.startswith(".") or (entry.is_file() and not entry.stat().st_size):
                continue
            # tables of numbers, such as poses, are not light fields
            table = entry.suffix.lower() in (".npy", ".npz") and is_disparity(entry)
            if not table and matching(entry) is not None:
                yield entry
            elif depth and entry.is_dir() and not entry.is_symlink():
                yield from _inside(entry, depth - 1)


def size_of(files: Sequence[Path]) -> Size:
    """Size of the light field that these files hold together; no values are read.

    Each of several images is a view. In arrays, the largest counts, with the first order of its axes that is likely;
    other formats tell it themselves. If nothing tells, the largest file is taken as uncompressed pixels. The reader
    reports damaged files.
    """
    pictures = [path for path in files if path.suffix.lower() in SUFFIXES]
    with suppress(SepiError):
        if len(pictures) > 1:
            header = picture_header(pictures[0])
            return Size(len(pictures), header.height, header.width, header.pixel_bytes)
        known = matching(files[0]) if len(files) == 1 else None
        if known is not None and known.size_of is not None:
            return Size(*known.size_of(files[0]))
    if len(pictures) > 1:
        return Size(len(pictures), _USUAL_SIDE, _USUAL_SIDE)
    values = max((path.stat().st_size for path in files), default=0)
    side = max(1, math.isqrt(values // (_RGB * _USUAL_VIEWS)))
    return Size(_USUAL_VIEWS, side, side)
