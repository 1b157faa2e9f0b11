"""Pictures of every kind come in as other programs wrote them, pixel for pixel, or not at all: a picture that is
decoded in part, or to other values than were stored, gives wrong depth without a word.
"""

import os
import struct
import warnings
import zlib
from collections.abc import Callable
from functools import partial
from pathlib import Path

import cv2
import imagecodecs
import imageio.v3 as imageio
import numpy as np
import pytest
import tifffile
from PIL import Image

from sepi.errors import SepiError
from sepi.io.images import picture_header, read_picture, read_views, write_png

RANDOM = np.random.default_rng(0)
RGB8 = RANDOM.integers(0, 256, (40, 50, 3), np.uint8)
RGB16 = RANDOM.integers(0, 65536, (40, 50, 3), np.uint16)
RGBF = RANDOM.random((40, 50, 3), np.float32)
GREY8, GREY16, GREYF = RGB8[:, :, :1], RGB16[:, :, :1], RGBF[:, :, :1]


def smooth() -> np.ndarray:
    y, x = np.mgrid[:40, :50]
    return np.stack([4 * x, 5 * y, 100 + x + y], 2).astype(np.uint8)


def alpha(rgb: np.ndarray, value: int | None = None) -> np.ndarray:
    """The picture with transparency, random unless a value is given."""
    return np.dstack([rgb, rgb[:, :, 0] if value is None else np.full_like(rgb[:, :, 0], value)])


def flat(values: np.ndarray) -> np.ndarray:
    return values[:, :, 0] if values.shape[2] == 1 else values


def by_opencv(values: np.ndarray) -> Callable[[Path], object]:
    bgr = values[:, :, 0] if values.shape[2] == 1 else values[:, :, [2, 1, 0, 3][: values.shape[2]]]
    return lambda path: cv2.imwrite(str(path), bgr)


def by_imageio(values: np.ndarray) -> Callable[[Path], object]:
    return lambda path: imageio.imwrite(path, flat(values))


def by_pillow(values: np.ndarray, **options: object) -> Callable[[Path], object]:
    return lambda path: Image.fromarray(flat(values)).save(path, **options)


def by_tifffile(values: np.ndarray, **options: object) -> Callable[[Path], object]:
    options = {"photometric": "rgb" if values.shape[2] > 2 else "minisblack", **options}
    return lambda path: tifffile.imwrite(path, flat(values), **options)


def by_pillow_ycbcr(values: np.ndarray, **options: object) -> Callable[[Path], object]:
    return lambda path: Image.fromarray(values).convert("YCbCr").save(path, **options)


def bmp_of_wrong_length(path: Path) -> None:
    """As some programs write them: more bytes than there are, of a picture that is whole."""
    Image.fromarray(RGB8).save(path)
    data = path.read_bytes()
    path.write_bytes(data[:2] + struct.pack("<I", len(data) + 2) + data[6:])


PALETTE = RANDOM.integers(0, 256, (256, 3), np.uint8)


def by_pillow_palette(path: Path) -> None:
    image = Image.fromarray(GREY8[:, :, 0])
    image.putpalette(PALETTE.tobytes())
    image.save(path)


def as_text(values: np.ndarray, white: int) -> Callable[[Path], object]:
    form = b"P3" if values.shape[2] == 3 else b"P2"
    head = form + b"\n# by hand\n%d %d\n%d\n" % (values.shape[1], values.shape[0], white)
    return lambda path: path.write_bytes(head + b"\n".join(b"%d" % value for value in values.ravel()))


def as_bytes(values: np.ndarray, white: int) -> Callable[[Path], object]:
    form = b"P6" if values.shape[2] == 3 else b"P5"
    head = form + b"\n%d\t%d # size\n%d\n" % (values.shape[1], values.shape[0], white)
    return lambda path: path.write_bytes(head + values.astype(">u2" if white > 255 else "u1").tobytes())


