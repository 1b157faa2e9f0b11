"""Changes in our own HDF5 files as another program would make them, which knows nothing of the digest."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import h5py

# where HDF5 itself begins in our files
BLOCK = 512


@contextmanager
def changed(path: Path) -> Iterator[h5py.File]:
    """The file to change; without its digest afterwards, so that what is in it has to be looked at."""
    with h5py.File(path, "r+") as file:
        yield file
    with path.open("r+b") as raw:
        raw.write(bytes(BLOCK))
