"""Pictures that are decoded before anybody asks for them: the same, once, and no more than there is room for."""

import sys
import threading
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from sepi.cli.input_options import Reading
from sepi.errors import SepiError
from sepi.io import ahead, images
from sepi.io.images import read_views, write_png
from sepi.io.readers.options import ReadOptions

COUNT = 9


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    rng = np.random.default_rng(1)
    for number in range(COUNT):
        write_png(tmp_path / f"view_{number:02}.png", rng.integers(0, 256, (16, 24, 3)).astype(np.uint8))
    return tmp_path


@pytest.fixture(autouse=True)
def _end() -> Iterator[None]:
    yield
    ahead.end()


@pytest.fixture
def decoded(monkeypatch: pytest.MonkeyPatch) -> list[Path]:
    """The pictures that were decoded, in order, on a machine of three cores."""
    pixels, paths = images._pixels, []

    def noted(path: Path) -> images.Pixels:
        paths.append(path)
        return pixels(path)

    monkeypatch.setattr(images, "_pixels", noted)
    monkeypatch.setattr(images, "threads_used", lambda: 3)
    return paths


def wait_for(condition) -> None:
    for _ in range(2000):
        if condition():
            return
        threading.Event().wait(0.005)
    raise AssertionError("nothing was decoded ahead")


def test_pictures_decoded_ahead_are_those_that_are_read(folder: Path, decoded: list[Path]) -> None:
    """Decoded twice they would take longer than before; of another picture, the map would be wrong."""
    paths = sorted(folder.glob("*.png"))
    usual = read_views(paths)
    assert sorted(decoded) == paths
    decoded.clear()
    interval = sys.getswitchinterval()
    Reading(None, ReadOptions()).begin(folder)
    wait_for(lambda: len(decoded) == COUNT)
    np.testing.assert_array_equal(read_views(paths), usual)
    assert sorted(decoded) == paths
    # what was taken is read again, the next time
    np.testing.assert_array_equal(read_views(paths[2:4]), usual[2:4])
    assert len(decoded) == COUNT + 2
    ahead.end()
    assert sys.getswitchinterval() == interval


def test_what_is_wrong_with_a_picture_is_told_by_who_reads_it(folder: Path, decoded: list[Path]) -> None:
    paths = sorted(folder.glob("*.png"))
    paths[3].write_bytes(paths[3].read_bytes()[:200])
    images.decode_ahead(folder)
    wait_for(lambda: len(decoded) == COUNT)
    with pytest.raises(SepiError, match=r"view_03\.png: not a PNG, or damaged"):
        read_views(paths)


def test_no_more_is_decoded_ahead_than_there_is_room_for(
    folder: Path, decoded: list[Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of a thousand large views next to the light field itself, memory would be gone before anything tells."""
    monkeypatch.setattr(images, "threads_used", lambda: 2)
    monkeypatch.setattr(ahead, "MOST_BYTES", 2 * 16 * 24 * 3)
    before = threading.active_count()
    images.decode_ahead(folder)
    wait_for(lambda: threading.active_count() == before)
    assert decoded == sorted(folder.glob("*.png"))[:2]


@pytest.mark.parametrize("options", [{"exclude": ("view_00.png",)}, {"central": 3}], ids=["exclude", "central"])
def test_views_that_are_left_out_are_not_decoded(folder: Path, decoded: list[Path], options) -> None:
    """They may be damaged, or thousands."""
    Reading(None, ReadOptions(**options)).begin(folder)
    Reading("hci", ReadOptions()).begin(folder)
    (folder / "link.png").symlink_to(folder / "view_00.png")
    for path in sorted(folder.glob("view*.png")):
        path.rename(path.with_suffix(".jpg"))
    Reading(None, ReadOptions()).begin(folder)
    ahead.end()
    assert decoded == []
