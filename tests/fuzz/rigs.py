"""Files of calibrated cameras to begin with, and the pictures that lie beside them."""

import json
from pathlib import Path

import numpy as np
from seed_files import encoded

SIZE, CAMERAS = 24, 3
_PICTURES = np.random.default_rng(1).integers(1, 256, (CAMERAS, SIZE, SIZE, 3), np.uint8)
_TURN = [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]


def pictures(folder: Path) -> None:
    """A picture of each camera."""
    for number, picture in enumerate(_PICTURES):
        (folder / f"{number}.png").write_bytes(encoded(".png", picture))


def table_files(_: Path) -> list[bytes]:
    """YAML: plain, and with all that a camera may have."""
    plain = [{"file": f"{n}.png", "position": [0.1 * n, 0.0, 0.0], "focal": 30.0} for n in range(CAMERAS)]
    more = {"rotation": _TURN, "focal": [30, 31], "principal": [11.5, 12], "distortion": [0.01, 0, 0, 0.001]}
    full = [{**camera, **more, "rotation": [1, 0, 0, 0]} for camera in plain]
    wide = {"units": "metres", "shared": {**more, "lens": "fisheye"}, "cameras": [{**one, **more} for one in plain]}
    return [json.dumps({"cameras": cameras}).encode() for cameras in (plain, full)] + [json.dumps(wide).encode()]


def csv_files(_: Path) -> list[bytes]:
    """CSV: the columns that it needs, and all."""
    few = "file,x,y,z,fx\n" + "".join(f"{n}.png,{0.1 * n},0,0,30\n" for n in range(CAMERAS))
    names = "file,x,y,z,qw,qx,qy,qz,fx,fy,cx,cy,lens,k1,k2,p1,p2\n"
    all_of = names + "".join(f"{n}.png,0,{0.1 * n},0,1,0,0,0,30,30,11,12,pinhole,0.1,0,0,0\n" for n in range(CAMERAS))
    return [few.encode(), all_of.encode()]


def transforms_files(_: Path) -> list[bytes]:
    """What nerfstudio and others call ``transforms.json``: one lens, and a lens for each picture."""
    lens = {
        "fl_x": 30.0,
        "fl_y": 30.0,
        "cx": 12.0,
        "cy": 12.0,
        "w": SIZE,
        "h": SIZE,
        "k1": 0.01,
        "camera_model": "OPENCV",
    }
    poses = [np.eye(4) for _ in range(CAMERAS)]
    for n, pose in enumerate(poses):
        pose[0, 3] = 0.1 * n
    frames = [{"file_path": f"{n}.png", "transform_matrix": pose.tolist()} for n, pose in enumerate(poses)]
    return [
        json.dumps({**lens, "frames": frames}).encode(),
        json.dumps({"frames": [{**lens, **one} for one in frames]}).encode(),
    ]


def images_files(_: Path) -> list[bytes]:
    """The poses of a COLMAP model as text."""
    lines = [f"{n + 1} 1 0 0 0 {-0.1 * n} 0 0 1 {n}.png\n\n" for n in range(CAMERAS)]
    return ["".join(lines).encode()]


def rest_of_model(folder: Path) -> None:
    """What lies beside them, and the pictures."""
    pictures(folder)
    (folder / "cameras.txt").write_text(f"1 OPENCV {SIZE} {SIZE} 30 30 12 12 0.01 0 0 0\n")
    (folder / "points3D.txt").write_text("1 0.1 0.1 2.0 9 9 9 0.1\n2 -0.1 0.1 3.0 9 9 9 0.1\n")