EXACT: dict[str, tuple[str, Callable[[Path], object], np.ndarray]] = {
    "png grey 8": ("a.png", by_imageio(GREY8), GREY8),
    "png grey 16": ("a.png", by_opencv(GREY16), GREY16),
    "png RGB 16": ("a.png", by_opencv(RGB16), RGB16),
    "png RGBA 8": ("a.png", by_pillow(alpha(RGB8)), RGB8),
    "png grey with alpha": ("a.png", by_pillow(RGB8[:, :, :2]), GREY8),
    "bmp of 1 bit": ("a.bmp", lambda path: Image.fromarray(GREY8[:, :, 0] > 99).save(path), (GREY8 > 99) * 255),
    "bmp that claims another length": ("a.bmp", bmp_of_wrong_length, RGB8),
    "tiff grey 16": ("a.tif", by_tifffile(GREY16), GREY16),
    "tiff RGB float": ("a.tif", by_tifffile(RGBF), RGBF),
    "tiff RGBA 8 transparent": ("a.tif", by_tifffile(alpha(RGB8), extrasamples=["unassalpha"]), RGB8),
    "tiff LZW of OpenCV": ("a.tif", by_opencv(RGB16), RGB16),
    "tiff big endian": ("a.tif", by_tifffile(RGB16, byteorder=">"), RGB16),
    "tiff of 64 bit offsets": ("a.tif", by_tifffile(RGB16, bigtiff=True), RGB16),
    "tiff deflated": ("a.tif", by_tifffile(RGB16, compression="zlib", predictor=True), RGB16),
    "tiff in tiles": ("a.tif", by_tifffile(RGB16, tile=(32, 32)), RGB16),
    "tiff in planes and tiles": (
        "a.tif",
        by_tifffile(RGB8.transpose(2, 0, 1), planarconfig="separate", tile=(32, 32), compression="zlib"),
        RGB8,
    ),
    "tiff of half floats": ("a.tif", by_tifffile(RGBF.astype(np.float16)), RGBF.astype(np.float16).astype(np.float32)),
    "tiff with a sign": ("a.tif", by_tifffile((GREY16 // 2).astype(np.int16), byteorder=">"), GREY16 // 2),
    "tiff with white as zero": ("a.tif", by_tifffile(GREY16, photometric="miniswhite"), 65535 - GREY16),
    "tiff with a palette": ("a.tif", by_pillow_palette, PALETTE[GREY8[:, :, 0]]),
    "tiff packbits": ("a.tif", by_pillow(RGB8, compression="packbits"), RGB8),
    "webp": ("a.webp", by_pillow(RGB8, lossless=True), RGB8),
    "pgm 16": ("a.pgm", by_opencv(GREY16), GREY16),
    "pgm text": ("a.pgm", as_text(GREY8, 255), GREY8),
    "ppm of 12 bit": ("a.ppm", as_bytes(RGB16 // 16, 4095), np.rint(RGB16 // 16 * (65535 / 4095))),
    "png named jpg": ("a.jpg", lambda path: path.write_bytes(cv2.imencode(".png", RGB8[:, :, ::-1])[1]), RGB8),
    "tiff named png": ("a.png", by_tifffile(RGB16), RGB16),
}


@pytest.mark.parametrize("case", EXACT)
def test_picture_is_read_pixel_for_pixel(tmp_path: Path, case: str, capfd: pytest.CaptureFixture[str]) -> None:
    name, write, pixels = EXACT[case]
    write(tmp_path / name)
    read = read_picture(tmp_path / name)
    np.testing.assert_array_equal(read, pixels)
    assert read.dtype in (np.uint8, np.uint16, np.float32)
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("compression", ["raw", "tiff_lzw"])
def test_tiff_in_ycbcr_has_the_colours_that_were_stored(tmp_path: Path, compression: str) -> None:
    by_pillow_ycbcr(RGB8, compression=compression)(tmp_path / "a.tif")
    # rounding of two conversions
    assert np.abs(read_picture(tmp_path / "a.tif").astype(int) - RGB8).max() <= 3


@pytest.mark.parametrize("options", [{}, {"progressive": True}, {"subsampling": 0}, {"restart_marker_blocks": 2}])
@pytest.mark.parametrize("grey", [False, True])
def test_jpeg_is_read_as_another_decoder_reads_it(tmp_path: Path, grey: bool, options: dict[str, object]) -> None:
    pixels = smooth()[:, :, :1] if grey else smooth()
    by_pillow(pixels, quality=95, **options)(tmp_path / "a.jpg")
    read = read_picture(tmp_path / "a.jpg")
    with Image.open(tmp_path / "a.jpg") as image:
        np.testing.assert_allclose(flat(read).astype(int), np.asarray(image).astype(int), atol=2)
    assert read.shape == pixels.shape
    assert read.dtype == np.uint8


@pytest.mark.parametrize("kind", ["jp2", "j2k", "avif", "gif"])
def test_rarer_kinds_of_pictures_are_read(tmp_path: Path, kind: str) -> None:
    pixels = RGB16 if kind.startswith("j") else smooth() if kind == "avif" else GREY8
    if kind == "gif":
        by_pillow(pixels)(tmp_path / "a.gif")
    else:
        encode = imagecodecs.avif_encode if kind == "avif" else imagecodecs.jpeg2k_encode
        (tmp_path / f"a.{kind}").write_bytes(encode(pixels, **({"level": 100} if kind == "avif" else {})))
    read = read_picture(tmp_path / f"a.{kind}")
    assert (read.dtype, read.shape[:2]) == (pixels.dtype, (40, 50))
    np.testing.assert_array_equal(read, np.broadcast_to(pixels, read.shape))
    content = (tmp_path / f"a.{kind}").read_bytes()
    (tmp_path / f"a.{kind}").write_bytes(content[: len(content) // 2])
    with pytest.raises(SepiError, match=f"a.{kind}: not a .*damaged or cut off"):
        read_picture(tmp_path / f"a.{kind}")


def test_jpeg_with_a_thumbnail_and_bytes_after_its_end_is_whole(tmp_path: Path) -> None:
    """Cameras write both; neither the thumbnail's size nor its end mark is the picture's."""
    small = cv2.imencode(".jpg", smooth()[:8, :8])[1].tobytes()
    whole = cv2.imencode(".jpg", smooth()[:, :, ::-1])[1].tobytes()
    extra = b"\xff\xe1" + struct.pack(">H", len(small) + 2) + small
    (tmp_path / "a.jpg").write_bytes(whole[:2] + extra + whole[2:] + b"\0\0camera")
    assert read_picture(tmp_path / "a.jpg").shape == (40, 50, 3)


def turned(value: int, **options: object) -> Callable[[Path], object]:
    exif = Image.Exif()
    exif[0x0112] = value
    return lambda path: by_pillow(smooth(), exif=exif, **options)(path)


ORIENTED: dict[str, tuple[str, Callable[[int], Callable[[Path], object]]]] = {
    "JPEG": ("a.jpg", partial(turned, quality=100, subsampling=0)),
    "PNG": ("a.png", turned),
    "WebP": ("a.webp", partial(turned, lossless=True)),
    "TIFF": ("a.tif", lambda value: by_tifffile(smooth(), extratags=[(274, "H", 1, value)])),
    "TIFF JPEG": ("a.tif", partial(turned, compression="jpeg", quality=100)),
}


@pytest.mark.parametrize("value", [2, 3, 6])
@pytest.mark.parametrize("case", ORIENTED)
def test_camera_orientation_does_not_turn_a_view(tmp_path: Path, case: str, value: int) -> None:
    """A view on its side does not match its neighbours, and where all are mirrored, near is far."""
    name, write = ORIENTED[case]
    write(value)(tmp_path / name)
    read = read_picture(tmp_path / name)
    assert read.shape == (40, 50, 3)
    assert np.abs(read.astype(int) - smooth()).max() <= (10 if "JPEG" in case else 0)


WHOLE: dict[str, Callable[[Path], object]] = {
    "png": by_pillow(RGB8),
    "jpg": by_pillow(smooth(), quality=95),
    "progressive.jpg": by_pillow(smooth(), quality=95, progressive=True),
    "bmp": by_pillow(RGB8),
    "tif": by_tifffile(RGB16),
    "tiff": by_opencv(smooth()),
    "webp": by_pillow(RGB8, lossless=True),
    "ppm": by_pillow(RGB8),
    "pgm": as_text(GREY8 // 100, 2),
}


@pytest.mark.parametrize("ending", WHOLE)
def test_picture_cut_off_anywhere_is_refused(tmp_path: Path, ending: str, capfd: pytest.CaptureFixture[str]) -> None:
    """A decoder may fill the rest with grey; matching then finds depth in it."""
    path = tmp_path / f"a.{ending}"
    WHOLE[ending](path)
    data = path.read_bytes()
    for size in [*range(0, 60), len(data) // 3, len(data) // 2, len(data) - 40, len(data) - 3, len(data) - 1]:
        path.write_bytes(data[:size])
        with pytest.raises(SepiError) as caught:
            read_picture(path)
        message = str(caught.value)
        assert message.startswith(f"{path}: ")
        assert "\n" not in message
    assert capfd.readouterr() == ("", "")


def png(width: int, height: int) -> bytes:
    """A PNG with a sound header of any size and next to no pixels."""

    def chunk(kind: bytes, body: bytes) -> bytes:
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))

    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    body = chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(b"\0" * 1000)) + chunk(b"IEND", b"")
    return b"\x89PNG\r\n\x1a\n" + body


def tiff(**changes: int) -> bytes:
    """A deflated TIFF of 16 pixels but for what its tags claim."""
    pixels = zlib.compress(bytes(16))
    tags = {
        "width": (256, 4),
        "height": (257, 4),
        "bits": (258, 8),
        "compression": (259, 8),
        "photometric": (262, 1),
        "start": (273, 8),
        "samples": (277, 1),
        "size": (279, len(pixels)),
        "form": (339, 1),
    }
    entries = [(tag, changes.get(name, value)) for name, (tag, value) in tags.items()]
    directory = b"".join(struct.pack("<HHII", tag, 4, 1, value) for tag, value in entries)
    return b"II*\0" + struct.pack("<I", 8 + len(pixels)) + pixels + struct.pack("<H", len(tags)) + directory + bytes(4)


def jpeg(width: int, height: int) -> bytes:
    data = cv2.imencode(".jpg", smooth())[1].tobytes()
    at = data.index(b"\xff\xc0") + 5
    return data[:at] + struct.pack(">HH", height, width) + data[at + 4 :]


BAD: dict[str, tuple[bytes, str]] = {
    "empty": (b"", "not a PNG, JPEG"),
    "huge PNG": (png(60_000, 60_000), "60000x60000"),
    "PNG without pixels": (png(0, 5), "not a PNG, or damaged"),
    "huge JPEG": (jpeg(65_000, 65_000), "65000x65000"),
    "huge TIFF": (tiff(width=2**31, height=2**31), "2147483648"),
    "plain TIFF larger than its file": (tiff(compression=1, width=100, height=100), "bytes of pixels"),
    "TIFF of 12 bit": (tiff(bits=12), "12 bit"),
    "TIFF whose pixels are missing": (tiff(size=0), "missing"),
    "TIFF in CMYK": (tiff(samples=4, photometric=5), "nor RGB"),
    "huge PGM": (b"P5 999999999 999999999 255\n" + bytes(100), "cut off"),
    "PGM with letters": (b"P2 3 2 255\n" + b"100 " * 5 + b"white", "damaged"),
    "PGM brighter than white": (b"P5 3 2 100\n" + bytes([101] * 6), "white is 100"),
}


@pytest.mark.parametrize("make", [png, jpeg])
def test_large_picture_gives_no_warning(tmp_path: Path, make: Callable[[int, int], bytes]) -> None:
    """A lenslet picture may have more pixels than Pillow warns of, 89 million, and refuses, 179 million."""
    # as many bytes as such a picture takes at least
    (tmp_path / "a.png").write_bytes(make(16_000, 15_000) + bytes(300_000))
    with warnings.catch_warnings(record=True) as given:
        header = picture_header(tmp_path / "a.png")
    assert (header.width, header.height) == (16_000, 15_000)
    assert given == []


@pytest.mark.parametrize("case", BAD)
def test_bad_picture_is_one_line_that_names_it(tmp_path: Path, case: str, capfd: pytest.CaptureFixture[str]) -> None:
    data, word = BAD[case]
    path = tmp_path / "a.png"
    path.write_bytes(data)
    with pytest.raises(SepiError) as caught:
        read_picture(path)
    assert str(caught.value).startswith(f"{path}: ")
    assert word in str(caught.value)
    assert capfd.readouterr() == ("", "")


UNREAD: dict[str, tuple[Callable[[Path], object], str]] = {
    "64 bit floats": (by_tifffile(RGBF.astype(np.float64)), "64 bit float"),
    "YCbCr of another range": (
        by_pillow_ycbcr(RGB8, tiffinfo={532: (15.0, 235.0, 128.0, 240.0, 128.0, 240.0)}),
        "neither grey nor RGB",
    ),
    "packed by Zstandard": (by_tifffile(RGB16, compression="zstd"), "save it uncompressed"),
    "below zero": (by_tifffile(-(GREY16 // 2).astype(np.int16) - 1), "a pixel of -32"),
    "not a number": (by_tifffile(np.where(RGBF > 0.5, np.float32(np.nan), RGBF)), "NaN"),
    "0 to 255": (by_tifffile(RGBF * 255), "within 0..1"),
}


@pytest.mark.parametrize("case", UNREAD)
def test_tiff_of_other_values_is_refused(tmp_path: Path, case: str, capfd: pytest.CaptureFixture[str]) -> None:
    """OpenCV decodes some of these to values that are not in the file."""
    write, word = UNREAD[case]
    write(tmp_path / "a.tif")
    with pytest.raises(SepiError, match=word) as caught:
        read_picture(tmp_path / "a.tif")
    assert str(caught.value).startswith(f"{tmp_path / 'a.tif'}: ")
    assert capfd.readouterr() == ("", "")


def test_what_is_no_file(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.png")
    (tmp_path / "folder.png").mkdir()
    (tmp_path / "gone.png").symlink_to(tmp_path / "nowhere.png")
    (tmp_path / "sparse.png").touch()
    os.truncate(tmp_path / "sparse.png", 2**33)
    words = {"pipe": "cannot be read", "folder": "cannot be read", "gone": "cannot be read", "sparse": f"{2**33} bytes"}
    for name, word in words.items():
        with pytest.raises(SepiError, match=rf"{name}\.png: {word}"):
            read_picture(tmp_path / f"{name}.png")


UNLIKE = {
    "size": (RGB8[1:], "50x39"),
    "depth": (RGB16, "16 bit"),
    "channels": (GREY8, "grey"),
}


@pytest.mark.parametrize("case", UNLIKE)
def test_views_of_two_sorts_are_refused(tmp_path: Path, case: str) -> None:
    pixels, word = UNLIKE[case]
    by_tifffile(RGB8)(tmp_path / "a.tif")
    by_tifffile(pixels)(tmp_path / "b.tif")
    with pytest.raises(SepiError, match=word) as caught:
        read_views([tmp_path / "a.tif", tmp_path / "b.tif"])
    assert "b.tif" in str(caught.value)
    assert "--exclude" in str(caught.value)


def test_views_come_in_the_order_asked_for(tmp_path: Path) -> None:
    """Threads finish in any order."""
    views = RANDOM.integers(0, 256, (9, 12, 16, 3), np.uint8)
    for number, view in enumerate(views):
        by_opencv(view)(tmp_path / f"{number}.png")
    order = [5, 1, 8, 0]
    np.testing.assert_array_equal(read_views([tmp_path / f"{number}.png" for number in order]), views[order])


def test_mask_is_white_inside(tmp_path: Path) -> None:
    write_png(tmp_path / "mask.png", np.array([[True, False]]))
    assert read_picture(tmp_path / "mask.png")[:, :, 0].tolist() == [[255, 0]]
