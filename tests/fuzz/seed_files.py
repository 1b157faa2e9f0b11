"""Small sound files of every kind that is read: what the targets begin with.

Each function fills an empty folder and returns the contents of its files.
"""

import io
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import h5py
import numpy as np
import OpenEXR
import scipy.io
import tifffile
from mutations import zip_of
from PIL import Image

from sepi.camera import Camera
from sepi.extensions.benchmark.hci_submission import SHAPE as SUBMITTED
from sepi.io.hdf5 import write_light_field, write_stage
from sepi.io.pfm import write_pfm
from sepi.io.readers.exported import MANIFEST, write_exported
from sepi.io.result_folder import write_result
from sepi.io.scores import Evaluation, ExternalMap, write_external, write_scores
from sepi.lightfield import DisparityRange, LightField
from sepi.stage import StageMaps

H, W = 6, 10
RNG = np.random.default_rng(0)
VIEWS = RNG.integers(1, 256, (2, 3, H, W, 3), np.uint8)
VIEW = VIEWS[0, 0]
MAP = np.linspace(-1, 2, H * W, dtype=np.float32).reshape(H, W)
MASK = np.eye(H, W, dtype=bool)

# the user block of our HDF5 files, which holds the digest
_BLOCK = 512


def encoded(ending: str, image: np.ndarray = VIEW, *parameters: int) -> bytes:
    """A picture as OpenCV writes it."""
    done, data = cv2.imencode(ending, image, parameters)
    assert done
    return data.tobytes()


def with_pillow(image: Image.Image, kind: str, **options: Any) -> bytes:
    """A picture as Pillow writes it."""
    whole = io.BytesIO()
    image.save(whole, kind, **options)
    return whole.getvalue()


def png_files(_: Path) -> list[bytes]:
    """Grey, colours, a palette, transparency, 1 and 16 bit, with texts."""
    picture = Image.fromarray(VIEW)
    return [
        encoded(".png"),
        encoded(".png", VIEW[:, :, 0]),
        encoded(".png", VIEW.astype(np.uint16) * 257),
        encoded(".png", np.dstack([VIEW, VIEW[:, :, :1]])),
        with_pillow(picture.quantize(4), "PNG", transparency=1),
        with_pillow(picture.convert("1"), "PNG"),
        with_pillow(picture.convert("LA"), "PNG", dpi=(72, 72)),
        with_pillow(Image.fromarray(VIEW[:, :, 0]), "PNG", transparency=3),
    ]


def jpeg_files(_: Path) -> list[bytes]:
    """Colours, grey, progressive."""
    progressive = (cv2.IMWRITE_JPEG_PROGRESSIVE, 1)
    return [encoded(".jpg"), encoded(".jpg", VIEW[:, :, 0]), encoded(".jpg", VIEW, *progressive)]


def bmp_files(_: Path) -> list[bytes]:
    """Colours, grey, a palette, 1 bit."""
    picture = Image.fromarray(VIEW)
    others = [with_pillow(image, "BMP") for image in (picture.quantize(4), picture.convert("1"))]
    return [encoded(".bmp"), encoded(".bmp", VIEW[:, :, 0]), *others]


def webp_files(_: Path) -> list[bytes]:
    """Lossy, lossless, transparent."""
    transparent = np.dstack([VIEW, VIEW[:, :, :1]])
    return [encoded(".webp", VIEW, cv2.IMWRITE_WEBP_QUALITY, 50), encoded(".webp"), encoded(".webp", transparent)]


