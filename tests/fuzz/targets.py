"""The readers of all that a user hands in, by name: small sound files to begin with, and how they are read."""

import io
import json
import struct
import zipfile
import zlib
from collections.abc import Callable, Iterable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import h5py
import numpy as np
import OpenEXR
import scipy.io
import tifffile
import yaml
from PIL import Image

from sepi.camera import Camera
from sepi.errors import SepiError
from sepi.extensions.benchmark.hci_submission import SHAPE as SUBMITTED
from sepi.extensions.benchmark.hci_submission import problems_of
from sepi.extensions.formats.exported import write_exported
from sepi.io.all_views import read_error_bars_at
from sepi.io.disparity_maps import TruthFile, is_disparity, read_disparity, write_pfm
from sepi.io.hdf5 import read_light_field as read_own
from sepi.io.hdf5 import read_stage, write_light_field, write_stage
from sepi.io.images import picture_header, png_texts, read_picture, write_png
from sepi.io.provenance import history_of, read_origin
from sepi.io.readers.exported import MANIFEST
from sepi.io.readers.formats import format_of, read, size_of
from sepi.io.readers.options import ReadOptions
from sepi.io.result_folder import read_result, write_result
from sepi.lightfield import DisparityRange, LightField
from sepi.report.runs import read_numbers
from sepi.stage import StageMaps
from sepi.workflow.config import load_settings

H, W = 6, 10
VIEWS = np.random.default_rng(0).integers(1, 256, (2, 3, H, W, 3), np.uint8)
VIEW = VIEWS[0, 0]
MAP = np.linspace(-1, 2, H * W, dtype=np.float32).reshape(H, W)
MASK = np.eye(H, W, dtype=bool)

Seeds = Callable[[Path], Iterable[bytes]]


@dataclass(frozen=True)
class Target:
    """A reader of what users hand in.

    ``file`` is the name of the file that is changed; ``seeds`` makes sound ones in an empty folder; ``read`` reads one
    as a user's command would; ``around`` makes what lies beside it; ``close`` puts changed content into its wrapping,
    with the right checksum. Messages begin with the path if ``names_path``; some seeds are refused if ``partly``.
    """

    file: str
    seeds: Seeds
    read: Callable[[Path], object]
    around: Callable[[Path], object] = lambda _: None
    close: Callable[[bytes], bytes] = lambda content: content
    names_path: bool = True
    partly: bool = False


def saved(folder: Path, name: str, save: Callable[[Path], object]) -> bytes:
    save(folder / name)
    return (folder / name).read_bytes()


def each(*reads: Callable[[Path], object]) -> Callable[[Path], object]:
    """Every one of several readers of a file, also where another refuses it; the first refusal is raised."""

    def read_all(path: Path) -> None:
        refused = []
        for one in reads:
            try:
                one(path)
            except SepiError as error:
                refused.append(error)
        if refused:
            raise refused[0]

    return read_all


# --- wrappings


def png_closed(data: bytes) -> bytes:
    """A PNG with the right checksum behind each chunk."""
    parts, at = [data[:8]], 8
    while at + 12 <= len(data):
        (length,) = struct.unpack_from(">I", data, at)
        body = data[at + 4 : at + 8 + length]
        parts += [data[at : at + 4], body, struct.pack(">I", zlib.crc32(body))]
        at += 12 + length
    return b"".join(parts) + data[at:]


def zipped(name: str) -> Callable[[bytes], bytes]:
    """An archive of one member of this name."""

    def closed(content: bytes) -> bytes:
        whole = io.BytesIO()
        with zipfile.ZipFile(whole, "w", zipfile.ZIP_DEFLATED) as archive:
            archive.writestr(zipfile.ZipInfo(name), content, compresslevel=1)
        return whole.getvalue()

    return closed


