"""Models of COLMAP as its own library writes them: text, binary, and of rigs; and those that make no light field."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from sepi.camera.rig import FISHEYE, PINHOLE, Lens
from sepi.errors import SepiError
from sepi.extensions.cameras.reader import read_model
from sepi.extensions.cameras.rectification import Rectification

pycolmap = pytest.importorskip("pycolmap")

SIZE = 64
# parameters as COLMAP has them, and the lens that they are: principal points are counted from the corner there
LENSES: dict[str, tuple[list[float], str, tuple[float, ...]]] = {
    "SIMPLE_PINHOLE": ([80.0, 33.0, 31.0], PINHOLE, ()),
    "PINHOLE": ([80.0, 80.0, 33.0, 31.0], PINHOLE, ()),
    "SIMPLE_RADIAL": ([80.0, 33.0, 31.0, 0.05], PINHOLE, (0.05,)),
    "RADIAL": ([80.0, 33.0, 31.0, 0.05, -0.01], PINHOLE, (0.05, -0.01)),
    "OPENCV": ([80.0, 80.0, 33.0, 31.0, 0.05, -0.01, 0.002, 0.001], PINHOLE, (0.05, -0.01, 0.002, 0.001)),
    "OPENCV_FISHEYE": ([80.0, 80.0, 33.0, 31.0, 0.05, -0.01, 0.002, 0.001], FISHEYE, (0.05, -0.01, 0.002, 0.001)),
    "RADIAL_FISHEYE": ([80.0, 33.0, 31.0, 0.05, -0.01], FISHEYE, (0.05, -0.01)),
}
TURNS = [cv2.Rodrigues(np.array(turn))[0] for turn in ((0.0, 0.0, 0.0), (0.01, -0.02, 0.0), (0.0, 0.01, 0.03))]
CENTRES = np.array([[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.2, 0.0, 0.001]])


def _pose(turn: Any, centre: Any) -> Any:
    return pycolmap.Rigid3d(pycolmap.Rotation3d(np.asarray(turn)), -np.asarray(turn) @ centre)


def _model(folder: Path, kind: str = "PINHOLE", points: Any = None, apart: bool = True, scale: float = 1.0) -> Any:
    """Three cameras in a row before a slanted cloud of points; in one rig, which stands once, unless ``apart``."""
    model = pycolmap.Reconstruction()
    together = pycolmap.Rig(rig_id=1)
    for n, (turn, centre) in enumerate(zip(TURNS, scale * CENTRES, strict=True), 1):
        camera = pycolmap.Camera(camera_id=n, model=kind, width=SIZE, height=SIZE, params=LENSES[kind][0])
        model.add_camera(camera)
        rig = pycolmap.Rig(rig_id=n) if apart else together
        if apart or n == 1:
            rig.add_ref_sensor(camera.sensor_id)
        else:
            # the first camera is the rig
            rig.add_sensor(camera.sensor_id, _pose(turn, centre))
        if apart:
            model.add_rig(rig)
    (folder / "images").mkdir(parents=True)
    images = [pycolmap.Image(image_id=n, name=f"{n}.png", camera_id=n, frame_id=n if apart else 1) for n in (1, 2, 3)]
    if not apart:
        model.add_rig(together)
    for n in (1, 2, 3) if apart else (1,):
        frame = pycolmap.Frame(frame_id=n, rig_id=n, rig_from_world=_pose(TURNS[n - 1], scale * CENTRES[n - 1]))
        for image in images:
            if image.frame_id == n:
                frame.add_data_id(image.data_id)
        model.add_frame(frame)
    for image in images:
        model.add_image(image)
        cv2.imwrite(str(folder / "images" / image.name), np.full((SIZE, SIZE, 3), 128, np.uint8))
    for n in (1, 2, 3) if apart else (1,):
        model.register_frame(n)
    for point in np.zeros((0, 3)) if points is None else points:
        model.add_point3D(point, pycolmap.Track(), np.zeros(3, np.uint8))
    (folder / "sparse").mkdir()
    return model


def _cloud(depth: float) -> Any:
    across, down = np.meshgrid(np.linspace(-0.2, 0.2, 8), np.linspace(-0.2, 0.2, 8))
    return depth * np.column_stack([across.ravel(), down.ravel(), 1 + 0.5 * across.ravel()])


@pytest.mark.parametrize("kind", LENSES)
@pytest.mark.parametrize("written", ["text", "binary", "rig"])
def test_models_say_the_same_however_they_are_written(tmp_path: Path, kind: str, written: str) -> None:
    """A camera half a pixel, or a sensor's pose, off is a bias of all depth that nobody sees."""
    model = _model(tmp_path, kind, _cloud(2.0), apart=written != "rig")
    (model.write_text if written == "text" else model.write_binary)(str(tmp_path / "sparse"))
    found = read_model(tmp_path)
    _, lens, distortion = LENSES[kind]
    assert [shot.name for shot in found.shots] == ["1.png", "2.png", "3.png"]
    np.testing.assert_allclose(found.centres, CENTRES, atol=1e-12)
    for shot, turn in zip(found.shots, TURNS, strict=True):
        np.testing.assert_allclose(shot.rotation, turn, atol=1e-12)
        assert (shot.lens.kind, shot.lens.focal, shot.lens.principal) == (lens, (80.0, 80.0), (32.5, 30.5))
        assert shot.lens.distortion == distortion
    assert len(found.points) == 64
    known = Rectification(found).seeing.inverse_depths
    np.testing.assert_allclose(known, (1 / 2.2, 1 / 1.8), rtol=0.05)


