"""OpenEXR images of half and float, grey or in colour; the OpenEXR library is an optional extra."""

from __future__ import annotations

import importlib
import io
import os
import threading
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager, redirect_stdout, suppress
from pathlib import Path
from types import ModuleType

import numpy as np
import numpy.typing as npt

from sepi.errors import SepiError, printable
from sepi.io.files import atomic_path, naming
from sepi.lightfield import FloatMap

EXR = (".exr",)
"""Suffixes of file names, in lower case."""

SIGNATURE = b"v/1\x01"
"""First bytes of a file."""

_COLOURS = ("R", "G", "B")
_GREY = "Y"
# most channels that a message lists
_LISTED = 12


def open_exr() -> ModuleType:
    """The package that reads and writes OpenEXR.

    Raises
    ------
    SepiError
        If it is not installed.
    """
    try:
        return importlib.import_module("OpenEXR")
    except ImportError as error:
        raise SepiError("OpenEXR needs a package that is not installed; pip install 'sepi[exr]'") from error


def exr_form(path: str) -> tuple[int, int, list[str]]:
    """Height and width of an image, and the names of its grey or colour channels.

    Raises
    ------
    SepiError
        If the image is deep or cropped, or does not have exactly one set of grey or colour channels.
    """
    exr = open_exr()
    # the package's older class InputFile crashes on damaged files
    with _quiet(), exr.File(path, header_only=True) as file:
        header = file.header()
        data, display = ([corner.tolist() for corner in header[f"{of}Window"]] for of in ("data", "display"))
        channels = {channel.name: (channel.xSampling, channel.ySampling) for channel in header["channels"]}
        flat = header.get("type", exr.scanlineimage) in (exr.scanlineimage, exr.tiledimage)
        names = _chosen(list(channels))
    if not flat or data != display:
        raise SepiError("a deep or cropped OpenEXR; expected a flat one whose data and display windows are the same")
    if any(channels[name] != (1, 1) for name in names):
        raise SepiError("an OpenEXR with subsampled channels; save all channels in full size")
    (left, top), (right, bottom) = data
    return bottom - top + 1, right - left + 1, names


def exr_pixels(path: str) -> npt.NDArray[np.float32]:
    """Pixels (H, W, C) of a file whose size was checked; half becomes float, transparency is left out."""
    height, width, names = exr_form(path)
    with _quiet(), open_exr().File(path, separate_channels=True) as file:
        channels = file.channels()
        # a part with damaged pixels has no channels
        stored = [channels[name].pixels for name in names]
    if any(values.dtype not in (np.float16, np.float32) for values in stored):
        raise SepiError("an OpenEXR of integers; expected half or float")
    return np.stack([values.astype(np.float32).reshape(height, width) for values in stored], axis=2)


def _chosen(names: list[str]) -> list[str]:
    """The colour channels of the only layer that has them, or the only grey channel."""
    layers = dict.fromkeys(name.removesuffix("R") for name in names if name.endswith("R"))
    coloured = [layer for layer in layers if {f"{layer}{colour}" for colour in _COLOURS} <= set(names)]
    if "" in coloured or len(coloured) == 1:
        layer = "" if "" in coloured else coloured[0]
        return [f"{layer}{colour}" for colour in _COLOURS]
    if not coloured and (len(names) == 1 or (_GREY in names and not {"RY", "BY"} & set(names))):
        return [_GREY if _GREY in names else names[0]]
    listed = printable(", ".join(names[:_LISTED]))
    raise SepiError(f"an OpenEXR with the channels {listed}; expected R, G and B, or Y, or these in one layer alone")


_terminal = threading.Lock()


@contextmanager
def _quiet() -> Iterator[None]:
    """Keep the library from printing about damage, which is raised as an error; it has no switch for that."""
    with _terminal, redirect_stdout(io.StringIO()), ExitStack() as after:
        # standard error may be closed
        with suppress(OSError):
            kept = os.dup(2)
            after.callback(os.close, kept)
            after.callback(os.dup2, kept, 2)
            with open(os.devnull, "wb") as nothing:
                os.dup2(nothing.fileno(), 2)
        yield


def write_exr(path: Path, channels: Mapping[str, FloatMap], comment: str) -> None:
    """Write maps as channels of an OpenEXR file, losslessly compressed; equal content gives equal bytes.

    Parameters
    ----------
    path : Path
    channels : mapping of str to ndarray, shape (H, W), float32
        Name to map, all of one shape; NaN and infinity stay. Programs know the names ``Z`` (depth) and ``Y`` (grey).
    comment : str
        Meaning and unit of the numbers.

    Raises
    ------
    SepiError
        If the package OpenEXR is not installed, or the file cannot be written.
    """
    with naming(path):
        exr = open_exr()
    header = {"compression": exr.ZIP_COMPRESSION, "type": exr.scanlineimage, "comments": comment}
    pixels = {name: np.ascontiguousarray(values, np.float32) for name, values in channels.items()}
    with atomic_path(path) as temporary, exr.File(header, pixels) as file:
        file.write(str(temporary))
