"""Damage in pictures is told by one line, and not printed by libpng or libjpeg; pixels are those that OpenCV gives."""

import resource
import struct
import tracemalloc
import zlib
from pathlib import Path

import cv2
import numpy as np
import pytest
from PIL import Image

from sepi.errors import SepiError
from sepi.io.images import png_texts, read_picture

SMOOTH = np.stack([*np.mgrid[:40, :50], np.full((40, 50), 100)], 2).astype(np.uint8)
PICTURE = Image.fromarray(SMOOTH)


def silent(path: Path, capfd: pytest.CaptureFixture[str]) -> np.ndarray | str:
    """A picture, or the line with which it is refused; libraries in C say nothing."""
    try:
        found: np.ndarray | str = read_picture(path)
    except SepiError as error:
        found = str(error)
    assert capfd.readouterr() == ("", "")
    return found


def chunk(kind: bytes, body: bytes) -> bytes:
    return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))


@pytest.mark.parametrize("kind", [np.uint8, np.uint16])
def test_png_whose_pixels_do_not_fit_their_own_checksum(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], kind: type
) -> None:
    """They are not those that were written; libpng would print a line without the file's name, and go on."""
    rows = np.zeros((4, 1 + 5 * 3 * kind().itemsize), np.uint8).tobytes()
    packed = bytearray(zlib.compress(rows))
    packed[-1] ^= 1
    head = struct.pack(">IIBBBBB", 5, 4, 8 * kind().itemsize, 2, 0, 0, 0)
    parts = chunk(b"IHDR", head), chunk(b"IDAT", bytes(packed)), chunk(b"IEND", b"")
    (tmp_path / "a.png").write_bytes(b"\x89PNG\r\n\x1a\n" + b"".join(parts))
    assert str(silent(tmp_path / "a.png", capfd)).startswith(f"{tmp_path / 'a.png'}: ")


@pytest.mark.parametrize("kind", [np.uint8, np.uint16])
def test_png_with_chunks_that_libpng_warns_of(tmp_path: Path, capfd: pytest.CaptureFixture[str], kind: type) -> None:
    """A colour profile that it does not like would be a line on the terminal for each of a hundred views."""
    pixels = np.arange(60, dtype=kind).reshape(4, 5, 3)
    plain = cv2.imencode(".png", pixels[:, :, ::-1])[1].tobytes()
    profile = chunk(b"iCCP", b"sRGB\0\0" + zlib.compress(bytes(40)))
    (tmp_path / "a.png").write_bytes(plain[:33] + profile + chunk(b"PLTE", bytes(3)) + plain[33:])
    np.testing.assert_array_equal(silent(tmp_path / "a.png", capfd), pixels)


