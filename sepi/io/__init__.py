"""Reading light fields, whatever their format, and writing results."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from sepi.errors import SepiError
from sepi.io import hci, hdf5
from sepi.lightfield import DisparityRange, LightField

__all__ = ["FORMATS", "Format", "format_of", "read_light_field"]


@dataclass(frozen=True)
class Format:
    """One format of light fields.

    Attributes
    ----------
    name, description : str
        For messages.
    matches : callable
        Whether a path looks like this format; quick, and never raises.
    read : callable
        Reads it, or raises :class:`SepiError`.
    """

    name: str
    description: str
    matches: Callable[[Path], bool]
    read: Callable[[Path], LightField]


FORMATS = (
    Format("HCI folder", "a folder with input_Cam000.png, input_Cam001.png, ...", hci.matches, hci.read),
    Format("sepi HDF5", "an HDF5 file written by this package", hdf5.matches, hdf5.read_light_field),
)
"""Known formats; the first that matches reads."""


def format_of(path: Path) -> Format:
    """Find the format of a light field by looking at it.

    Raises
    ------
    SepiError
        If there is nothing at ``path``, or it is of no known format.
    """
    if not path.exists():
        raise SepiError(f"{path}: no such file or folder")
    for known in FORMATS:
        if known.matches(path):
            return known
    known_formats = "; ".join(f"{known.name}: {known.description}" for known in FORMATS)
    raise SepiError(f"{path}: not a light field of a known format ({known_formats}){_hint(path)}")


def read_light_field(path: str | Path, *, disparity_range: tuple[float, float] | None = None) -> LightField:
    """Read a light field of any known format.

    Parameters
    ----------
    path : str or Path
        File or folder.
    disparity_range : tuple of float, optional
        ``(minimum, maximum)`` in pixels per view step, in place of the scene's own.

    Returns
    -------
    LightField
        Its ``disparity_range`` is None if neither the scene nor the caller gives one.

    Raises
    ------
    SepiError
        If nothing is there, the format is unknown, or the files are damaged or contradict each other.
    """
    path = Path(path)
    known = format_of(path)
    try:
        light_field = known.read(path)
    except SepiError as error:
        # what only the light field as a whole can find wrong
        raise error if str(path) in str(error) else SepiError(f"{path}: {error}") from error
    if disparity_range is None:
        return light_field
    return light_field.with_range(DisparityRange(*disparity_range, "given"))


def _hint(path: Path) -> str:
    """Name a light field in the folder, for who gave the folder of all scenes."""
    inner = sorted(path.iterdir()) if path.is_dir() else []
    scene = next((entry for entry in inner if any(known.matches(entry) for known in FORMATS)), None)
    return "" if scene is None else f"; it holds some, such as {scene}"
