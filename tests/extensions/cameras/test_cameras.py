"""Calibrated cameras become a light field: from a table, a transforms.json and a COLMAP model."""

from __future__ import annotations

import json
import re
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from click.testing import CliRunner
from error_lines import done

import sepi
from sepi.camera import Camera
from sepi.camera.rig import Lens, Shot
from sepi.cli.main import main
from sepi.errors import SepiError
from sepi.extensions.cameras.data_sets import write_colmap, write_nerfstudio
from sepi.extensions.cameras.files import rotation_of
from sepi.extensions.cameras.posed_views import PosedViews
from sepi.extensions.cameras.reader import read_model
from sepi.extensions.cameras.rectification import Rectification, light_field_of
from sepi.io.disparity_maps import read_pfm
from sepi.io.point_cloud import point_cloud
from sepi.io.provenance import origin_attributes
from sepi.io.result_files import names_as_taken
from sepi.io.result_folder import write_as_taken
from sepi.scenes import render, render_shot
from sepi.workflow.datasets import own_scene

SIZE, FOCAL = 64, 80.0
CAMERA = Camera(scale=4.0, offset=4.0, focal_px=FOCAL)
# a world whose axes are not those of the cameras
TURN, AWAY = cv2.Rodrigues(np.array([0.3, -0.5, 0.2]))[0], np.array([5.0, -3.0, 2.0])


