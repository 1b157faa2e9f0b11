"""MATLAB files, ``.mat``: version 5 (``save -v6``, ``-v7``) and version 7.3 (``save -v7.3``), which is HDF5.

The axes are those that MATLAB shows. It drops trailing axes of size 1, so grey views have no axis of colours; version
7.3 stores the axes in reverse. The Light Field Toolbox [1]_ saves ``LF`` with the axes T S H W C and a weight as the
fourth channel.

References
----------
.. [1] D. G. Dansereau, O. Pizarro, S. B. Williams, "Decoding, calibration and rectification for lenselet-based
       plenoptic cameras", CVPR 2013. doi:10.1109/CVPR.2013.137
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import h5py

from sepi.errors import SepiError
from sepi.io.hdf5 import opened, stored
from sepi.io.readers.arrays import Array, light_field_from_array, variable_of
from sepi.io.readers.mat5 import BYTE_ORDERS, HEADER, read_variable, variables
from sepi.io.readers.options import ReadOptions, require_unused
from sepi.lightfield import LightField

# other classes are text, logical values, cells, ...
_NUMBERS = ("uint8", "int8", "uint16", "int16", "uint32", "int32", "single", "uint64", "int64", "double")
_TEXT_7_3 = b"MATLAB 7.3 MAT-file"


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
    return head[-4:] in BYTE_ORDERS or head.startswith(_TEXT_7_3)


def read(path: Path, options: ReadOptions) -> LightField:
    """Read the array ``options.variable`` of a MATLAB file; without it, the only one that can be a light field.

    Raises
    ------
    SepiError
        If the file is damaged or of another version, or holds no such array; else as
        :func:`sepi.io.readers.arrays.light_field_from_array`.
    """
    require_unused(str(path), options, ("pattern", "follow_links"))
    head = _head(path)
    if head[-4:] in BYTE_ORDERS:
        array = _read_5(path, options.variable)
    elif h5py.is_hdf5(path):
        array = _read_7_3(path, options.variable, by_matlab=head.startswith(_TEXT_7_3))
    else:
        what = "is damaged" if head.startswith(_TEXT_7_3) else "is not a MATLAB file of version 5 or 7.3"
        raise SepiError(f"{path}: {what}; save it in MATLAB with -v7 or -v7.3")
    # the axes that MATLAB dropped
    while array.ndim < len(options.axes or "") <= 5:
        array = array[..., None]
    return light_field_from_array(array, name=path.stem, source=str(path), options=options)


def _head(path: Path) -> bytes:
    try:
        with path.open("rb") as file:
            return file.read(HEADER)
    except OSError as error:
        raise SepiError(f"{path}: cannot be read ({error.strerror})") from error


def _read_5(path: Path, wanted: str | None) -> Array:
    found = variables(path)
    name = variable_of(str(path), {name: variable.shape for name, variable in found.items()}, wanted)
    return read_variable(path, found[name])


def _read_7_3(path: Path, wanted: str | None, *, by_matlab: bool) -> Array:
    with opened(path) as file:
        arrays = {name: file[name] for name in file if _is_numbers(file.get(name))}
        # other programs' files are as their own libraries show them
        turned = [name for name, dataset in arrays.items() if by_matlab or "MATLAB_class" in dataset.attrs]
        shapes = {name: dataset.shape[:: -1 if name in turned else 1] for name, dataset in arrays.items()}
        name = variable_of(str(path), shapes, wanted)
        array = stored(path, arrays[name])
        return array.T if name in turned else array


def _is_numbers(entry: Any) -> bool:
    if not isinstance(entry, h5py.Dataset) or entry.dtype.kind not in "iuf" or entry.shape is None:
        return False
    kind = entry.attrs.get("MATLAB_class", b"double")
    return (kind.decode(errors="replace") if isinstance(kind, bytes) else str(kind)) in _NUMBERS
