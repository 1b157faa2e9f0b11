"""OpenEXR views, as renderers write them."""

import sys
from pathlib import Path

import numpy as np
import pytest
from error_lines import reading_error

from sepi.io.readers.formats import format_of, read
from sepi.io.readers.options import ReadOptions
from sepi.lightfield import LightField

exr = pytest.importorskip("OpenEXR")

VIEWS = np.random.default_rng(0).random((2, 3, 20, 30, 3), np.float32)


def put(folder: Path, views: np.ndarray, layer: str = "", **header: object) -> Path:
    folder.mkdir(exist_ok=True)
    beside = {"depth.Z": VIEWS[0, 0, ..., 0].copy()} if layer else {}
    for t, s in np.ndindex(views.shape[:2]):
        view = np.ascontiguousarray(views[t, s])
        channels = {f"{layer}{'RGB' if view.ndim == 3 else 'Y'}": view, **beside}
        with exr.File({"compression": exr.ZIP_COMPRESSION, "type": exr.scanlineimage, **header}, channels) as file:
            file.write(str(folder / f"view_{t}_{s}.exr"))
    return folder


def taken(folder: Path, **options: object) -> LightField:
    assert format_of(folder).name == "folder of views"
    return read(folder, ReadOptions(**options))


@pytest.mark.parametrize("layer", ["", "ViewLayer.Combined."])
@pytest.mark.parametrize("kind", [np.float16, np.float32])
def test_half_and_float_views_are_read(tmp_path: Path, kind: type, layer: str) -> None:
    views = VIEWS.astype(kind)
    light_field = taken(put(tmp_path / "colours", views, layer))
    np.testing.assert_array_equal(light_field.views, views.astype(np.float32))
    grey = taken(put(tmp_path / "grey", views[..., 0]))
    np.testing.assert_array_equal(grey.views, views[..., :1].astype(np.float32))


def test_what_is_brighter_than_one_needs_its_white(tmp_path: Path) -> None:
    """Linear values of a renderer have no end; cut off, they would match anything."""
    folder = put(tmp_path / "bright", 8 * VIEWS)
    message = reading_error(folder, lambda path: read(path, ReadOptions()))
    assert "view_0_0.exr: float pixels must be finite and within 0..1, got" in message
    assert "--white says what white is" in message
    np.testing.assert_array_equal(taken(folder, white=8.0).views, VIEWS)
    assert "white being 2" in reading_error(folder, lambda path: read(path, ReadOptions(white=2.0)))


@pytest.mark.parametrize(
    ("views", "header", "expected"),
    [
        ((VIEWS[..., 0] * 9).astype(np.uint32), {}, "an OpenEXR of integers"),
        (VIEWS, {"displayWindow": ((0, 0), (40, 40))}, "display windows"),
        (None, {}, "damaged"),
    ],
)
def test_what_is_not_read_is_one_line(
    tmp_path: Path,
    capfd: pytest.CaptureFixture[str],
    views: np.ndarray | None,
    header: dict[str, object],
    expected: str,
) -> None:
    folder = put(tmp_path / "views", VIEWS if views is None else views, **header)
    file = folder / "view_1_1.exr"
    if views is None:
        file.write_bytes(file.read_bytes()[:-50])
    assert expected in reading_error(folder, lambda path: read(path, ReadOptions()))
    # the library has its own way to the terminal
    assert capfd.readouterr() == ("", "")


def test_without_its_package_it_is_said_what_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = put(tmp_path / "views", VIEWS)
    monkeypatch.setitem(sys.modules, "OpenEXR", None)
    message = reading_error(folder, lambda path: read(path, ReadOptions()))
    assert message.endswith("view_0_0.exr: OpenEXR needs a package that is not installed; pip install 'sepi[exr]'")