def _shots(count: int = 3, **changed: float) -> list[Shot]:
    """Cameras about a grid, in the axes of the scene, as different as gantries and arrays leave them."""
    amounts = {"turn": 3.0, "zoom": 0.05, "bend": 0.08, "aside": 0.3, "ahead": 0.05, **changed}
    rng, step, shots = np.random.default_rng(1), CAMERA.scale / FOCAL, []
    for t, s in np.ndindex(count, count):
        aside = rng.uniform(-1, 1, 3) * (amounts["aside"], amounts["aside"], amounts["ahead"])
        place = np.array([s - count // 2, t - count // 2, 0]) + aside
        turn = cv2.Rodrigues(np.radians(rng.uniform(-1, 1, 3) * amounts["turn"]))[0]
        focal = FOCAL * (1 + amounts["zoom"] * rng.uniform(-1, 1))
        principal = tuple(((SIZE - 1) / 2 + place[:2] * CAMERA.offset).tolist())
        lens = Lens(SIZE, SIZE, (focal, focal), principal, distortion=(amounts["bend"] * rng.uniform(-1, 1),))
        shots.append(Shot(f"{t}{s}.png", lens, np.asarray(turn), step * place))
    return shots


def _entry(shot: Shot) -> dict[str, Any]:
    return {
        "file": shot.name,
        "position": (TURN @ shot.centre + AWAY).tolist(),
        "rotation": (shot.rotation @ TURN.T).tolist(),
        "focal": list(shot.lens.focal),
        "principal": list(shot.lens.principal),
        "distortion": list(shot.lens.distortion),
    }


def _write(folder: Path, shots: list[Shot], name: str = "pyramids") -> Path:
    folder.mkdir(exist_ok=True)
    for shot in shots:
        picture = render_shot(name, shot, camera=CAMERA, size=SIZE).picture
        cv2.imwrite(str(folder / shot.name), picture[..., ::-1])
    table = folder / "cameras.yaml"
    table.write_text(json.dumps({"units": "metres", "cameras": list(map(_entry, shots))}))
    return table


def _rectified_shot(light_field: sepi.LightField, baseline: tuple[float, ...] = (0, 0)) -> Shot:
    """The camera of the rectified reference view, or one so many view steps down and across, in the scene's axes."""
    camera, rig, (height, width) = light_field.camera, light_field.reference_rig, light_field.shape
    down, across = np.add(light_field.from_centre, baseline)
    x = (width - 1) / 2 + camera.right + across * camera.offset
    y = (height - 1) / 2 + camera.down + down * camera.offset
    lens = Lens(width, height, (camera.focal_px,) * 2, (x, y))
    return Shot("", lens, rig.rotation @ TURN, TURN.T @ (rig.centre(baseline) - AWAY))


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return _write(tmp_path_factory.mktemp("rig"), _shots()).parent


def test_cameras_of_any_pose_see_what_the_rectified_camera_would(folder: Path) -> None:
    """Turned, bent, zoomed and displaced: the views move by the disparity, and points lie on the world's surface."""
    found = Rectification(read_model(folder), inverse_depths=(0.7, 1.4))
    light_field = light_field_of(found)
    camera, shot = light_field.camera, _rectified_shot(light_field)
    seen = render_shot("pyramids", shot, camera=CAMERA, size=SIZE)
    # half a hundredth is what one interpolation leaves of textures as fine as pixels
    assert np.abs(light_field.reference_view - seen.picture / 255).mean() < 0.005
    truth = (camera.scale / seen.depth - camera.offset).astype(np.float32)
    # each view, brought to the reference view by the true disparity, is the reference view
    row, column = np.indices(light_field.shape)
    for t, s in np.argwhere(light_field.present).tolist():
        down, across = light_field.baselines[t, s]
        there = [(column - across * truth).astype(np.float32), (row - down * truth).astype(np.float32)]
        moved = cv2.remap(
            light_field.views[t, s], *there, cv2.INTER_CUBIC, borderMode=cv2.BORDER_CONSTANT, borderValue=(9, 9, 9)
        )
        inside = moved.max(axis=2) < 2
        assert np.median(np.abs(moved - light_field.reference_view)[inside]) < 0.012, (t, s)
    cloud = point_cloud(
        light_field.views[light_field.reference_position],
        truth,
        camera=camera,
        from_centre=light_field.from_centre,
        rig=light_field.reference_rig,
    )
    assert cloud.comments()[1] == "metres"
    # the scene's camera sees these points at the depths that it sees there
    points = (cloud.positions - AWAY) @ TURN
    pixels = points[:, :2] / points[:, 2:] * FOCAL + (SIZE - 1) / 2
    centre = Shot("", Lens(SIZE, SIZE, (FOCAL,) * 2, ((SIZE - 1) / 2,) * 2), np.eye(3), np.zeros(3))
    depth = render_shot("pyramids", centre, camera=CAMERA, size=SIZE).depth
    there = cv2.remap(depth, pixels.astype(np.float32)[:, None], None, cv2.INTER_LINEAR)[:, 0]  # type: ignore[call-overload]
    inside = ((pixels >= 0) & (pixels <= SIZE - 1)).all(axis=1)
    assert inside.mean() > 0.8
    assert np.median(np.abs(there - points[:, 2])[inside]) < 1e-3


def test_the_picture_is_the_reference_cameras_and_what_others_do_not_show_is_marked(folder: Path) -> None:
    """A third of the picture is lost where cameras are turned by a few degrees, or depth is made of what stands in."""
    light_field = light_field_of(Rectification(read_model(folder), inverse_depths=(0.7, 1.4)))
    assert min(light_field.shape) > 0.88 * SIZE
    missing = light_field.missing
    assert not missing[light_field.reference_position].any()
    assert 0.02 < missing.mean() < 0.2
    for t, s in np.argwhere(light_field.present).tolist():
        shot = _rectified_shot(light_field, tuple(light_field.baselines[t, s].tolist()))
        seen = render_shot("pyramids", shot, camera=CAMERA, size=SIZE).picture / 255
        off = np.abs(light_field.views[t, s] - seen).mean(axis=2)
        # zoomed to stand in the plane, which is right in the middle of the scene
        assert off[~missing[t, s]].mean() < 0.03
        if missing[t, s].sum() > 60:
            assert off[missing[t, s]].mean() > 2 * off[~missing[t, s]].mean(), "it is not shown"


def test_dots_are_where_they_should_be_in_every_rectified_view(tmp_path: Path) -> None:
    """A plane of dots before turned, bent and zoomed cameras: to a fiftieth of a pixel, or depth has that error."""
    across, down = np.meshgrid(np.linspace(-0.24, 0.24, 5), np.linspace(-0.24, 0.24, 5))
    dots = np.column_stack([across.ravel(), down.ravel(), np.ones(across.size)])
    shots, (y, x) = _shots(ahead=0.0), np.indices((SIZE, SIZE))
    for shot in shots:
        picture = np.full((SIZE, SIZE), 2000.0)
        for px, py in shot.lens.project((dots - shot.centre) @ shot.rotation.T):
            picture += 60000 * np.exp(-((x - px) ** 2 + (y - py) ** 2) / (2 * 1.5**2))
        cv2.imwrite(str(tmp_path / shot.name), np.rint(picture).astype(np.uint16))
    (tmp_path / "cameras.yaml").write_text(json.dumps({"cameras": list(map(_entry, shots))}))
    light_field = light_field_of(Rectification(read_model(tmp_path), inverse_depths=(0.9, 1.1)))
    rig = light_field.reference_rig
    poses = PosedViews(light_field, np.zeros(light_field.shape, np.float32))
    seen = (dots @ TURN.T + AWAY - rig.origin) @ rig.rotation.T
    errors = []
    for view, (t, s) in enumerate(poses.positions):
        bright = light_field.views[t, s].mean(axis=2) - 2000 / 65535
        for px, py in poses.project(seen, view):
            top, left = round(py) - 4, round(px) - 4
            if min(top, left) < 0 or top + 9 > light_field.shape[0] or left + 9 > light_field.shape[1]:
                continue
            part, (dy, dx) = bright[top : top + 9, left : left + 9], np.indices((9, 9))
            # weights about the place that is asked for: the bound is of that place
            near = part * np.exp(-((dy + top - py) ** 2 + (dx + left - px) ** 2) / (2 * 1.5**2))
            errors.append(np.hypot((near * (dy + top - py)).sum(), (near * (dx + left - px)).sum()) / near.sum() * 2)
    assert len(errors) > 60
    assert max(errors) < 0.02


@pytest.mark.extension("views")
def test_depth_command_reads_a_table_and_its_light_field_is_kept(folder: Path, tmp_path: Path) -> None:
    """The rig survives a file, and the points that are written stand in the world."""
    from sepi.extensions.views.files import write_all_views
    from sepi.io.hdf5 import write_light_field

    light_field = sepi.read_cameras(folder, disparity_range=(-2, 2))
    write_light_field(tmp_path / "kept.h5", light_field)
    again = sepi.read_light_field(tmp_path / "kept.h5")
    assert again.rig.to_text() == light_field.rig.to_text()
    assert again.camera == light_field.camera
    maps = sepi.StageMaps(np.zeros(light_field.shape, np.float32), np.ones(light_field.shape, np.float32))
    sepi.write_result(tmp_path / "result", light_field, maps)
    result = sepi.read_result(tmp_path / "result")
    position = light_field.positions[light_field.reference_position]
    np.testing.assert_allclose(result.rig.origin, light_field.rig.centre(position))
    called = done("points", tmp_path / "result", "-o", tmp_path / "p.ply")
    assert called.stdout.endswith("points, metres)\n")
    # a model of structure from motion has no metres
    table = folder / "cameras.yaml"
    (tmp_path / "cameras.yaml").write_text(table.read_text().replace('"units": "metres", ', ""))
    told = CliRunner().invoke(main, ["info", str(tmp_path / "cameras.yaml"), "--images", str(folder)])
    assert re.search(r"metric depth: +[\d.]+ units of the model / \(disparity", told.output), told.output
    assert b"calibrated cameras' world" in (tmp_path / "p.ply").read_bytes()[:300]
    # of another view, too
    other = (int(np.argwhere(light_field.present[0])[-1, 0]),)
    views = {(0, *other): {"disparity": maps.disparity, "confidence": maps.confidence, "extended": maps.disparity > 0}}
    about = {"scene": "rig", **origin_attributes(light_field)}
    write_all_views(tmp_path / "all.h5", light_field, views.items(), about)
    seen = sepi.read_result(tmp_path / "all.h5", (0, *other)).rig
    np.testing.assert_allclose(seen.origin, light_field.rig.centre(light_field.positions[(0, *other)]))


@pytest.mark.parametrize("kind", ["colmap", "nerfstudio"])
def test_poses_that_were_written_give_their_light_field_again(tmp_path: Path, kind: str) -> None:
    """Views, positions, camera and map come back as they were, whichever program they were written for."""
    if kind == "colmap":
        pytest.importorskip("pycolmap")
    light_field = replace(render("pyramids", size=SIZE, views=3), camera=CAMERA)
    truth = light_field.ground_truth
    {"colmap": write_colmap, "nerfstudio": write_nerfstudio}[kind](tmp_path / "out", PosedViews(light_field, truth))
    again = sepi.read_cameras(tmp_path / "out")
    assert again.grid == light_field.grid
    assert again.reference_position == (1, 1)
    np.testing.assert_allclose(again.baselines, light_field.baselines, atol=1e-9)
    np.testing.assert_allclose(again.views, light_field.views / np.float32(255), atol=1e-6)
    np.testing.assert_allclose(
        [again.camera.scale, again.camera.offset, again.camera.focal_px], [4, 4, FOCAL], rtol=1e-6
    )
    known = again.require_disparity_range()
    assert known.minimum < truth.min() + 0.1
    assert known.maximum > truth.max() - 0.1


@pytest.mark.parametrize("kind", ["colmap", "nerfstudio"])
def test_written_cameras_stand_in_the_calibrated_world(folder: Path, tmp_path: Path, kind: str) -> None:
    """Another program's map of the same room would lie elsewhere, turned."""
    if kind == "colmap":
        pytest.importorskip("pycolmap")
    light_field = sepi.read_cameras(folder)
    flat = np.zeros(light_field.shape, np.float32)
    posed = PosedViews(light_field, flat)
    {"colmap": write_colmap, "nerfstudio": write_nerfstudio}[kind](tmp_path / "out", posed)
    model, rig = read_model(tmp_path / "out"), light_field.rig
    # what a camera does not show is no picture to others, either
    again = light_field_of(Rectification(model, inverse_depths=(0.7, 1.4)))
    np.testing.assert_array_equal(again.missing, light_field.missing)
    places = np.array([rig.centre(at) for at in light_field.positions[light_field.present]])
    np.testing.assert_allclose(model.centres, places, atol=1e-9)
    for shot in model.shots:
        np.testing.assert_allclose(shot.rotation, rig.rotation, atol=1e-9)
    cloud = point_cloud(
        light_field.views[light_field.reference_position],
        flat,
        camera=light_field.camera,
        from_centre=light_field.from_centre,
        rig=light_field.reference_rig,
    )
    written = light_field.reference_rig.to_world(posed.points)
    np.testing.assert_allclose(written, cloud.positions.reshape(*light_field.shape, 3)[posed.chosen], atol=1e-5)
    if len(model.points):
        np.testing.assert_allclose(np.sort(model.points, axis=0), np.sort(written, axis=0), atol=1e-9)


def test_another_camera_has_no_maps_of_the_pictures_as_they_were_taken(tmp_path: Path) -> None:
    """Their lengths would be those of the calibrated one, beside metres of the other."""
    light_field = replace(render("dots", size=SIZE, views=3), camera=CAMERA)
    assert light_field.ground_truth is not None
    write_nerfstudio(tmp_path / "rig", PosedViews(light_field, light_field.ground_truth))
    flags = ("--focal-length", "35", "--baseline", "2", "--focus-distance", "3", "--sensor-size", "24")
    for name, more in (("as calibrated", ()), ("another", flags)):
        done("depth", tmp_path / "rig", "-o", tmp_path / name, "--variant", "fast", *more)
        assert (tmp_path / name / "depth.pfm").exists()
        assert any((tmp_path / name).glob("original_*")) == (not more)


def test_masks_of_pictures_leave_out_what_they_have_black(tmp_path: Path) -> None:
    """A hand before the lens, or the gantry itself, becomes part of the scene."""
    light_field = replace(render("dots", size=SIZE, views=3), camera=CAMERA)
    write_nerfstudio(tmp_path / "rig", PosedViews(light_field, np.zeros(light_field.shape, np.float32)))
    told = json.loads((tmp_path / "rig/transforms.json").read_text())
    mask = np.full((SIZE, SIZE), 255, np.uint8)
    mask[20:30, 40:50] = 0
    (tmp_path / "rig/masks").mkdir()
    for n, pixels in enumerate((mask, np.zeros_like(mask))):
        cv2.imwrite(str(tmp_path / f"rig/masks/{n}.png"), pixels)
        told["frames"][n]["mask_path"] = f"masks/{n}.png"
    path = tmp_path / "rig/transforms.json"
    path.write_text(json.dumps(told))
    read = light_field_of(Rectification(read_model(path), inverse_depths=(0.7, 1.4)))
    assert not read.present[0, 1], "it shows nothing at all"
    assert read.shape == (SIZE, SIZE)
    np.testing.assert_array_equal(read.missing[0, 0], mask == 0)
    assert not read.missing[1:].any()
    found = own_scene("rig", path, (), "config.light_fields.rig")
    assert tmp_path / "rig/masks/1.png" in found.files
    cv2.imwrite(str(tmp_path / "rig/masks/1.png"), mask[:40])
    with pytest.raises(SepiError, match=r"1\.png: 64x40 pixels; expected a mask as large as its picture, 64x64"):
        light_field_of(Rectification(read_model(path), inverse_depths=(0.7, 1.4)))


def test_other_exposure_is_made_up_for_and_equal_exposure_left_alone(folder: Path, tmp_path: Path) -> None:
    """A camera of an array that is a fifth darker looks like the others."""
    shutil.copytree(folder, tmp_path / "rig")
    dark = tmp_path / "rig/02.png"
    cv2.imwrite(str(dark), np.rint(cv2.imread(str(dark)) * np.array([0.9, 0.9, 0.75])).astype(np.uint8))
    plain, made = (
        light_field_of(Rectification(read_model(path), inverse_depths=(0.7, 1.4)))
        for path in (folder, tmp_path / "rig")
    )
    assert not any("brightness" in note for note in plain.notes)
    (change,) = (float(note.split("up to ")[1].split(" %")[0]) for note in made.notes if "brightness" in note)
    assert 15 < change < 35
    assert np.abs(made.views[0, 2].mean(axis=(0, 1)) / plain.views[0, 2].mean(axis=(0, 1)) - 1).max() < 0.02


def test_camera_far_off_the_plane_is_left_out_by_name(tmp_path: Path) -> None:
    shots = _shots(3, turn=0, zoom=0, bend=0, ahead=0)
    shots[2] = replace(shots[2], centre=shots[2].centre + np.array([0, 0, 0.15]))
    model = read_model(_write(tmp_path / "rig", shots))
    notes = Rectification(model, inverse_depths=(0.7, 1.4)).notes
    assert any("02.png" in note and "left out" in note for note in notes)


def _same_place(entries: list[dict[str, Any]]) -> None:
    entries[1]["position"] = entries[0]["position"]


def _facing(entries: list[dict[str, Any]]) -> None:
    entries[1]["rotation"] = (np.diag([-1.0, 1.0, -1.0]) @ np.array(entries[0]["rotation"])).tolist()


def _along(entries: list[dict[str, Any]]) -> None:
    for n, entry in enumerate(entries):
        entry["position"] = (n * TURN[:, 2]).tolist()


def _mirrored(entries: list[dict[str, Any]]) -> None:
    entries[0]["rotation"] = np.diag([1.0, 1.0, -1.0]).tolist()


def _gone(entries: list[dict[str, Any]]) -> None:
    entries[0]["file"] = "gone.png"


@pytest.mark.parametrize(
    ("spoil", "expected"),
    [
        (_same_place, r"leave one .*--exclude \w+\.png"),
        (_facing, "degrees apart"),
        (_along, r"\d degrees .*; expected .* to 90 degrees"),
        (_mirrored, "rotation: expected"),
        (_gone, "no picture 'gone.png'"),
    ],
)
def test_cameras_that_make_no_light_field_are_refused(folder: Path, tmp_path: Path, spoil: Any, expected: str) -> None:
    table = json.loads((folder / "cameras.yaml").read_text())
    spoil(table["cameras"])
    (tmp_path / "cameras.yaml").write_text(json.dumps(table))
    with pytest.raises(SepiError, match=expected) as caught:
        sepi.read_cameras(tmp_path, images=folder)
    assert "\n" not in str(caught.value)


def test_the_reference_camera_is_chosen_by_its_picture(folder: Path) -> None:
    """Depth is wanted for the one picture that is of use, not for the most central one."""
    light_field = sepi.read_cameras(folder, reference="00.png", disparity_range=(-2, 2))
    rig = light_field.reference_rig
    (view,) = rig.views.values()
    assert view.name == "00.png"
    np.testing.assert_allclose(rig.origin, view.centre, atol=1e-9)
    with pytest.raises(SepiError, match=r"no picture 'gone\.png' \(found: 00\.png, "):
        sepi.read_cameras(folder, reference="gone.png")
    with pytest.raises(SepiError, match=r"--reference does not apply"):
        sepi.read_light_field(folder / "00.png", options=sepi.ReadOptions(reference="00.png"), file_format="numpy")


LENS = Lens(128, 96, (100.0, 110.0), (60.5, 40.5))
KINDS = ("cameras.csv", "cameras.yaml", "transforms.json", "sparse/cameras.txt")


def _told_at(folder: Path, kind: str, size: tuple[int, int], *, sized: bool = True) -> Path:
    """Three cameras of :data:`LENS` in a file of one kind, and pictures of another size."""
    (folder / kind).parent.mkdir(parents=True, exist_ok=True)
    names = [f"{n}.png" for n in range(3)]
    for name in names:
        cv2.imwrite(str(folder / name), np.zeros(size[::-1], np.uint8))
    (fx, fy), (cx, cy), (w, h) = LENS.focal, LENS.principal, (LENS.width, LENS.height)
    if kind == "cameras.csv":
        rows = [f"{name},{n},0,0,{fx},{fy},{cx},{cy}" + f",{w},{h}" * sized for n, name in enumerate(names)]
        text = "\n".join(["file,x,y,z,fx,fy,cx,cy" + ",w,h" * sized, *rows])
    elif kind == "cameras.yaml":
        shared = {"focal": [fx, fy], "principal": [cx, cy], **({"size": [w, h]} if sized else {})}
        cameras = [{"file": name, "position": [n, 0, 0]} for n, name in enumerate(names)]
        text = json.dumps({"grid": "1x3", "shared": shared, "cameras": cameras})
    elif kind == "transforms.json":
        places = [[[1, 0, 0, n], [0, 1, 0, 0], [0, 0, 1, 0]] for n in range(3)]
        frames = [{"file_path": name, "transform_matrix": at} for name, at in zip(names, places, strict=True)]
        lens = {"fl_x": fx, "fl_y": fy, "cx": cx + 0.5, "cy": cy + 0.5, **({"w": w, "h": h} if sized else {})}
        text = json.dumps({**lens, "frames": frames})
    else:
        text = f"1 PINHOLE {w} {h} {fx} {fy} {cx + 0.5} {cy + 0.5}\n"
        images = "".join(f"{n + 1} 1 0 0 0 {-n} 0 0 1 {name}\n\n" for n, name in enumerate(names))
        (folder / "sparse/images.txt").write_text(images)
        (folder / "sparse/points3D.txt").write_text("")
    (folder / kind).write_text(text)
    return folder


@pytest.mark.parametrize("kind", KINDS)
def test_a_lens_is_that_of_the_picture_at_hand_whoever_tells_it(tmp_path: Path, kind: str) -> None:
    """Pictures of half the size with the lens of the whole ones give twice the depth, everywhere."""
    if kind.endswith("txt"):
        pytest.importorskip("pycolmap")
    half = read_model(_told_at(tmp_path / "half", kind, (64, 48)))
    assert {(shot.lens.width, shot.lens.height, shot.lens.focal, shot.lens.principal) for shot in half.shots} == {
        (64, 48, (50.0, 55.0), (30.0, 20.0))
    }
    assert "128x96 pixels scaled to pictures of 64x48" in Rectification(half).notes[0]
    assert read_model(_told_at(tmp_path / "same", kind, (128, 96))).notes == ()
    # neither scaled nor turned, but a part
    cut = _told_at(tmp_path / "cut", kind, (64, 64))
    with pytest.raises(SepiError, match=r"\.png: the picture is 64x64, .* 128x96; .* --crop-of 128x96\+X\+Y"):
        read_model(cut)
    model = read_model(cut, crop_of=(128, 96, 30, 20))
    assert {(shot.lens.width, shot.lens.focal, shot.lens.principal) for shot in model.shots} == {
        (64, LENS.focal, (30.5, 20.5))
    }
    with pytest.raises(SepiError, match=r"column 70, row 20 .*128x96"):
        read_model(cut, crop_of=(128, 96, 70, 20))


@pytest.mark.parametrize("kind", KINDS[:3])
def test_a_principal_point_of_other_pictures_is_told_where_no_size_is(tmp_path: Path, kind: str) -> None:
    folder = _told_at(tmp_path, kind, (64, 48), sized=False)
    with pytest.raises(SepiError, match=r"pictures about 1\.7 times as large; expected .*--crop-of"):
        read_model(folder)
    assert read_model(folder, crop_of=(128, 96, 0, 0)).shots[0].lens.principal == LENS.principal


def test_a_side_that_was_rounded_is_no_other_scale() -> None:
    """Sets of pictures come at a quarter of 4946x3286, and cameras of the quarter with the whole pictures."""
    whole, quarter = (4946, 3286), (1237, 822)
    for told, here in ((whole, quarter), (quarter, whole)):
        lens = Lens(*told, (1000.0, 1000.0), (told[0] / 2 - 0.5, told[1] / 2 - 0.5)).scaled(*here)
        assert lens.principal == pytest.approx((here[0] / 2 - 0.5, here[1] / 2 - 0.5))
    with pytest.raises(SepiError, match="is 3286x4946, but its camera has 4946x3286"):
        lens.scaled(3286, 4946)


@pytest.mark.parametrize("separator", [";", "\t"])
def test_tables_of_spreadsheets_and_numbers_as_text_are_taken(tmp_path: Path, separator: str) -> None:
    """Half of Europe's spreadsheets write ``0,5``; YAML takes 1e-4 for text, and programs quote what they print."""
    plain = read_model(_told_at(tmp_path, "cameras.csv", (128, 96)))
    text = (tmp_path / "cameras.csv").read_text().replace(",", separator)
    (tmp_path / "cameras.csv").write_text(re.sub(r"(\d)\.(\d)", r"\1,\2", text))
    again = read_model(tmp_path)
    for kind in ("cameras.yaml", "transforms_train.json"):
        other = _told_at(tmp_path / kind, kind.replace("_train", ""), (128, 96))
        file = other / kind.replace("_train", "")
        file.write_text(re.sub(r"(?<=[ \[])([\d.]+)(?=[,\]}])", r'"\1"', file.read_text()))
        assert [shot.lens.focal for shot in read_model(file.rename(other / kind).parent).shots] == [LENS.focal] * 3
    for one, two in zip(plain.shots, again.shots, strict=True):
        assert one.lens == two.lens
        assert one.centre.tolist() == two.centre.tolist()


def test_an_angle_of_view_is_that_of_the_pictures_width(tmp_path: Path) -> None:
    """Pictures are rarely square: depth would be wrong by the ratio of their sides."""
    file = _told_at(tmp_path, "transforms.json", (128, 96)) / "transforms.json"
    told = json.loads(file.read_text())
    del told["fl_x"], told["fl_y"]
    file.write_text(json.dumps(told | {"camera_angle_x": 2 * np.arctan(LENS.width / 2 / LENS.focal[0])}))
    assert [shot.lens.focal for shot in read_model(file).shots] == [pytest.approx((LENS.focal[0],) * 2)] * 3


def test_pictures_are_found_that_moved_with_their_file(tmp_path: Path) -> None:
    """Programs write where pictures lay on their own machine."""
    file = _told_at(tmp_path, "transforms.json", (128, 96)) / "transforms.json"
    for before in ("/home/me/", "..\\\\", "C:\\\\me\\\\"):
        other = tmp_path / "other.json"
        other.write_text(file.read_text().replace('"file_path": "', f'"file_path": "{before}'))
        assert read_model(other.rename(tmp_path / "transforms_o.json")).pictures[2].file.name == "2.png"
    file.write_text(file.read_text().replace("2.png", "../9.png"))
    with pytest.raises(SepiError, match=r"9\.png': expected a path within the folder"):
        read_model(file)


def test_poses_that_are_not_read_are_named(tmp_path: Path) -> None:
    """Not offered as a light field beside the pictures."""
    for n in range(4):
        (tmp_path / "images").mkdir(exist_ok=True)
        cv2.imwrite(str(tmp_path / f"images/{n}.png"), np.zeros((8, 8), np.uint8))
    np.save(tmp_path / "K.npy", np.eye(3))
    with pytest.raises(SepiError, match=r"give one of them, such as \S+/images"):
        sepi.read_light_field(tmp_path)
    np.save(tmp_path / "poses_bounds.npy", np.zeros((4, 17)))
    for path in (tmp_path, tmp_path / "poses_bounds.npy"):
        with pytest.raises(
            SepiError, match=r"poses_bounds\.npy has camera poses .* expected transforms\.json, a COLMAP"
        ):
            sepi.read_light_field(path)


def test_a_quaternion_is_the_matrix_of_the_same_turn() -> None:
    """Its real part comes first; taken for the last, every camera looks elsewhere."""
    np.testing.assert_allclose(rotation_of([0.70711, 0, 0, 0.70711]), [[0, -1, 0], [1, 0, 0], [0, 0, 1]], atol=1e-9)


def test_without_pycolmap_the_extra_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import sys

    monkeypatch.setitem(sys.modules, "pycolmap", None)
    for name in ("cameras", "images", "points3D"):
        (tmp_path / f"{name}.txt").write_text("")
    with pytest.raises(SepiError, match=r"sepi\[colmap\]"):
        sepi.read_cameras(tmp_path)


def test_the_workflow_knows_which_files_a_scene_is_of(tmp_path: Path) -> None:
    """A picture that changes, wherever it lies, must ask for new maps; a missing one is told at once."""
    table = _write(tmp_path / "pictures", _shots()[:2])
    moved = table.rename(tmp_path / "cameras.yaml")
    found = own_scene("rig", moved, ("--images", str(tmp_path / "pictures")), "config.light_fields.rig")
    assert found.files == (moved, *sorted((tmp_path / "pictures").iterdir()))
    assert (found.views, found.height, found.width) == (2, SIZE, SIZE)
    found.files[1].unlink()
    with pytest.raises(SepiError, match="no picture '00"):
        own_scene("rig", moved, ("--images", str(tmp_path / "pictures")), "config.light_fields.rig")


def test_maps_are_told_in_the_pictures_as_they_were_taken(folder: Path, tmp_path: Path) -> None:
    """Depth at the pixels that the user has: along each camera's own way of looking, its turn and distortion back in.

    Of the reference view, and of another one, which stands before the plane of the others.
    """
    light_field = sepi.read_cameras(folder, disparity_range=(-2, 2))
    camera, rig, reference = light_field.camera, light_field.rig, light_field.reference_position
    for position in (reference, (0, 0)):
        view, seen_by = rig.views[position], replace(light_field, view=position)
        plain = _rectified_shot(seen_by)
        centre = TURN.T @ (view.centre - AWAY)
        lens = replace(plain.lens, focal=(plain.lens.focal[0] * view.zoom,) * 2)
        rectified = render_shot("pyramids", replace(plain, lens=lens, centre=centre), camera=CAMERA, size=SIZE)
        ahead = (view.centre - rig.origin) @ rig.rotation[2]
        assert (position == reference) == (abs(ahead) < 1e-9)
        truth = (camera.scale / (rectified.depth + ahead) - camera.offset).astype(np.float32)
        named = None if position == reference else position
        write_as_taken(tmp_path, light_field, truth, named)
        disparity, depth = (read_pfm(tmp_path / name) for name in names_as_taken(named))
        taken = replace(view, rotation=view.rotation @ TURN, centre=centre)
        true = render_shot("pyramids", taken, camera=CAMERA, size=SIZE).depth
        shown = np.isfinite(depth)
        assert depth.shape == disparity.shape == true.shape
        assert 0.6 < shown.mean() < 1
        errors = np.abs(depth - true)[shown]
        assert np.median(errors) < 1e-4
        assert np.quantile(errors, 0.9) < 3e-3
        assert np.nanmax(disparity) <= truth.max() + 1e-6
        # between two surfaces there is nothing
        halves = np.where(np.arange(truth.shape[1]) < truth.shape[1] // 2, np.float32(-1), np.float32(1))
        halves = np.broadcast_to(halves, truth.shape)
        write_as_taken(tmp_path, light_field, halves, named, sigma=np.where(halves < 0, np.float32(0.5), 2))
        told, _, sigma = (read_pfm(tmp_path / name) for name in names_as_taken(named, with_sigma=True))
        assert set(np.unique(told[np.isfinite(told)]).tolist()) == {-1.0, 1.0}
        # nor an error of both: each pixel has that of the surface it shows
        np.testing.assert_array_equal(sigma, np.where(np.isnan(told), np.nan, np.where(told < 0, 0.5, 2)))
