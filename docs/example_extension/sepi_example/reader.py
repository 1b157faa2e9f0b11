"""A format: the bytes of 3x3 views of 64x64 pixels."""

from pathlib import Path

import numpy as np

from sepi.io.readers.formats import Format
from sepi.io.readers.options import ReadOptions
from sepi.lightfield import LightField


def matches(path: Path) -> bool:
    """Whether this is such a file."""
    return path.suffix == ".views"


def read(path: Path, options: ReadOptions) -> LightField:
    """The light field in the file."""
    return LightField(np.fromfile(path, np.uint8).reshape(3, 3, 64, 64, 3), path.stem)


FORMATS = {"raw-views": Format("raw views", "NAME.views", matches, read)}
