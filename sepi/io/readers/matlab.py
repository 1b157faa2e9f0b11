"""MATLAB files, ``.mat``: version 5 (``save -v6``, ``-v7``) and version 7.3 (``save -v7.3``), which is HDF5.

The axes are those that MATLAB shows. It drops trailing axes of size 1, so grey views have no axis of colours; version
7.3 stores the axes in reverse. The Light Field Toolbox [1]_ saves ``LF`` with the axes T S H W C and a weight as the
fourth channel.

Version 5 is read without SciPy, which ends the program with a segmentation fault where the type of the values is none
that there is, and reads an array in a structure only with all else that is in there.

References
----------
.. [1] D. G. Dansereau, O. Pizarro, S. B. Williams, "Decoding, calibration and rectification for lenselet-based
       plenoptic cameras", CVPR 2013. doi:10.1109/CVPR.2013.137
"""

from __future__ import annotations

from pathlib import Path

import h5py

from sepi.errors import SepiError
from sepi.io.files import reading
from sepi.io.readers import hdf5_datasets, matlab_5
from sepi.io.readers.arrays import Array
from sepi.io.readers.named_arrays import Shapes, light_field_from_arrays
from sepi.io.readers.options import ReadOptions
from sepi.lightfield import LightField

_KIND = "MATLAB file"


def matches(path: Path) -> bool:
    """Whether ``path`` is a file with MATLAB's header or its ending ``.mat``."""
    if not path.is_file():
        return False
    if path.suffix.lower() == ".mat":
        return True
    try:
        head = _head(path)
    except SepiError:
        return False
    return head[-4:] in matlab_5.BYTE_ORDERS or head.startswith(hdf5_datasets.MATLAB)


def read(path: Path, options: ReadOptions) -> LightField:
    """Read the array ``options.variable`` of a MATLAB file; without it, what can be a light field."""

    def load(name: str) -> Array:
        with reading(path, _KIND):
            array: Array = (hdf5_datasets if h5py.is_hdf5(path) else matlab_5).read_named(path, name)
        # the axes that MATLAB dropped
        while array.ndim < len(options.axes or "") <= 5:
            array = array[..., None]
        return array

    return light_field_from_arrays(path, array_shapes(path), options, load)


def array_shapes(path: Path) -> Shapes:
    """Shape and type, as MATLAB shows them, of each array of real numbers in a file; their values are not read."""
    head = _head(path)
    # what begins with a zero is of version 4
    if head[-4:] in matlab_5.BYTE_ORDERS and 0 not in head[:4]:
        with reading(path, _KIND):
            return matlab_5.array_shapes(path)
    if h5py.is_hdf5(path):
        return hdf5_datasets.array_shapes(path)
    what = "is damaged" if head.startswith(hdf5_datasets.MATLAB) else "is not a MATLAB file of version 5 or 7.3"
    raise SepiError(f"{path}: {what}; save it in MATLAB with -v7 or -v7.3")


def _head(path: Path) -> bytes:
    with reading(path, _KIND), path.open("rb") as file:
        return file.read(matlab_5.HEADER)