def _backwards(folder: Path) -> None:
    _model(folder, points=-_cloud(2.0)).write_text(str(folder / "sparse"))


def _in_kilometres(folder: Path) -> None:
    _model(folder, points=_cloud(2.0), scale=1e-3).write_text(str(folder / "sparse"))


def _without_pictures(folder: Path) -> None:
    _model(folder).write_binary(str(folder / "sparse"))
    for path in (folder / "images").iterdir():
        path.unlink()


def _damaged(folder: Path) -> None:
    _model(folder).write_binary(str(folder / "sparse"))
    (folder / "sparse/images.bin").write_bytes((folder / "sparse/images.bin").read_bytes()[:40])


def _of_unknown_lenses(folder: Path) -> None:
    _model(folder).write_text(str(folder / "sparse"))
    cameras = folder / "sparse/cameras.txt"
    cameras.write_text(cameras.read_text().replace("PINHOLE 64 64 80 80 33 31", "FOV 64 64 80 80 33 31 0.1"))


@pytest.mark.parametrize(
    ("spoil", "expected"),
    [
        (_backwards, r"lie behind the cameras; expected .*OpenCV"),
        (_in_kilometres, r"move by 0\.0\d+ pixels .*unit"),
        (_without_pictures, r"no picture '1\.png' in .*--images"),
        (_damaged, "not a COLMAP model, or damaged"),
        (_of_unknown_lenses, "camera model: unknown 'FOV'"),
    ],
)
def test_bad_models_are_refused_in_one_line(tmp_path: Path, spoil: Callable[[Path], None], expected: str) -> None:
    spoil(tmp_path)
    with pytest.raises(SepiError, match=expected) as caught:
        Rectification(read_model(tmp_path))
    assert "\n" not in str(caught.value)
    assert str(tmp_path) in str(caught.value)


@pytest.mark.parametrize("kind", LENSES)
def test_lenses_see_as_opencv_says(kind: str) -> None:
    """Where calibration programs and this package differ, every picture is bent a little wrong."""
    _, lens_kind, distortion = LENSES[kind]
    lens = Lens(SIZE, SIZE, (80.0, 78.0), (32.5, 30.5), lens_kind, distortion)
    x, y = np.meshgrid(np.linspace(0, SIZE - 1, 9), np.linspace(0, SIZE - 1, 9))
    pixels = np.column_stack([x.ravel(), y.ravel()])
    rays = lens.rays(pixels)
    np.testing.assert_allclose(lens.project(3 * rays), pixels, atol=1e-6)
    project = cv2.projectPoints if lens_kind == PINHOLE else cv2.fisheye.projectPoints
    coefficients = np.array([*distortion, *(0.0,) * (4 - len(distortion))])
    theirs, _ = project(rays[:, None], np.zeros(3), np.zeros(3), lens.matrix, coefficients)
    np.testing.assert_allclose(lens.project(rays), theirs[:, 0], atol=1e-9)
    assert np.isnan(lens.project(-rays)).all()
