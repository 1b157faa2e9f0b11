"""Disparity maps of other programs: every format gives the same numbers, and no meaning is guessed."""

from pathlib import Path

import cv2
import h5py
import numpy as np
import pytest
import tifffile
from PIL import Image, PngImagePlugin

from sepi.errors import SepiError
from sepi.io.disparity_maps import SUFFIXES, TruthFile, is_disparity, read_disparity, write_pfm
from sepi.io.result_folder import write_result
from sepi.lightfield import LightField
from sepi.stage import StageMaps

SHAPE = (12, 17)


@pytest.fixture
def disparity() -> np.ndarray:
    values = np.random.default_rng(0).normal(size=SHAPE).astype(np.float32)
    values[3, 4] = np.nan
    return values


@pytest.fixture
def result(tmp_path: Path, disparity: np.ndarray) -> Path:
    """A folder as ``sepi depth`` writes it."""
    views = np.random.default_rng(1).integers(0, 256, (3, 3, *SHAPE, 3), np.uint8)
    write_result(tmp_path / "depth", LightField(views, "noise"), StageMaps(disparity, np.ones(SHAPE, np.float32)))
    return tmp_path / "depth"


def write_levels(path: Path, levels: np.ndarray, **texts: str) -> Path:
    info = PngImagePlugin.PngInfo()
    for key, text in texts.items():
        info.add_text(key, text)
    Image.fromarray(levels).save(path, pnginfo=info)
    return path


@pytest.mark.parametrize("name", ["", "disparity.pfm", "disparity.npy", "result.h5"])
def test_what_depth_wrote_is_read_back(result: Path, disparity: np.ndarray, name: str) -> None:
    assert is_disparity(result / name)
    back = read_disparity(result / name)
    assert back.dtype == np.float32
    np.testing.assert_array_equal(back, disparity)


def test_own_png_says_what_its_levels_mean(result: Path, disparity: np.ndarray) -> None:
    """Read as plain levels, every score of such a map would be nonsense."""
    path = result / "disparity_16bit.png"
    assert is_disparity(path)
    back = read_disparity(path)
    assert back.dtype == np.float32
    step = np.ptp(disparity[np.isfinite(disparity)]) / 65534
    np.testing.assert_allclose(back, disparity, atol=0.51 * step)
    assert np.isnan(back[3, 4])


@pytest.mark.parametrize("name", ["disparity.pfm", "disparity.npy", "disparity_16bit.png", "result.h5"])
def test_scale_and_offset_turn_another_convention(result: Path, name: str) -> None:
    plain = read_disparity(result / name)
    np.testing.assert_array_equal(read_disparity(result / name, scale=-1), -plain)
    np.testing.assert_allclose(read_disparity(result / name, offset=0.5), plain + 0.5, rtol=1e-6)
    np.testing.assert_allclose(read_disparity(result / name, scale=2, offset=-1), 2 * plain - 1, rtol=1e-5)


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
def test_levels_of_a_foreign_png_need_a_scale(tmp_path: Path, dtype: type) -> None:
    levels = np.arange(204).reshape(SHAPE).astype(dtype)
    path = write_levels(tmp_path / "map.png", levels, Comment="made elsewhere", scale="0.1")
    # a light field may be a PNG, too: one that does not say that it is a map is not taken for one
    assert not is_disparity(path)
    with pytest.raises(SepiError, match=r"map.png: .* text chunks 'scale' and 'offset' .* give a scale") as caught:
        read_disparity(path)
    assert "\n" not in str(caught.value)
    np.testing.assert_allclose(read_disparity(path, scale=0.02, offset=-2), levels * 0.02 - 2, atol=1e-6)