def test_jpeg_with_bytes_that_do_not_belong(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """The library goes on after them; it used to print a line without the file's name."""
    whole = cv2.imencode(".jpg", SMOOTH)[1].tobytes()
    (tmp_path / "a.jpg").write_bytes(whole[:20] + b"\0\0\0" + whole[20:])
    assert isinstance(silent(tmp_path / "a.jpg", capfd), np.ndarray)


def test_jpeg_that_claims_to_be_huge_takes_no_memory(tmp_path: Path) -> None:
    """It used to be decoded before its size was looked at: 12 GB for a file of a kilobyte."""
    whole = cv2.imencode(".jpg", SMOOTH)[1].tobytes()
    at = whole.index(b"\xff\xc0") + 5
    (tmp_path / "a.jpg").write_bytes(whole[:at] + struct.pack(">HH", 65000, 65000) + whole[at + 4 :])
    tracemalloc.start()
    try:
        with pytest.raises(SepiError, match="pixels cannot be in a JPEG"):
            read_picture(tmp_path / "a.jpg")
        assert tracemalloc.get_traced_memory()[1] < 10**7
    finally:
        tracemalloc.stop()


@pytest.mark.parametrize("tag", [256, 257])
def test_tiff_of_several_widths_takes_no_memory(tmp_path: Path, tag: int) -> None:
    """It used to be a list of as many numbers as the other side says, or no memory left."""
    whole = cv2.imencode(".tif", SMOOTH, (cv2.IMWRITE_TIFF_COMPRESSION, 1))[1].tobytes()
    entries = {number: next(at for at in range(len(whole)) if is_entry(whole, at, number)) for number in (256, 257)}
    for number, at in entries.items():
        claimed = struct.pack("<HHII", number, 4, 2, 16) if number == tag else struct.pack("<HHII", number, 4, 1, 10**9)
        whole = whole[:at] + claimed + whole[at + 12 :]
    (tmp_path / "a.tif").write_bytes(whole)
    with pytest.raises(SepiError, match=r"a\.tif: .*damaged"):
        read_picture(tmp_path / "a.tif")


def is_entry(tiff: bytes, at: int, tag: int) -> bool:
    """Whether an entry of this tag, of one short or long number, stands in a TIFF."""
    return tiff[at : at + 8] in (struct.pack("<HHI", tag, kind, 1) for kind in (3, 4))


def test_texts_of_a_png_that_claims_to_be_huge_take_no_memory(tmp_path: Path) -> None:
    """Decoding all of it for them would take gigabytes for 65 bytes, only to see whether it is a map."""
    head = struct.pack(">IIBBBBB", 10, 2**27, 8, 6, 0, 0, 0)
    parts = chunk(b"IHDR", head), chunk(b"tEXt", b"scale\0001"), chunk(b"IDAT", zlib.compress(bytes(99)))
    (tmp_path / "a.png").write_bytes(b"\x89PNG\r\n\x1a\n" + b"".join(parts))
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    assert png_texts(tmp_path / "a.png") == {"scale": "1"}
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 500_000  # KB


SORTS = {
    "palette": PICTURE.quantize(9),
    "palette of 1 bit": PICTURE.quantize(2),
    "1 bit": PICTURE.convert("1"),
    "grey": PICTURE.convert("L"),
}


@pytest.mark.parametrize("sort", SORTS)
@pytest.mark.parametrize("transparent", [False, True])
def test_every_sort_of_png_is_read_as_opencv_reads_it(tmp_path: Path, sort: str, transparent: bool) -> None:
    """Colours must not depend on who decodes them."""
    SORTS[sort].save(tmp_path / "a.png", **({"transparency": 1} if transparent else {}))
    found = read_picture(tmp_path / "a.png")
    expected = cv2.imread(str(tmp_path / "a.png"), cv2.IMREAD_UNCHANGED)
    expected = expected[:, :, None] if expected.ndim == 2 else expected[:, :, 2::-1]
    np.testing.assert_array_equal(found, expected[:, :, : found.shape[2]])


def png_16(colour: int, rows: bytes, size: tuple[int, int] = (5, 4), interlaced: bool = False) -> bytes:
    """A PNG of 16 bit of a colour type, with these rows."""
    head = struct.pack(">IIBBBBB", *size, 16, colour, 0, 0, interlaced)
    parts = chunk(b"IHDR", head), chunk(b"IDAT", zlib.compress(rows)), chunk(b"IEND", b"")
    return b"\x89PNG\r\n\x1a\n" + b"".join(parts)


@pytest.mark.parametrize(("colour", "samples"), [(2, 3), (4, 2), (6, 4)])
def test_16_bits_stay_16_bits(tmp_path: Path, colour: int, samples: int) -> None:
    """Half of them would be lost, and with them what tells faint texture."""
    values = np.random.default_rng(0).integers(0, 65536, (4, 5, samples), np.uint16)
    rows = b"".join(b"\0" + row.astype(">u2").tobytes() for row in values)
    (tmp_path / "a.png").write_bytes(png_16(colour, rows))
    expected = values[:, :, :1] if samples == 2 else values[:, :, :3]
    np.testing.assert_array_equal(read_picture(tmp_path / "a.png"), expected)


@pytest.mark.parametrize("size", [(1, 1), (5, 4), (8, 9), (3, 17)])
def test_interlaced_pictures_of_16_bits(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], size: tuple[int, int]
) -> None:
    """They are stored as seven pictures, of which small ones lack some."""
    starts = [(0, 0, 8, 8), (4, 0, 8, 8), (0, 4, 4, 8), (2, 0, 4, 4), (0, 2, 2, 4), (1, 0, 2, 2), (0, 1, 1, 2)]
    values = np.random.default_rng(0).integers(0, 65536, (size[1], size[0], 3), np.uint16)
    parts = [values[top::down, left::across].astype(">u2") for left, top, across, down in starts]
    rows = b"".join(b"\0" + row.tobytes() for part in parts if part.size for row in part)
    (tmp_path / "a.png").write_bytes(png_16(2, rows, size, interlaced=True))
    np.testing.assert_array_equal(silent(tmp_path / "a.png", capfd), values)
    # more than the header says is no harm, fewer are damage
    (tmp_path / "a.png").write_bytes(png_16(2, rows + bytes(9), size, interlaced=True))
    np.testing.assert_array_equal(silent(tmp_path / "a.png", capfd), values)
    (tmp_path / "a.png").write_bytes(png_16(2, rows[:-1], size, interlaced=True))
    assert "not a PNG, or damaged" in str(silent(tmp_path / "a.png", capfd))
