"""PFM, the benchmark's format: every map comes back, and no bytes do harm."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from sepi.io.disparity_maps import read_pfm, write_pfm


@given(arrays.arrays(np.float32, arrays.array_shapes(min_dims=2, max_dims=2), elements=st.floats(width=32)))
def test_pfm_gives_back_every_map(tmp_path_factory: pytest.TempPathFactory, values: np.ndarray) -> None:
    path = tmp_path_factory.mktemp("pfm") / "map.pfm"
    write_pfm(path, values)
    np.testing.assert_array_equal(read_pfm(path), values)


def test_pfm_rows_lie_bottom_up(tmp_path: Path) -> None:
    """A map read upside down still looks plausible."""
    write_pfm(tmp_path / "map.pfm", np.array([[1, 2], [3, 4]], np.float32))
    assert np.frombuffer((tmp_path / "map.pfm").read_bytes()[-16:], "<f4").tolist() == [3, 4, 1, 2]


def test_pfm_of_the_other_byte_order(tmp_path: Path) -> None:
    (tmp_path / "map.pfm").write_bytes(b"Pf\n2 1\n1.0\n" + np.array([5, 6], ">f4").tobytes())
    assert read_pfm(tmp_path / "map.pfm").tolist() == [[5, 6]]
