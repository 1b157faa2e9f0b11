"""Changes in the bytes of a file, such as damage or malice would make them: any, and those that readers trip over."""

import io
import random
import re
import struct
import zipfile
import zlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass

# numbers that a reader may take for a size, a place or a count
_NUMBERS = (0, 1, -1, 2, 127, 128, 255, 256, 32767, 65535, 2**16, 2**31 - 1, 2**31, 2**32 - 1, 2**32, 2**63 - 1, 2**64)
_TEXTS = (*map(str, _NUMBERS), str(10**12), "1e308", "1e999", "-0.0", "nan", "inf", "1e-320", "", "null", "true")
_ASCII_NUMBER = re.compile(rb"[-+]?[0-9]+(?:\.[0-9]+)?(?:e[-+]?[0-9]+)?")
# bytes that one change takes away, or puts in, at most
_LONGEST = 64
# changes that are made at a time, at most
_MOST = 4
# part of the changes of wrapped files that is made inside
_INSIDE = 0.7


@dataclass(frozen=True)
class Wrapping:
    """What hides the content of a file from changes: a checksum that would tell them, or compression.

    Attributes
    ----------
    open : callable
        From a file to its content; may raise anything for what is no such file.
    close : callable
        From content, whatever it is, to a file.
    """

    open: Callable[[bytes], bytes]
    close: Callable[[bytes], bytes]


def mutated(data: bytes, others: Sequence[bytes], rng: random.Random, wrappings: Sequence[Wrapping] = ()) -> bytes:
    """A few changes in a file; most of those of a wrapped one are made inside.

    Parameters
    ----------
    data : bytes
    others : sequence of bytes
        Files of the same kind, of which parts are put in.
    rng : random.Random
    wrappings : sequence of Wrapping
        Ways in which the files may be wrapped.
    """
    if wrappings and rng.random() < _INSIDE:
        wrapping = rng.choice(wrappings)
        try:
            inner = [wrapping.open(one) for one in (data, *others)]
        except Exception:
            # an earlier change broke it, in any of many ways
            inner = []
        if inner:
            return wrapping.close(_changed(inner[0], inner[1:], rng))
    return _changed(data, others, rng)


def _changed(data: bytes, others: Sequence[bytes], rng: random.Random) -> bytes:
    for _ in range(rng.randint(1, _MOST)):
        data = rng.choice(_CHANGES)(data, others, rng)
    return data


def _part(data: bytes, rng: random.Random) -> tuple[int, int]:
    """Where a part of a file begins and ends; early parts are the likelier ones, since that is where headers are."""
    start = int(len(data) * rng.random() ** rng.choice((1, 3)))
    return start, min(len(data), start + rng.randint(1, _LONGEST))


def _flipped(data: bytes, _: Sequence[bytes], rng: random.Random) -> bytes:
    start, _end = _part(data, rng)
    return data[:start] + bytes(byte ^ 1 << rng.randrange(8) for byte in data[start : start + 1]) + data[start + 1 :]


def _zeroed(data: bytes, _: Sequence[bytes], rng: random.Random) -> bytes:
    start, end = _part(data, rng)
    return data[:start] + bytes(end - start) + data[end:]


def _random(data: bytes, _: Sequence[bytes], rng: random.Random) -> bytes:
    start, end = _part(data, rng)
    return data[:start] + rng.randbytes(end - start) + data[end:]


def _cut_off(data: bytes, _: Sequence[bytes], rng: random.Random) -> bytes:
    return data[: _part(data, rng)[0]]


def _removed(data: bytes, _: Sequence[bytes], rng: random.Random) -> bytes:
    start, end = _part(data, rng)
    return data[:start] + data[end:]


def _repeated(data: bytes, _: Sequence[bytes], rng: random.Random) -> bytes:
    start, end = _part(data, rng)
    return data[:end] + data[start:end] * rng.choice((1, 1, 2, 20)) + data[end:]


def _spliced(data: bytes, others: Sequence[bytes], rng: random.Random) -> bytes:
    other = rng.choice([data, *others])
    (start, end), (first, last) = _part(data, rng), _part(other, rng)
    return data[:start] + other[first : rng.choice((last, len(other)))] + data[rng.choice((start, end)) :]