def mat_closed(content: bytes) -> bytes:
    """A file of MATLAB 5 with one packed element."""
    packed = zlib.compress(content, 1)
    return b"MATLAB 5.0 MAT-file".ljust(124) + b"\x00\x01IM" + struct.pack("<II", 15, len(packed)) + packed


# --- pictures and maps


def pictures(kind: str) -> Seeds:
    """Pictures of every kind of pixels that Pillow writes."""

    def made(_: Path) -> Iterable[bytes]:
        deep = Image.fromarray(VIEW[:, :, 0].astype(np.uint16) * 257)
        for image in (deep, *(Image.fromarray(VIEW).convert(mode) for mode in ("RGB", "L", "P", "1", "RGBA"))):
            whole = io.BytesIO()
            with suppress(OSError):
                image.save(whole, kind)
                yield whole.getvalue()

    return made


def tiffs(*images: tuple[np.ndarray, dict[str, Any]]) -> Seeds:
    def made(folder: Path) -> Iterable[bytes]:
        for image, options in images:
            tifffile.imwrite(folder / "a.tif", image, **options)
            yield (folder / "a.tif").read_bytes()

    return made


TIFFS = tiffs(
    (VIEW, {"photometric": "rgb"}),
    (VIEW[:, :, 0], {"byteorder": ">"}),
    (VIEW.astype(np.uint16), {"compression": "zlib", "predictor": True, "photometric": "rgb"}),
    (MAP.clip(0, 1), {"compression": "zlib"}),
    (np.zeros((16, 16), np.uint8), {"tile": (16, 16), "bigtiff": True}),
)
STACKS = tiffs(
    (VIEWS, {"photometric": "rgb"}),
    (VIEWS.reshape(6, H, W, 3), {"photometric": "rgb", "metadata": None, "compression": "zlib"}),
    (VIEWS.transpose(0, 1, 4, 2, 3), {"imagej": True, "metadata": {"axes": "TZCYX"}}),
    (VIEWS[..., 0].reshape(6, H, W), {"ome": True, "metadata": {"axes": "ZYX"}}),
)
MAP_TIFFS = tiffs((MAP, {}), (MAP, {"byteorder": ">"}), (MAP, {"compression": "zlib"}))