def pnm_files(_: Path) -> list[bytes]:
    """Binary and in digits, 8 and 16 bit, grey and colours."""
    text = " ".join(map(str, VIEW.ravel().tolist())).encode()
    return [
        encoded(".ppm"),
        encoded(".pgm", VIEW[:, :, 0].astype(np.uint16)),
        f"P5\n# a comment\n{W} {H}\n100\n".encode() + bytes(H * W),
        f"P3 {W} {H} 255\n".encode() + text,
        f"P2 {W} {H} 4095\n".encode() + text[: len(text) // 3],
    ]


def tiff_files(folder: Path) -> list[bytes]:
    """Plain and packed, in tiles, 8 and 16 bit and float, either byte order, transparent, BigTIFF."""
    path = folder / "a.tif"
    found = [encoded(".tif")]
    tiles = np.zeros((16, 16), np.uint8)
    for image, options in (
        (VIEW, {"photometric": "rgb"}),
        (VIEW[:, :, 0], {"byteorder": ">"}),
        (VIEW.astype(np.uint16), {"compression": "zlib", "predictor": True, "photometric": "rgb"}),
        (MAP.clip(0, 1), {"compression": "zlib"}),
        (np.dstack([VIEW, VIEW[:, :, :1]]), {"photometric": "rgb", "extrasamples": ["unassalpha"]}),
        (tiles, {"tile": (16, 16), "bigtiff": True}),
    ):
        tifffile.imwrite(path, image, **options)
        found.append(path.read_bytes())
    return found


def tiff_stack_files(folder: Path) -> list[bytes]:
    """Counted along two axes and not, in colours and grey, packed and plain."""
    found = []
    for image, options in (
        (VIEWS, {"photometric": "rgb"}),
        (VIEWS.reshape(6, H, W, 3), {"photometric": "rgb", "metadata": None, "compression": "zlib"}),
        (VIEWS.transpose(0, 1, 4, 2, 3), {"imagej": True, "metadata": {"axes": "TZCYX"}}),
        (VIEWS[..., 0].reshape(6, H, W), {"ome": True, "metadata": {"axes": "ZYX"}}),
    ):
        tifffile.imwrite(folder / "a.tif", image, **options)
        found.append((folder / "a.tif").read_bytes())
    return found


def exr_files(folder: Path) -> list[bytes]:
    """Half and float, grey, in colours, in a layer, packed in several ways."""
    path, colours = folder / "a.exr", (VIEW / 255).astype(np.float32)
    found = []
    for packing in (OpenEXR.ZIP_COMPRESSION, OpenEXR.PIZ_COMPRESSION, OpenEXR.NO_COMPRESSION):
        for channels in ({"RGB": colours}, {"a.RGB": colours.astype(np.float16)}, {"Y": colours[..., 0].copy()}):
            with OpenEXR.File({"compression": packing, "type": OpenEXR.scanlineimage}, channels) as file:
                file.write(str(path))
            found.append(path.read_bytes())
    return found


def tiff_map_files(folder: Path) -> list[bytes]:
    """Floats of any size, plain and packed, either byte order."""
    found = []
    for options in ({}, {"byteorder": ">"}, {"compression": "zlib"}):
        tifffile.imwrite(folder / "a.tif", MAP, **options)
        found.append((folder / "a.tif").read_bytes())
    return found


def pfm_files(folder: Path) -> list[bytes]:
    """Little and big-endian."""
    write_pfm(folder / "a.pfm", MAP)
    return [(folder / "a.pfm").read_bytes(), f"Pf\n{W} {H}\n1.0\n".encode() + MAP.astype(">f4").tobytes()]


def npy_map_files(folder: Path) -> list[bytes]:
    """Maps of several types."""
    return [_saved(folder, np.save, "a.npy", MAP.astype(kind)) for kind in ("<f4", ">f8", "<i2")]


def npy_files(folder: Path) -> list[bytes]:
    """Light fields as arrays: integers, floats, in Fortran's order, grey."""
    floats = (VIEWS / 255).astype(np.float32)
    arrays = (
        VIEWS,
        floats,
        np.asfortranarray(VIEWS),
        VIEWS[:, :2, ..., 0],
        VIEWS.astype(">f8"),
        VIEWS.reshape(6, H, W, 3),
    )
    return [_saved(folder, np.save, "a.npy", array) for array in arrays]


NPZ = zip_of("LF.npy")


def npz_files(folder: Path) -> list[bytes]:
    """One array, several, a channel in each of three."""
    return [
        NPZ.close(npy_files(folder)[0]),
        _saved(folder, np.savez, "a.npz", LF=VIEWS, other=MAP),
        _saved(folder, np.savez_compressed, "a.npz", r=VIEWS[..., 0], g=VIEWS[..., 1], b=VIEWS[..., 2]),
    ]


def mat_5_files(folder: Path) -> list[bytes]:
    """Packed, plain, beside text and cells, in structures."""
    found = []
    for packed, arrays in (
        (True, {"LF": VIEWS}),
        (False, {"LF": VIEWS[:, :2, ..., 0] / 255}),
        *((packed, {"a": {"name": "text", "b": {"LF": VIEWS}, "c": 1.5}}) for packed in (True, False)),
        (False, {"name": "text", "cells": np.array([1, "a"], object), "LF": VIEWS.astype(np.uint16), "m": MAP}),
    ):
        scipy.io.savemat(folder / "a.mat", arrays, do_compression=packed)
        found.append((folder / "a.mat").read_bytes())
    return found


def mat_7_3_files(folder: Path) -> list[bytes]:
    """As MATLAB writes them, and as others do."""

    def write(file: h5py.File, **options: Any) -> None:
        file.create_dataset("LF", data=VIEWS.T, **options)
        file["LF"].attrs["MATLAB_class"] = np.bytes_("uint8")
        file.create_group("#refs#")

    plain = hdf5(folder, write)
    packed = hdf5(folder, lambda file: write(file, chunks=True, compression="gzip"), userblock_size=_BLOCK)
    head = b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM"
    return [plain, head + packed[len(head) :]]


def hci_2013_files(folder: Path) -> list[bytes]:
    """With depth and camera as numbers and as texts, packed and plain."""
    depth = 5 + abs(MAP)

    def plain(file: h5py.File) -> None:
        file["LF"], file["GT_DEPTH"] = VIEWS, depth
        file.attrs.update({"dH": 0.05, "focalLength": 300.0, "shift": 1.25})

    def packed(file: h5py.File) -> None:
        file.create_dataset("LF", data=VIEWS, chunks=(1, 1, H, W, 3), compression="gzip")
        file["GT_DEPTH"] = np.broadcast_to(depth, (*VIEWS.shape[:2], H, W))
        file.attrs.update({"dH": np.bytes_("0.05"), "focalLength": [300.0], "shift": 1})

    return [hdf5(folder, plain), hdf5(folder, packed), hdf5(folder, packed, libver="latest")]


def hdf5_array_files(folder: Path) -> list[bytes]:
    """At the top, and in a group."""
    return [hdf5(folder, lambda file, name=name: file.create_dataset(name, data=VIEWS)) for name in ("x", "group/x")]


def open_lf_files(folder: Path) -> list[bytes]:
    """In colours with baselines, and grey."""
    picture = VIEWS.transpose(0, 2, 1, 3, 4).reshape(2 * H, 3 * W, 3)

    def write(file: h5py.File, channels: str) -> None:
        group = file.create_group("LF")
        names = ["bw"] if channels == "bw" else list(channels)
        for channel, name in enumerate(names):
            group[name] = picture[:, :, channel]
        group.attrs.update({"LF_TYPE": 1, "cams_h": 3, "cams_v": 2, "width": 3 * W, "height": 2 * H})
        group.attrs.update({"baseline_h": 0.4, "baseline_v": 0.2})

    return [hdf5(folder, lambda file: write(file, "rgb")), hdf5(folder, lambda file: write(file, "bw"))]


def hdf5_map_files(folder: Path) -> list[bytes]:
    """A map alone in another program's file."""
    options = {"chunks": (3, 5), "compression": "gzip"}
    packed = hdf5(folder, lambda file: file.create_dataset("disparity", data=MAP, **options))
    return [hdf5(folder, lambda file: file.create_dataset("disparity", data=MAP)), packed]


LIGHT_FIELD = LightField(
    VIEWS,
    "toy",
    "somewhere",
    disparity_range=DisparityRange(-1, 2, "given"),
    camera=Camera(15.0, 1.25, 300.0),
    ground_truth=MAP,
    masks={"occluded": MASK},
    notes=("one", "two"),
    positions=np.indices((2, 3)).transpose(1, 2, 0).astype(np.float64),
)
ERROR_BARS = {"sigma": abs(MAP), "low": MAP - 1, "high": MAP + 1}
MAPS = StageMaps(
    MAP, abs(MAP) / 2, {"unknown": MASK, "view_subset": MASK.astype(np.uint8), **ERROR_BARS}, ("all", "left")
)
RELIABILITY = np.arange(30.0).reshape(3, 10)
EVALUATION = Evaluation({"paper": {"all": {"mse": 1.5}}}, MAP, {"all": MASK}, {"all": "scene"}, RELIABILITY)
# what sepi.io.provenance reads of a stage file
_HISTORY = {"stage": "initial", "choice": "sepi", "parameters": '{"a": 1}', "made_from": '[{"stage": "none"}]'}


def own_light_field_files(folder: Path) -> list[bytes]:
    """With all that may be known, and with little."""
    little = LightField(VIEWS, "toy")
    return [_undigested(folder, lambda path, one=one: write_light_field(path, one)) for one in (LIGHT_FIELD, little)]


def stage_files(folder: Path) -> list[bytes]:
    """Maps and what made them."""
    return [_undigested(folder, lambda path: write_stage(path, MAPS, _HISTORY | {"threshold": 0.25}))]


def result_files(folder: Path) -> list[bytes]:
    """With and without a camera; as its files lie, and read otherwise."""

    def write(path: Path, light_field: LightField) -> None:
        write_result(path.parent / "result", light_field, MAPS, force=True)
        (path.parent / "result" / "result.h5").replace(path)

    fields = LIGHT_FIELD, LightField(VIEWS, "toy", reading='{"exclude": ["0,0"], "order": "flip-rows"}')
    return [_undigested(folder, lambda path, one=one: write(path, one)) for one in fields]


def score_files(folder: Path) -> list[bytes]:
    """Scores of two maps."""
    scored = dict.fromkeys(("a", "a/b"), EVALUATION)
    return [_undigested(folder, lambda path: write_scores(path, scored, {"scene": "toy"}))]


def external_files(folder: Path) -> list[bytes]:
    """A map with scores, and one with a problem."""
    maps = {"one": ExternalMap("a.pfm", "", "0" * 64, MAP, EVALUATION), "two": ExternalMap("b.pfm", "no file")}
    return [_undigested(folder, lambda path: write_external(path, maps))]


PARAMETERS = """[intrinsics]
focal_length_mm = 50
image_resolution_x_px = 10
image_resolution_y_px = 6
sensor_size_mm = 35
[extrinsics]
num_cams_x = 3
num_cams_y = 2
baseline_mm = 9.5
focus_distance_m = 2.5
[meta]
scene = toy
disp_min = -1.5
disp_max = 1.5
"""


def hci_pictures(folder: Path) -> None:
    """The views of a benchmark folder."""
    for number, view in enumerate(VIEWS.reshape(6, H, W, 3)):
        (folder / f"input_Cam{number:03}.png").write_bytes(encoded(".png", view))


def hci_folder(folder: Path) -> None:
    """A benchmark folder without ground truth."""
    hci_pictures(folder)
    (folder / "parameters.cfg").write_text(PARAMETERS, encoding="ascii")


def manifest_files(folder: Path) -> list[bytes]:
    """What an exported folder says of itself, much and little."""
    found = []
    for one in (LIGHT_FIELD, LightField(VIEWS, "toy")):
        write_exported(folder, one, force=True)
        found.append((folder / MANIFEST).read_bytes())
    return found


def exported_pictures(folder: Path) -> None:
    """The views of an exported folder, with what belongs to them."""
    write_exported(folder, LIGHT_FIELD)


def mask_files(_: Path) -> list[bytes]:
    """Masks as others write them."""
    white = np.asarray(255 * MASK, np.uint8)
    return [encoded(".png", white), encoded(".png", np.dstack(3 * [white]))]


SUBMISSION = zip_of("runtimes/cotton.txt")


def submission_files(_: Path) -> list[bytes]:
    """An archive with a map that has nothing, one that is too small, and a run time."""
    flat = f"Pf\n{SUBMITTED[1]} {SUBMITTED[0]}\n-1\n".encode() + bytes(4 * SUBMITTED[0] * SUBMITTED[1])
    small = zip_of("disp_maps/cotton.pfm", packed=False).close(b"Pf\n1 1\n-1\n" + bytes(4))
    return [SUBMISSION.close(b"12.5\n"), zip_of("disp_maps/cotton.pfm").close(flat), small]


def json_files(_: Path) -> list[bytes]:
    """Plans, numbers of a report, maps of other methods, parameters, pixels."""
    variant = {"initial": "sepi", "occlusion": "none", "textureless": "none", "optimize": "wls"}
    plan = {"scenes": {"hci": ["cotton"]}, "variants": {"paper": variant}, "external": ["one"]}
    return [
        json.dumps(value).encode()
        for value in (
            plan,
            {"plan": plan, "scenes": [], "tables": {}},
            {"SPO": {"path": "SPO/cotton.pfm", "scale": -1.0, "offset": 0}},
            {"num_disparities": 91, "range": [0, 1.5]},
        )
    ]


def hdf5(folder: Path, write: Callable[[h5py.File], object], **options: Any) -> bytes:
    """A file of another program."""
    path = folder / "a.h5"
    with h5py.File(path, "w", **options) as file:
        write(file)
    return path.read_bytes()


def _undigested(folder: Path, write: Callable[[Path], object]) -> bytes:
    """A file of ours without its digest, so that changes in it are not told at once; its texts of fixed length."""
    write(folder / "a.h5")
    with h5py.File(folder / "a.h5", "r+") as file:
        holders: list[Any] = [file]
        file.visititems(lambda _, entry: holders.append(entry))
        for holder in holders:
            texts = {key: value for key, value in holder.attrs.items() if isinstance(value, str)}
            holder.attrs.update({key: np.bytes_(value.encode() or b"\0") for key, value in texts.items()})
    return bytes(_BLOCK) + (folder / "a.h5").read_bytes()[_BLOCK:]


def _saved(folder: Path, save: Callable[..., object], name: str, *arrays: np.ndarray, **named: np.ndarray) -> bytes:
    save(folder / name, *arrays, **named)
    return (folder / name).read_bytes()