def _with_number(data: bytes, _: Sequence[bytes], rng: random.Random) -> bytes:
    """A number of 1 to 8 bytes in another's place."""
    start = _part(data, rng)[0]
    size = rng.choice((1, 2, 4, 8))
    start -= start % rng.choice((1, size))
    number = (rng.choice(_NUMBERS) + rng.choice((0, 0, -1, 1))) % 2 ** (8 * size)
    return data[:start] + number.to_bytes(size, rng.choice(("little", "big"))) + data[start + size :]


def _with_text(data: bytes, _: Sequence[bytes], rng: random.Random) -> bytes:
    """Digits replaced."""
    found = [match.span() for match in _ASCII_NUMBER.finditer(data[: 2**14])]
    if not found:
        return data
    start, end = rng.choice(found)
    return data[:start] + rng.choice(_TEXTS).encode() + data[end:]


_CHANGES = (
    *(_flipped, _zeroed, _random, _cut_off, _removed, _repeated, _spliced),
    # the likeliest to get past a first look
    *(_with_number, _with_number, _with_text, _with_text),
)


_SIGNATURE = b"\x89PNG\r\n\x1a\n"


def _png_closed(data: bytes) -> bytes:
    """A PNG with the right checksum behind each chunk."""
    parts, at = [data[:8]], 8
    while at + 12 <= len(data):
        (length,) = struct.unpack_from(">I", data, at)
        body = data[at + 4 : at + 8 + length]
        parts += [data[at : at + 4], body, struct.pack(">I", zlib.crc32(body))]
        at += 12 + length
    return b"".join(parts) + data[at:]


def _pixels_opened(data: bytes) -> bytes:
    """The body of the header of a PNG, and its rows as they are before they are packed."""
    packed, at = b"", 8
    while at + 12 <= len(data):
        (length,) = struct.unpack_from(">I", data, at)
        packed += data[at + 8 : at + 8 + length] if data[at + 4 : at + 8] == b"IDAT" else b""
        at += 12 + length
    return data[16:29] + zlib.decompress(packed)


def _pixels_closed(content: bytes) -> bytes:
    bodies = {b"IHDR": content[:13], b"IDAT": zlib.compress(content[13:], 1), b"IEND": b""}
    return _png_closed(
        _SIGNATURE + b"".join(struct.pack(">I", len(body)) + kind + body + bytes(4) for kind, body in bodies.items())
    )


def _zip_opened(data: bytes) -> bytes:
    """The first member of an archive."""
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        return archive.read(archive.infolist()[0])


def zip_of(name: str, *, packed: bool = True) -> Wrapping:
    """An archive of one member of this name, whose checksum is right."""

    def closed(content: bytes) -> bytes:
        whole = io.BytesIO()
        with zipfile.ZipFile(whole, "w") as archive:
            kind = zipfile.ZIP_DEFLATED if packed else zipfile.ZIP_STORED
            archive.writestr(zipfile.ZipInfo(name), content, compress_type=kind, compresslevel=1)
        return whole.getvalue()

    return Wrapping(_zip_opened, closed)


# of MATLAB's version 5: bytes before the first element, and an element's tag for zlib
_MAT_HEADER, _MAT_PACKED = 128, 15


def _mat_opened(data: bytes) -> bytes:
    kind, length = struct.unpack_from("<II", data, _MAT_HEADER)
    if kind != _MAT_PACKED:
        raise ValueError
    return zlib.decompress(data[_MAT_HEADER + 8 : _MAT_HEADER + 8 + length])


def _mat_closed(content: bytes) -> bytes:
    packed = zlib.compress(content, 1)
    header = b"MATLAB 5.0 MAT-file".ljust(_MAT_HEADER - 4) + b"\x00\x01IM"
    return header + struct.pack("<II", _MAT_PACKED, len(packed)) + packed


PNG = (Wrapping(lambda data: data, _png_closed), Wrapping(_pixels_opened, _pixels_closed))
MAT = (Wrapping(_mat_opened, _mat_closed),)
