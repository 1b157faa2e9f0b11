"""Views for point clouds, and clouds as a reader of PLY that is not this package's gives them."""

from pathlib import Path

import numpy as np
from plyfile import PlyData

from sepi.io.point_cloud import PointCloud, point_cloud
from sepi.lightfield import LightField

H, W = 20, 31


def light_field(kind: type = np.uint8, channels: int = 3, **known: object) -> LightField:
    rng = np.random.default_rng(0)
    top = 1 if kind is np.float32 else np.iinfo(kind).max
    views = (rng.random((5, 7, H, W, channels)) * top).astype(kind)
    return LightField(views=views, name="toy", **known)


def cloud_of(scene: LightField, disparity: np.ndarray) -> PointCloud:
    view = scene.views[scene.reference_position]
    return point_cloud(view, disparity, camera=scene.camera, from_centre=scene.from_centre)


def read_back(path: Path) -> tuple[np.ndarray, np.ndarray, PlyData]:
    """Positions and colours of a PLY by a reader that is not this package's."""
    data = PlyData.read(str(path))
    vertex = data["vertex"].data
    positions = np.stack([vertex[name] for name in "xyz"], axis=1)
    colours = np.stack([vertex[name] for name in ("red", "green", "blue")], axis=1)
    return positions, colours, data
