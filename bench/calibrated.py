"""Scores of scenes seen by a disturbed array of calibrated cameras, relative to a perfect array in its place."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

import cv2
import numpy as np

from sepi.camera import Camera
from sepi.camera.rig import Lens, Shot
from sepi.extensions.cameras.reader import read_cameras
from sepi.lightfield import DisparityRange, FloatMap, LightField
from sepi.pipeline import estimate_depth
from sepi.scenes import render_shot
from sepi.scoring.scores import score

Row = dict[str, str]

DISTURBANCES: dict[str, dict[str, float]] = {
    "turned": {"turn": 3.0},
    "zoomed": {"zoom": 0.05},
    "distorted": {"bend": 0.08},
    "off the grid": {"aside": 0.3},
    "out of the plane": {"ahead": 0.05},
    "all": {"turn": 3.0, "zoom": 0.05, "bend": 0.08, "aside": 0.3, "ahead": 0.05},
}
"""Largest turns in degrees, change of focal length, radial distortion, steps off the grid and out of its plane."""

# movement of the picture's middle from view to view, by converging cameras
_OFFSET = 4.0


def camera_of(size: int) -> Camera:
    """The camera of the scene; a view step is 0.05 of the focus distance."""
    return Camera(scale=_OFFSET, offset=_OFFSET, focal_px=1.25 * size)


def shots_of(size: int, count: int, seed: int, disturbance: dict[str, float]) -> list[Shot]:
    """Cameras near a grid of ``count`` x ``count``; the middle one is undisturbed."""
    camera, rng, shots = camera_of(size), np.random.default_rng(seed), []
    amounts = {"turn": 0.0, "zoom": 0.0, "bend": 0.0, "aside": 0.0, "ahead": 0.0, **disturbance}
    step = camera.scale / camera.focal_px
    for t, s in np.ndindex(count, count):
        middle = t == s == count // 2
        off = rng.uniform(-1, 1, 3) * (amounts["aside"], amounts["aside"], amounts["ahead"]) * (not middle)
        place = np.array([s - count // 2, t - count // 2, 0]) + off
        turn = cv2.Rodrigues(np.radians(rng.uniform(-1, 1, 3) * amounts["turn"]))[0]
        focal = camera.focal_px * (1 + amounts["zoom"] * rng.uniform(-1, 1))
        x, y = (size - 1) / 2 + place[:2] * camera.offset
        lens = Lens(size, size, (focal, focal), (x, y), distortion=(amounts["bend"] * rng.uniform(-1, 1),))
        shots.append(Shot(f"{t:02d}_{s:02d}.png", lens, np.asarray(turn), step * place))
    return shots


def seen_by(name: str, shots: Sequence[Shot], size: int) -> LightField:
    """The light field of a built-in scene from calibrated cameras."""
    with tempfile.TemporaryDirectory() as folder:
        entries = []
        for shot in shots:
            picture = render_shot(name, shot, camera=camera_of(size), size=size).picture
            cv2.imwrite(str(Path(folder) / shot.name), picture[..., ::-1])
            pose = {"position": shot.centre.tolist(), "rotation": shot.rotation.tolist()}
            lens = {key: list(getattr(shot.lens, key)) for key in ("focal", "principal", "distortion")}
            entries.append({"file": shot.name, **pose, **lens})
        (Path(folder) / "cameras.yaml").write_text(json.dumps({"units": "metres", "cameras": entries}))
        return read_cameras(folder)


def perfect_in_place_of(light_field: LightField, name: str, size: int, count: int) -> LightField:
    """The scene seen by ``count`` x ``count`` perfect cameras like those of the rectified views."""
    camera, rig = light_field.camera, light_field.reference_rig
    assert camera is not None
    assert rig is not None
    middle, step = count // 2, camera_of(size).scale / camera_of(size).focal_px / rig.step
    positions = np.array(step * (np.indices((count, count)).transpose(1, 2, 0) - middle), np.float64)
    views = np.zeros((count, count, *light_field.views.shape[2:]), np.float32)
    for t, s in np.ndindex(count, count):
        shot = rectified_shot(light_field, tuple(positions[t, s].tolist()))
        views[t, s] = render_shot(name, shot, camera=camera_of(size), size=size).picture / np.float32(255)
    return LightField(views, name, positions=positions, disparity_range=light_field.disparity_range, settled=True)


def rectified_shot(light_field: LightField, baseline: tuple[float, ...] = (0, 0)) -> Shot:
    """The camera of a rectified view at this baseline from the reference view."""
    camera, rig, (height, width) = light_field.camera, light_field.reference_rig, light_field.shape
    assert camera is not None
    assert rig is not None
    down, across = np.add(light_field.from_centre, baseline)
    x = (width - 1) / 2 + camera.right + across * camera.offset
    y = (height - 1) / 2 + camera.down + down * camera.offset
    return Shot("", Lens(width, height, (camera.focal_px,) * 2, (x, y)), rig.rotation, rig.centre(baseline))


def truth_of(light_field: LightField, name: str, size: int) -> FloatMap:
    """The true disparity of the rectified reference view."""
    camera = light_field.camera
    assert camera is not None
    depth = render_shot(name, rectified_shot(light_field), camera=camera_of(size), size=size).depth
    return np.asarray(camera.scale / depth - camera.offset, np.float32)


def rows(scenes: Iterable[str], size: int, count: int, seeds: Sequence[int], variant: str) -> Iterator[Row]:
    """A row for each scene and disturbance: scores over those of perfect cameras, means over seeds of each."""
    for name in scenes:
        for word, disturbance in DISTURBANCES.items():
            found = []
            for seed in seeds:
                bent = seen_by(name, shots_of(size, count, seed, disturbance), size)
                truth = truth_of(bent, name, size)
                bent = bent.with_range(_range_of(truth))
                perfect = perfect_in_place_of(bent, name, size, count)
                maps = [estimate_depth(light_field, variant).disparity for light_field in (bent, perfect)]
                scores = [score(disparity, truth) for disparity in maps]
                found.append([(one["mse100"], one["badpix007"], one["q25"]) for one in scores])
            own, ideal = np.mean(found, axis=0)
            row = {"scene": name, "cameras": word}
            for label, one, other in zip(("MSE x100", "BadPix 0.07 %", "Q25 x100"), own, ideal, strict=True):
                row[label] = f"{one:.3g} / {other:.3g} = {one / other:.2f}"
            yield row


def _range_of(truth: FloatMap) -> DisparityRange:
    low, high = float(truth.min()), float(truth.max())
    margin = 0.06 * (high - low) + 0.1
    return DisparityRange(low - margin, high + margin, "parameters")
