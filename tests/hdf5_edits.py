"""Changes in our own HDF5 files as another program would make them, which knows nothing of the digest."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import h5py

from sepi.io.hdf5 import digest_block


@contextmanager
def changed(path: Path) -> Iterator[h5py.File]:
    """The file to change; with its digest afterwards, so that what is in it has to be looked at."""
    with h5py.File(path, "r+") as file:
        yield file
    with path.open("r+b") as raw:
        block = digest_block(raw)
        raw.seek(0)
        raw.write(block)