def pnms(_: Path) -> Iterable[bytes]:
    text = " ".join(map(str, VIEW.ravel().tolist())).encode()
    yield b"P5\n# a comment\n10 6\n100\n" + bytes(H * W)
    yield b"P6 10 6 255\n" + VIEW.tobytes()
    yield b"P3 10 6 255\n" + text
    yield b"P2 10 6 4095\n" + text[: len(text) // 3]


def exrs(folder: Path) -> Iterable[bytes]:
    colours = (VIEW / 255).astype(np.float32)
    for packing in (OpenEXR.ZIP_COMPRESSION, OpenEXR.PIZ_COMPRESSION, OpenEXR.NO_COMPRESSION):
        for channels in ({"RGB": colours}, {"a.RGB": colours.astype(np.float16)}, {"Y": colours[..., 0].copy()}):
            with OpenEXR.File({"compression": packing, "type": OpenEXR.scanlineimage}, channels) as file:
                file.write(str(folder / "a.exr"))
            yield (folder / "a.exr").read_bytes()


def pfms(folder: Path) -> Iterable[bytes]:
    yield saved(folder, "a.pfm", lambda path: write_pfm(path, MAP))
    yield b"Pf\n10 6\n1.0\n" + MAP.astype(">f4").tobytes()


def map_pngs(folder: Path) -> Iterable[bytes]:
    levels = np.arange(H * W, dtype=np.uint16).reshape(H, W)
    yield saved(folder, "a.png", lambda path: write_png(path, levels, {"scale": "0.001", "offset": "-1.5"}))
    yield saved(folder, "a.png", lambda path: write_png(path, levels))


def npys(*arrays: np.ndarray) -> Seeds:
    return lambda folder: [saved(folder, "a.npy", lambda path, one=one: np.save(path, one)) for one in arrays]


NPYS = npys(
    VIEWS, (VIEWS / 255).astype(np.float32), np.asfortranarray(VIEWS), VIEWS.astype(">f8"), VIEWS[:, :2, ..., 0]
)


def read_picture_and_header(path: Path) -> None:
    png_texts(path)
    picture_header(path)
    read_picture(path)


def read_map(path: Path) -> None:
    is_disparity(path)
    read_disparity(path)
    read_disparity(path, scale=-0.5, offset=1)


MAP_READERS = each(
    read_map,
    lambda path: read_disparity(path, scale=1e300, offset=-1e300),
    lambda path: (TruthFile(path, 0.1).read(), TruthFile(path, 0.1).step),
)

# --- light fields


def read_field(path: Path) -> None:
    """A light field as ``sepi depth`` reads it, but for what it finds out from the pixels."""
    # of damaged files it must give some size, since the workflow plans with them, too
    size_of([path])
    format_of(path)
    read(path, ReadOptions())


def read_parent(path: Path) -> None:
    read(path.parent, ReadOptions())


def lenslets(_: Path) -> Iterable[bytes]:
    return [cv2.imencode(".png", np.tile(VIEW[:, :7], (7, 8, 1)))[1].tobytes()]


def npzs(folder: Path) -> Iterable[bytes]:
    yield saved(folder, "a.npz", lambda path: np.savez(path, LF=VIEWS, other=MAP))
    channels = {name: VIEWS[..., number] for number, name in enumerate("rgb")}
    yield saved(folder, "a.npz", lambda path: np.savez_compressed(path, **channels))


def mats(folder: Path) -> Iterable[bytes]:
    nested = {"a": {"name": "text", "b": {"LF": VIEWS}, "c": 1.5}}
    cells = {"name": "text", "cells": np.array([1, "a"], object), "LF": VIEWS.astype(np.uint16), "m": MAP}
    for arrays in ({"LF": VIEWS[:, :2, ..., 0] / 255}, nested, cells):
        scipy.io.savemat(folder / "a.mat", arrays)
        yield (folder / "a.mat").read_bytes()


def mat_elements(folder: Path) -> Iterable[bytes]:
    """What is packed in a file of MATLAB 5."""
    for arrays in ({"LF": VIEWS}, {"a": {"name": "text", "b": {"LF": VIEWS}}}):
        scipy.io.savemat(folder / "a.mat", arrays, do_compression=False)
        yield (folder / "a.mat").read_bytes()[128:]


def hdf5(*writes: Callable[[h5py.File], object], **options: Any) -> Seeds:
    """Files of other programs."""

    def made(folder: Path) -> Iterable[bytes]:
        for write in writes:
            with h5py.File(folder / "a.h5", "w", **options) as file:
                write(file)
            yield (folder / "a.h5").read_bytes()

    return made


def hci_2013(file: h5py.File) -> None:
    file.create_dataset("LF", data=VIEWS, chunks=(1, 1, H, W, 3), compression="gzip")
    file["GT_DEPTH"] = np.broadcast_to(5 + abs(MAP), (*VIEWS.shape[:2], H, W))
    file.attrs.update({"dH": np.bytes_("0.05"), "focalLength": [300.0], "shift": 1})


def open_lf(file: h5py.File) -> None:
    group = file.create_group("LF")
    for channel, name in enumerate("rgb"):
        group[name] = VIEWS[..., channel].transpose(0, 2, 1, 3).reshape(2 * H, 3 * W)
    group.attrs.update({"LF_TYPE": 1, "cams_h": 3, "cams_v": 2, "width": 3 * W, "height": 2 * H})
    group.attrs.update({"baseline_h": 0.4, "baseline_v": 0.2})


def mat_7_3(folder: Path) -> Iterable[bytes]:
    def write(file: h5py.File) -> None:
        file.create_dataset("LF", data=VIEWS.T, chunks=True, compression="gzip")
        file["LF"].attrs["MATLAB_class"] = np.bytes_("uint8")
        file.create_group("#refs#")

    head = b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM"
    for data in hdf5(write, userblock_size=512)(folder):
        yield head + data[len(head) :]


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


def views_of_hci(folder: Path) -> None:
    for number, view in enumerate(VIEWS.reshape(6, H, W, 3)):
        cv2.imwrite(str(folder / f"input_Cam{number:03}.png"), view)


def hci_folder(folder: Path) -> None:
    views_of_hci(folder)
    (folder / "parameters.cfg").write_text(PARAMETERS, encoding="ascii")


# --- our own files


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
FIELDS = LIGHT_FIELD, LightField(VIEWS, "toy", reading='{"exclude": ["0,0"], "order": "flip-rows"}')
MAPS = StageMaps(
    MAP,
    abs(MAP) / 2,
    {"unknown": MASK, "view_subset": MASK.astype(np.uint8), "sigma": abs(MAP), "low": MAP - 1, "high": MAP + 1},
    ("all", "left"),
)
HISTORY = {"stage": "initial", "choice": "sepi", "parameters": '{"a": 1}', "made_from": '[{"stage": "none"}]'}


def own(*writes: Callable[[Path], object]) -> Seeds:
    """Files of ours without their digest, so that changes are not told at once; their texts of fixed length."""

    def made(folder: Path) -> Iterable[bytes]:
        for write in writes:
            write(folder / "a.h5")
            with h5py.File(folder / "a.h5", "r+") as file:
                holders: list[Any] = [file]
                file.visititems(lambda _, entry, holders=holders: holders.append(entry))
                for holder in holders:
                    texts = {key: value for key, value in holder.attrs.items() if isinstance(value, str)}
                    holder.attrs.update({key: np.bytes_(value.encode() or b"\0") for key, value in texts.items()})
            yield bytes(512) + (folder / "a.h5").read_bytes()[512:]

    return made


def write_one_result(path: Path, light_field: LightField) -> None:
    write_result(path.parent / "result", light_field, MAPS, force=True)
    (path.parent / "result" / "result.h5").replace(path)


def manifests(folder: Path) -> Iterable[bytes]:
    for one in FIELDS:
        write_exported(folder, one, force=True)
        yield (folder / MANIFEST).read_bytes()


def exported_folder(folder: Path) -> None:
    write_exported(folder, LIGHT_FIELD, force=True)


# --- calibrated cameras

SIZE, CAMERAS = 24, 3
TURN = [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]


def taken(folder: Path) -> None:
    """A picture of each camera, and what COLMAP writes beside the poses."""
    for number, picture in enumerate(np.random.default_rng(1).integers(1, 256, (CAMERAS, SIZE, SIZE, 3), np.uint8)):
        cv2.imwrite(str(folder / f"{number}.png"), picture)


def rest_of_model(folder: Path) -> None:
    taken(folder)
    (folder / "cameras.txt").write_text(f"1 OPENCV {SIZE} {SIZE} 30 30 12 12 0.01 0 0 0\n")
    (folder / "points3D.txt").write_text("1 0.1 0.1 2.0 9 9 9 0.1\n2 -0.1 0.1 3.0 9 9 9 0.1\n")


def tables(_: Path) -> Iterable[bytes]:
    plain = [{"file": f"{n}.png", "position": [0.1 * n, 0.0, 0.0], "focal": 30.0} for n in range(CAMERAS)]
    more = {"rotation": TURN, "focal": [30, 31], "principal": [11.5, 12], "distortion": [0.01, 0, 0, 0.001]}
    full = [{**camera, **more, "rotation": [1, 0, 0, 0]} for camera in plain]
    wide = {"units": "metres", "shared": {**more, "lens": "fisheye"}, "cameras": plain}
    return [json.dumps(told).encode() for told in ({"cameras": plain}, {"cameras": full}, wide)]


def csvs(_: Path) -> Iterable[bytes]:
    yield b"file,x,y,z,fx\n" + b"".join(b"%d.png,0.%d,0,0,30\n" % (n, n) for n in range(CAMERAS))
    names = b"file,x,y,z,qw,qx,qy,qz,fx,fy,cx,cy,lens,k1,k2,p1,p2\n"
    yield names + b"".join(b"%d.png,0,0.%d,0,1,0,0,0,30,30,11,12,pinhole,0.1,0,0,0\n" % (n, n) for n in range(CAMERAS))


def transforms(_: Path) -> Iterable[bytes]:
    lens = {"fl_x": 30.0, "cx": 12.0, "cy": 12.0, "w": SIZE, "h": SIZE, "k1": 0.01, "camera_model": "OPENCV"}
    frames: list[dict[str, Any]] = []
    for n in range(CAMERAS):
        pose = np.eye(4)
        pose[0, 3] = 0.1 * n
        frames.append({"file_path": f"{n}.png", "transform_matrix": pose.tolist()})
    yield json.dumps({**lens, "frames": frames}).encode()
    yield json.dumps({"frames": [{**lens, **one} for one in frames]}).encode()


# --- texts


def lines(*texts: list[str] | str) -> Seeds:
    return lambda _: [(text if isinstance(text, str) else "\n".join(text)).encode() for text in texts]


CONFIG = """builtin: {scenes: [dots, pyramids], size: 96}
hci_root: hci
hci_2013_root: archive
light_fields:
  lego: {path: own.npy, grid: [2, 3], axes: TSHWC, order: flip-rows, exclude: ["0,0"], row_spacing: 1.5, white: 1e3}
external: {SPO: 'maps', OTHER: {path: 'maps/{scene}.pfm', scale: -1, offset: 0.5}}
disparity_range: {builtin/dots: [-1.5, 1e-1]}
report: {pixels: {builtin/dots: [[1, 2]]}, parts_of_best: true}
variants: {mine: {base: best, occlusion: {choice: visibility, use_mixture: false}}, other: {base: mine}}
stages:
  shared: {}
  initial: {sepi: {num_disparities: 91}}
"""


def config_folder(folder: Path) -> None:
    """What the configuration names."""
    for name in ("hci/toy", "archive", "maps"):
        (folder / name).mkdir(parents=True)
    views_of_hci(folder / "hci" / "toy")
    (folder / "archive" / "lf1.h5").write_bytes(next(iter(hdf5(hci_2013)(folder))))
    np.save(folder / "own.npy", VIEWS)


def read_config(path: Path) -> None:
    """A configuration, whose text Snakemake reads as YAML."""
    text = path.read_text(encoding="utf-8", errors="replace")
    try:
        values = yaml.safe_load(text)
    except (yaml.YAMLError, ValueError, RecursionError, TypeError, AttributeError, KeyError):
        # Snakemake's to tell
        return
    # places outside the folder are not looked into
    if isinstance(values, dict) and not any(word in text for word in ("..", "~", ": /", "'/", '"/')):
        load_settings(values)


VARIANT = {"initial": "sepi", "occlusion": "none", "textureless": "none", "optimize": "wls"}
PLAN = {"scenes": {"hci": ["cotton"]}, "variants": {"paper": VARIANT}, "external": ["one"]}
JSONS = lines(
    json.dumps(PLAN),
    json.dumps({"plan": PLAN, "scenes": [], "tables": {}}),
    '{"SPO": {"path": "SPO/cotton.pfm", "scale": -1.0, "offset": 0}}',
    '{"num_disparities": 91, "range": [0, 1.5]}',
)


def submission(path: Path) -> None:
    for problem in problems_of(path, partial=True):
        assert problem.isprintable(), problem


FLAT = b"Pf\n%d %d\n-1\n" % SUBMITTED[::-1] + bytes(4 * SUBMITTED[0] * SUBMITTED[1])

TARGETS: dict[str, Target] = {
    "png": Target("a.png", pictures("PNG"), read_picture_and_header, close=png_closed),
    "jpeg": Target("a.jpg", pictures("JPEG"), read_picture_and_header),
    "tiff": Target("a.tif", TIFFS, read_picture_and_header, partly=True),
    "tiff-stack": Target("a.tif", STACKS, read_field),
    "exr": Target("a.exr", exrs, read_picture_and_header),
    "bmp": Target("a.bmp", pictures("BMP"), read_picture_and_header, partly=True),
    "webp": Target("a.webp", pictures("WEBP"), read_picture_and_header),
    "pnm": Target("a.pgm", pnms, read_picture_and_header),
    "pfm": Target("a.pfm", pfms, MAP_READERS),
    "map-npy": Target("a.npy", npys(MAP, MAP.astype(">f8"), MAP.astype("<i2")), MAP_READERS),
    "map-png": Target("a.png", map_pngs, MAP_READERS, close=png_closed, partly=True),
    "map-tiff": Target("a.tif", MAP_TIFFS, MAP_READERS),
    "map-hdf5": Target("a.h5", hdf5(lambda file: file.create_dataset("disparity", data=MAP)), read_map),
    "hci-parameters": Target("parameters.cfg", lines(PARAMETERS), read_parent, views_of_hci),
    "hci-truth": Target("gt_disp_lowres.pfm", pfms, read_parent, hci_folder),
    "exported": Target(MANIFEST, manifests, read_parent, exported_folder),
    "hci-2013": Target("a.h5", hdf5(hci_2013), read_field),
    "openlf": Target("a.h5", hdf5(open_lf), read_field),
    "hdf5": Target("a.h5", hdf5(lambda file: file.create_dataset("group/x", data=VIEWS)), read_field),
    "mat-5": Target("a.mat", mats, read_field),
    "mat-5-packed": Target("a.mat", mat_elements, read_field, close=mat_closed),
    "mat-7.3": Target("a.mat", mat_7_3, read_field),
    "npy": Target("a.npy", NPYS, read_field),
    "npz": Target("a.npz", npzs, read_field),
    "npz-packed": Target("a.npz", NPYS, read_field, close=zipped("LF.npy")),
    "eslf": Target("a_eslf.png", lenslets, read_field),
    "own-light-field": Target(
        "a.h5", own(*(lambda path, one=one: write_light_field(path, one) for one in FIELDS)), each(read_own, read_field)
    ),
    "stage": Target(
        "a.h5", own(lambda path: write_stage(path, MAPS, HISTORY)), each(read_stage, history_of, read_origin)
    ),
    "result": Target(
        "a.h5",
        own(*(lambda path, one=one: write_one_result(path, one) for one in FIELDS)),
        each(read_result, read_origin, read_error_bars_at, read_map),
    ),
    "submission": Target("a.zip", lambda _: [zipped("disp_maps/cotton.pfm")(FLAT)], submission),
    "json": Target("a.json", JSONS, read_numbers, partly=True),
    "config": Target(
        "config.yaml",
        lines(CONFIG, "stages: &a {initial: {sepi: null, x: *a}}"),
        read_config,
        config_folder,
        names_path=False,
        partly=True,
    ),
    "cameras-yaml": Target("cameras.yaml", tables, read_parent, taken),
    "cameras-csv": Target("cameras.csv", csvs, read_parent, taken),
    "transforms": Target("transforms.json", transforms, read_parent, taken),
    "colmap-images": Target(
        "images.txt",
        lines("".join(f"{n + 1} 1 0 0 0 {-0.1 * n} 0 0 1 {n}.png\n\n" for n in range(CAMERAS))),
        read_parent,
        rest_of_model,
    ),
}
"""Name to target."""
