"""Pictures without poses become calibrated cameras, and those that cannot are refused by one line with the reason."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest
from error_lines import done

from sepi.camera import Camera
from sepi.camera.rig import Lens, Shot
from sepi.errors import SepiError
from sepi.extensions.cameras.calibration import calibrate, pairs_of, pictures_in
from sepi.extensions.cameras.frame import Plane
from sepi.extensions.cameras.model import CameraModel, Picture
from sepi.extensions.cameras.reader import read_model
from sepi.scenes import render_shot

pytest.importorskip("pycolmap")

SIZE = 176
# the focal length that COLMAP takes where the files tell none
FOCAL = 1.2 * SIZE
CAMERA = Camera(scale=6.0, offset=6.0, focal_px=FOCAL)


def _shot(name: str, x: float, y: float, z: float = 0.0, turn: tuple[float, float, float] = (0, 0, 0)) -> Shot:
    """A camera so many view steps off the centre, turned by degrees."""
    lens = Lens(SIZE, SIZE, (FOCAL, FOCAL), ((SIZE - 1) / 2,) * 2)
    place = np.array([x, y, z]) * CAMERA.scale / FOCAL
    return Shot(name, lens, np.asarray(cv2.Rodrigues(np.radians(turn))[0]), place)


def _write(folder: Path, shots: list[Shot]) -> list[Shot]:
    folder.mkdir(parents=True)
    for shot in shots:
        picture = render_shot("dots", shot, camera=CAMERA, size=SIZE).picture
        cv2.imwrite(str(folder / shot.name), picture[..., ::-1])
    return shots


@pytest.fixture(scope="module")
def sweep(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[Shot]]:
    rng, folder = np.random.default_rng(2), tmp_path_factory.mktemp("calibration") / "sweep"
    shots = [
        _shot(f"{n}.png", *(place + rng.uniform(-0.3, 0.3, 2)), turn=tuple(rng.uniform(-1.5, 1.5, 3)))
        for n, place in enumerate(np.array([(x, y) for y in (-1, 1) for x in (-2, 0, 2)]))
    ]
    return folder, _write(folder, shots)


@pytest.fixture(scope="module")
def calibrated(sweep: tuple[Path, list[Shot]]) -> tuple[Path, str]:
    """The model of the sweep, made by one thread, and what the command says of it."""
    out = sweep[0].with_name("out")
    called = done("calibrate", sweep[0], "-o", out, "--threads", "1")
    return out, called.output


def test_a_sweep_becomes_its_cameras(sweep: tuple[Path, list[Shot]], calibrated: tuple[Path, str]) -> None:
    """Turns and places are the true ones up to where the world begins and how large it is; and depth takes them."""
    (folder, shots), (out, said) = sweep, calibrated
    assert "placed: 6 of 6 pictures" in said
    assert "view steps of a plane" in said
    assert f"next: sepi depth {out}" in said
    assert sorted(path.name for path in out.iterdir()) == ["project.ini", "sparse"]
    model = read_model(out)
    assert [path.samefile(folder / shot.name) for shot, path, _ in model.pictures] == [True] * 6
    # from the model's world to the true one
    world = shots[0].rotation.T @ model.shots[0].rotation
    for found, shot in zip(model.shots, shots, strict=True):
        assert np.degrees(np.linalg.norm(cv2.Rodrigues(found.rotation @ world.T @ shot.rotation.T)[0])) < 0.3
    found, true = (np.array([shot.centre for shot in many]) for many in (model.shots, shots))
    found, true = (found - found.mean(axis=0)) @ world.T, true - true.mean(axis=0)
    found *= (found * true).sum() / (found**2).sum()
    assert np.linalg.norm(found - true, axis=1).max() < 0.1 * CAMERA.scale / FOCAL


def test_equal_pictures_give_equal_models(
    sweep: tuple[Path, list[Shot]], calibrated: tuple[Path, str], tmp_path: Path
) -> None:
    """However many threads there are."""
    calibrate(sweep[0], tmp_path / "out", threads=2, force=True)
    for name in ("cameras.txt", "images.txt", "points3D.txt"):
        one, two = ((out / "sparse/0" / name).read_bytes() for out in (calibrated[0], tmp_path / "out"))
        assert one == two


def _blank(folder: Path, picture: np.ndarray) -> None:
    for n in range(3):
        cv2.imwrite(str(folder / f"{n}.png"), np.full_like(picture, 40 * n + 60))


def _turned_alone(folder: Path, picture: np.ndarray) -> None:
    for n in range(3):
        cv2.imwrite(str(folder / f"{n}.png"), picture[4 * n : 4 * n + 160, 6 * n : 6 * n + 160])


def _strangers(folder: Path, picture: np.ndarray) -> None:
    rng = np.random.default_rng(0)
    for n in range(3):
        cv2.imwrite(str(folder / f"{n}.png"), cv2.GaussianBlur(rng.integers(0, 255, (160, 160), np.uint8), (0, 0), 1.5))


def _none(folder: Path, picture: np.ndarray) -> None:
    (folder / "notes.txt").write_text("none")


def _broken(folder: Path, picture: np.ndarray) -> None:
    cv2.imwrite(str(folder / "a.png"), picture)
    (folder / "b.png").write_bytes((folder / "a.png").read_bytes()[:900])


@pytest.mark.parametrize(
    ("make", "expected"),
    [
        (_blank, r"in 0\.png, 1\.png, 2\.png; expected .* texture"),
        (_turned_alone, "turned but hardly moved"),
        (_strangers, r"no two of 0\.png, 1\.png, 2\.png"),
        (_none, "no pictures"),
        (_broken, "b.png.*cut off"),
    ],
)
def test_what_cannot_be_calibrated_is_told(
    sweep: tuple[Path, list[Shot]], tmp_path: Path, make: object, expected: str
) -> None:
    folder = tmp_path / "pictures"
    folder.mkdir()
    make(folder, cv2.imread(str(sweep[0] / "1.png")))  # type: ignore[operator]
    with pytest.raises(SepiError, match=expected) as caught:
        calibrate(folder, tmp_path / "out", threads=1)
    assert str(caught.value).startswith(str(folder))
    assert not (tmp_path / "out").exists()


def test_camera_that_goes_forward_is_told_before_anything_is_computed(tmp_path: Path) -> None:
    _write(tmp_path / "in", [_shot(f"{n}.png", 1 + 0.5 * n, 1.0, 8.0 * n) for n in range(3)])
    told = []
    with pytest.raises(SepiError, match=r"\d degrees .*; expected .* 45 to 90 degrees"):
        calibrate(tmp_path / "in", tmp_path / "out", threads=1, progress=told.append)
    assert told == []


def test_row_that_structure_from_motion_found_is_not_seen_from_above() -> None:
    """Errors of the places across a row tilted the plane of all views, and pictures became half as tall again."""
    stray = np.random.default_rng(0).normal(0, 0.5, 51)
    shots = tuple(_shot(str(n), n, aside, 0.75 * aside) for n, aside in enumerate(stray.tolist()))
    plane = Plane(CameraModel(Path("row"), tuple(Picture(shot, Path()) for shot in shots)), None)
    assert np.degrees(np.arccos(plane.rotation[2, 2])) < 12


def test_commands_that_use_pycolmap_can_be_ended_and_write_pictures() -> None:
    """It takes signals over when it is imported, and OpenCV, imported later, crashes as it writes a PNG."""
    program = """
import os, signal, sys
signal.signal(signal.SIGTERM, lambda *_: sys.exit(7))
from sepi.extensions.cameras.files import require_pycolmap
require_pycolmap("model")
import cv2, numpy
cv2.imencode(".png", numpy.full((200, 300, 3), 257, numpy.uint16))
os.kill(os.getpid(), signal.SIGTERM)
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (7, "")


def test_long_sweeps_are_matched_in_the_order_of_their_numbers(tmp_path: Path) -> None:
    """Every pair of a thousand pictures would take a day; in the order of letters, 10 would come before 9."""
    for n in (10, 9, 100):
        (tmp_path / f"img{n}.jpg").touch()
    assert [path.name for path in pictures_in(tmp_path)] == ["img9.jpg", "img10.jpg", "img100.jpg"]
    names = [str(n) for n in range(1000)]
    pairs = pairs_of(names)
    assert len(set(pairs)) == len(pairs) < 20 * len(names)
    assert {("0", "1"), ("0", "128"), ("998", "999")} <= set(pairs)