class TestWhatIsNoMap:
    def error(self, path: Path) -> str:
        with pytest.raises(SepiError) as caught:
            read_disparity(path, scale=1)
        assert str(caught.value).startswith(str(path))
        assert "\n" not in str(caught.value)
        return str(caught.value)

    @pytest.mark.parametrize("suffix", SUFFIXES)
    def test_absent_or_full_of_rubbish(self, tmp_path: Path, suffix: str) -> None:
        path = tmp_path / f"map{suffix}"
        assert "no such file" in self.error(path)
        path.write_bytes(b"hello")
        self.error(path)

    def test_another_kind_of_file(self, tmp_path: Path) -> None:
        (tmp_path / "map.txt").write_text("1 2 3")
        assert not is_disparity(tmp_path / "map.txt")
        assert "expected a disparity map as .pfm, .h5 or .npy, or as grey .png" in self.error(tmp_path / "map.txt")

    @pytest.mark.parametrize("mode", ["RGB", "1", "LA"])
    def test_png_without_grey_levels(self, tmp_path: Path, mode: str) -> None:
        """Colours, or black and white stretched to 0 and 255, are no levels."""
        Image.new(mode, SHAPE).save(tmp_path / "map.png")
        assert "grey .png of 8 or 16 bit" in self.error(tmp_path / "map.png")


def test_tiff_of_floats_is_a_map_and_of_levels_is_none(tmp_path: Path, disparity: np.ndarray) -> None:
    """Levels mean nothing without a scale; taken as disparity they would be scored."""
    disparity[0, 0] = np.inf
    tifffile.imwrite(tmp_path / "zlib.tif", disparity, compression="zlib")
    cv2.imwrite(str(tmp_path / "opencv.tiff"), disparity)
    Image.fromarray(disparity).save(tmp_path / "PILLOW.TIF")
    for name in ("zlib.tif", "opencv.tiff", "PILLOW.TIF"):
        assert is_disparity(tmp_path / name)
        np.testing.assert_array_equal(read_disparity(tmp_path / name), disparity)
        np.testing.assert_array_equal(read_disparity(tmp_path / name, scale=-2), -2 * disparity)
    colours = np.zeros((*SHAPE, 3), np.float32)
    wrong = {"levels.tif": "a TIFF does not say what its levels mean", "colours.tif": "expected a disparity map"}
    for (name, message), values in zip(wrong.items(), (np.ones(SHAPE, np.uint16), colours), strict=True):
        tifffile.imwrite(tmp_path / name, values, photometric="rgb" if values.ndim == 3 else "minisblack")
        assert not is_disparity(tmp_path / name)
        with pytest.raises(SepiError, match=f"{name}: {message}"):
            read_disparity(tmp_path / name)


def test_ground_truth_is_the_same_in_every_format(tmp_path: Path) -> None:
    """What a data set calls unknown, 0 in its levels, would be scored as depth, or levels as pixels."""
    levels = np.random.default_rng(2).integers(0, 200, SHAPE).astype(np.uint8)
    levels[0, :3] = 0, 1, 199
    wanted = np.where(levels > 0, np.float32(0.0625) * levels, np.float32(np.nan))
    floats = np.where(levels > 0, levels, np.nan).astype(np.float32)
    floats[0, 0] = np.inf
    for name, values in (("8.png", levels), ("16.png", levels.astype(np.uint16)), ("8.pgm", levels)):
        cv2.imwrite(str(tmp_path / name), values)
    (tmp_path / "200.pgm").write_bytes(b"P5 %d %d 200\n" % SHAPE[::-1] + levels.tobytes())
    tifffile.imwrite(tmp_path / "16.tif", levels.astype(np.uint16))
    tifffile.imwrite(tmp_path / "float.tif", floats)
    write_pfm(tmp_path / "float.pfm", floats)
    np.save(tmp_path / "8.npy", levels)
    np.savez(tmp_path / "float.npz", depth=floats.astype(np.float64))
    with h5py.File(tmp_path / "float.h5", "w") as file:
        file["disparity"] = floats
    for path in sorted(tmp_path.iterdir()):
        np.testing.assert_array_equal(TruthFile(path, 0.0625).read(SHAPE), wanted, err_msg=path.name)
    np.testing.assert_array_equal(TruthFile(tmp_path / "float.pfm").read(), np.where(levels > 0, floats, np.nan))
    # a light field in such a file is none
    np.savez(tmp_path / "views.npz", LF=np.zeros((3, 3, *SHAPE, 3)))
    assert is_disparity(tmp_path / "float.npz")
    assert not is_disparity(tmp_path / "views.npz")
