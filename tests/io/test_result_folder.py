"""The folder of final maps as other programs read it, and what happens to what lies there already."""

from dataclasses import replace
from pathlib import Path

import cv2
import h5py
import numpy as np
import pytest
from hdf5_edits import changed
from PIL import Image

from sepi.camera import Camera
from sepi.errors import SepiError, SepiWarning
from sepi.io.map_pictures import colour_code
from sepi.io.result_files import RESULT_FILES
from sepi.io.result_folder import read_result, write_result
from sepi.lightfield import DisparityRange, FloatMap, LightField
from sepi.scenes import render
from sepi.stage import StageMaps

SHAPE = (12, 16)
CAMERA = Camera(scale=36.0, offset=8.0, focal_px=1500.0)


@pytest.fixture
def light_field() -> LightField:
    views = np.random.default_rng(1).integers(0, 65536, (3, 5, *SHAPE, 3), np.uint16)
    return LightField(views=views, name="toy", camera=CAMERA)


@pytest.fixture
def maps() -> StageMaps:
    rng = np.random.default_rng(2)
    disparity = rng.uniform(-2, 3, SHAPE).astype(np.float32)
    disparity[0, :3] = np.nan, np.inf, -np.inf
    confidence = rng.random(SHAPE, np.float32)
    occluded = rng.random(SHAPE) > 0.7
    return StageMaps(disparity, confidence, {"occluded": occluded, "superpixels": np.arange(192).reshape(SHAPE)})


def with_bars(maps: StageMaps) -> StageMaps:
    """Maps with error bars, wider above than below, and a pixel that no view knows, outside its interval."""
    disparity, rng = maps.disparity, np.random.default_rng(3)
    sigma = rng.uniform(0.01, 0.5, SHAPE).astype(np.float32)
    low, high = disparity - sigma, disparity + 2 * sigma
    unknown = np.zeros(SHAPE, bool)
    unknown[3, 4] = True
    low[3, 4], high[3, 4], sigma[3, 4] = 40, 50, 3
    return maps.updated(disparity, maps.confidence, sigma=sigma, low=low, high=high, unknown=unknown)


def names_in(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def pixels_of(path: Path) -> np.ndarray:
    image = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
    return image


def test_every_format_holds_the_same_disparity(tmp_path: Path, light_field: LightField, maps: StageMaps) -> None:
    write_result(tmp_path, light_field, maps, {})
    array = np.load(tmp_path / "disparity.npy", allow_pickle=False)
    assert array.dtype == np.dtype("<f4")
    np.testing.assert_array_equal(array, maps.disparity)
    np.testing.assert_array_equal(pixels_of(tmp_path / "disparity.pfm"), maps.disparity)
    with h5py.File(tmp_path / "result.h5") as file:
        np.testing.assert_array_equal(file["disparity"], maps.disparity)


def test_16_bit_picture_gives_disparity_back(tmp_path: Path, light_field: LightField, maps: StageMaps) -> None:
    write_result(tmp_path, light_field, maps, {})
    values = pixels_of(tmp_path / "disparity_16bit.png")
    with Image.open(tmp_path / "disparity_16bit.png") as image:
        text = image.text
    assert values.dtype == np.uint16
    assert text["units"] == "pixels per view step"
    assert text["Description"] == "disparity = (value - 1) * scale + offset; value 0: not finite"
    finite = np.isfinite(maps.disparity)
    assert (values[~finite] == 0).all()
    scale, offset = float(text["scale"]), float(text["offset"])
    back = (values[finite] - 1.0) * scale + offset
    np.testing.assert_allclose(back, maps.disparity[finite], rtol=0, atol=scale / 2 * 1.0001)
    assert scale < 5 / 65000  # the whole of 16 bits is used
    assert values[finite].min() == 1
    assert values.max() == 65535


@pytest.mark.parametrize(("value", "level", "offset"), [(1.25, 1, 1.25), (np.nan, 0, 0.0)])
def test_16_bit_picture_of_one_value(
    tmp_path: Path, light_field: LightField, value: float, level: int, offset: float
) -> None:
    """A plane, or nothing found at all, must not divide by a range of zero."""
    flat = np.full(SHAPE, value, np.float32)
    write_result(tmp_path, light_field, StageMaps(flat, np.zeros(SHAPE, np.float32)), {})
    assert (pixels_of(tmp_path / "disparity_16bit.png") == level).all()
    with Image.open(tmp_path / "disparity_16bit.png") as image:
        assert (float(image.text["scale"]), float(image.text["offset"])) == (1, offset)


def test_pictures_of_masks_and_confidence(tmp_path: Path, light_field: LightField, maps: StageMaps) -> None:
    maps.confidence[3, 4] = np.nan
    write_result(tmp_path, light_field, maps, {})
    np.testing.assert_array_equal(pixels_of(tmp_path / "mask_occluded.png"), 255 * maps.extra["occluded"])
    grey = pixels_of(tmp_path / "confidence.png")
    np.testing.assert_allclose(grey / 255, np.nan_to_num(maps.confidence), rtol=0, atol=0.5 / 255 + 1e-6)


def test_depth_in_metres(tmp_path: Path, light_field: LightField, maps: StageMaps) -> None:
    """Metres by the formula of docs/depth/metric_depth.md; nothing claims metres where the camera is unknown."""
    disparity = maps.disparity.copy()
    disparity[1, :2] = -8, -9  # at and beyond infinity
    write_result(tmp_path / "known", light_field, replace(maps, disparity=disparity), {})
    depth = pixels_of(tmp_path / "known/depth.pfm")
    near = np.isfinite(disparity) & (disparity > -8)
    np.testing.assert_allclose(depth[near], 36 / (disparity[near].astype(float) + 8), rtol=1e-6)
    assert not np.isfinite(depth[1, :2]).any()
    with h5py.File(tmp_path / "known/result.h5") as file:
        np.testing.assert_array_equal(file["depth"], depth)
        assert file.attrs["camera"].tolist() == [36, 8, 1500]
    write_result(tmp_path / "unknown", replace(light_field, camera=None), maps, {})
    assert "depth.pfm" not in names_in(tmp_path / "unknown")
    with h5py.File(tmp_path / "unknown/result.h5") as file:
        assert "depth" not in file
        assert "camera" not in file.attrs


@pytest.mark.parametrize("view", [None, (0, 4)])
def test_result_holds_its_view(
    tmp_path: Path, light_field: LightField, maps: StageMaps, view: tuple[int, int] | None
) -> None:
    shown = replace(light_field, view=view)
    write_result(tmp_path, shown, maps, {"scene": "toy", "variant": "paper"})
    place = view or (1, 2)
    with h5py.File(tmp_path / "result.h5") as file:
        assert file["view"].dtype == np.uint16
        np.testing.assert_array_equal(file["view"], light_field.views[place])
        assert tuple(file.attrs["view_position"]) == place
        assert tuple(file.attrs["grid"]) == (3, 5)
        assert file.attrs["variant"] == "paper"
        np.testing.assert_array_equal(file["occluded"], maps.extra["occluded"])
        np.testing.assert_array_equal(file["superpixels"], maps.extra["superpixels"])
    for path in (tmp_path, tmp_path / "result.h5"):
        back = read_result(path)
        assert back.scene == "toy"
        assert back.camera == CAMERA
        assert back.from_centre == (place[0] - 1, place[1] - 2)
        np.testing.assert_array_equal(back.picture, light_field.views[place])
        np.testing.assert_array_equal(back.confidence, maps.confidence)


def test_result_says_where_the_views_stood(tmp_path: Path, light_field: LightField, maps: StageMaps) -> None:
    """Clouds of other views are moved by this; a reader of the disparity must know what its view step is."""
    closer = replace(light_field, view=(0, 4), row_spacing=0.5, disparity_range=DisparityRange(-2, 3, "given"))
    write_result(tmp_path / "closer", closer, maps)
    positions = np.moveaxis(np.indices((3, 5)), 0, 2) * 0.9
    moved = replace(closer, row_spacing=1.0, positions=positions)
    write_result(tmp_path / "moved", moved, maps)
    for name, expected in (("closer", (0.5, "grid", -0.5, 2)), ("moved", (1, "given", -0.9, 1.8))):
        with h5py.File(tmp_path / name / "result.h5") as file:
            spacing, kind, place = (file.attrs[key] for key in ("row_spacing", "positions", "from_centre"))
        assert (spacing, kind, *place) == pytest.approx(expected)
        assert read_result(tmp_path / name).from_centre == pytest.approx(expected[2:])


def test_error_bars_in_view_steps_and_metres(tmp_path: Path, light_field: LightField, maps: StageMaps) -> None:
    """Who weighs depth by its error, or plans by the nearest that a thing may be, takes these numbers as they are."""
    disparity = maps.disparity.copy()
    # at infinity, and so near it that the farther bound is beyond
    disparity[1, :2] = -8, -7.995
    barred = with_bars(replace(maps, disparity=disparity))
    named = write_result(tmp_path, light_field, barred)
    assert {"sigma.pfm", "sigma.png", "interval.npz", "depth_sigma.pfm"} < set(named)
    assert sorted(named) == names_in(tmp_path)
    told = np.isfinite(disparity)
    before = disparity.astype(float) > -8
    np.testing.assert_array_equal(pixels_of(tmp_path / "sigma.pfm"), barred.sigma)
    sigma = pixels_of(tmp_path / "depth_sigma.pfm")
    # of a small change of the disparity, the change of the depth
    change = 36 / (disparity.astype(float) + 8 - 5e-4) - 36 / (disparity.astype(float) + 8 + 5e-4)
    near = told & (disparity > -4)
    np.testing.assert_allclose(sigma[near], (np.abs(change) / 1e-3 * barred.sigma)[near], rtol=1e-5)
    assert np.isinf(sigma[told & ~before]).all()
    with np.load(tmp_path / "interval.npz") as interval:
        bounds = {name: interval[name] for name in interval}
    assert {values.dtype for values in bounds.values()} == {np.dtype("<f4")}
    np.testing.assert_array_equal(bounds["low"], barred.low)
    np.testing.assert_array_equal(bounds["high"], barred.high)
    known = near & ~barred.mask("unknown")
    depth = pixels_of(tmp_path / "depth.pfm")
    assert (bounds["nearest"] < depth)[known].all()
    assert (depth < bounds["farthest"])[known].all()
    np.testing.assert_allclose(bounds["nearest"][near], 36 / (barred.high[near].astype(float) + 8), rtol=1e-6)
    assert np.isinf(bounds["farthest"][1, :2]).all()
    assert np.isfinite(bounds["nearest"][1, :2]).all()
    with h5py.File(tmp_path / "result.h5") as file:
        for name, values in {**bounds, "sigma": barred.sigma, "depth_sigma": sigma}.items():
            np.testing.assert_array_equal(file[name], values)
            steps = name in ("sigma", "low", "high")
            assert file[name].attrs["units"] == ("pixels per view step" if steps else "metres")
    back = read_result(tmp_path)
    for name in ("sigma", "low", "high"):
        np.testing.assert_array_equal(getattr(back, name), barred.extra[name])


def test_files_of_an_earlier_run_do_not_outlive_it(tmp_path: Path, light_field: LightField, maps: StageMaps) -> None:
    """A mask of a stage that is now switched off, depth of a camera no longer given, a time, error bars of another
    variant or maps of all views would be taken for this run's; a user's own file stays.
    """
    write_result(tmp_path, light_field, with_bars(maps), seconds=1.5, beside=("all_views.h5",))
    assert (tmp_path / "runtime.txt").read_text() == "1.500\n"
    for name in ("all_views.h5", "notes.txt"):
        (tmp_path / name).write_bytes(b"mine")
    again = write_result(tmp_path, replace(light_field, camera=None), replace(maps, extra={}))
    assert sorted(again) == sorted(RESULT_FILES)
    assert names_in(tmp_path) == sorted([*RESULT_FILES, "notes.txt"])
    assert (tmp_path / "notes.txt").read_bytes() == b"mine"


@pytest.mark.parametrize("earlier", [False, True])
@pytest.mark.parametrize("name", ["depth.pfm", "runtime.txt", "all_views.h5", "confidence.png", "mask_mine.png"])
def test_files_of_others_stay(
    tmp_path: Path, light_field: LightField, maps: StageMaps, name: str, earlier: bool
) -> None:
    """Ground truth, or another program's map, was gone without a word; also where an earlier result claims others."""
    bare, no_masks = replace(light_field, camera=None), replace(maps, extra={})
    if earlier:
        write_result(tmp_path, bare, no_masks, {"files": "../out/notes.txt"})
    (tmp_path / name).write_text("mine")
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    if not (earlier and name in RESULT_FILES):
        with pytest.raises(SepiError, match=rf"no earlier result wrote \({name}\); .*--force"):
            write_result(tmp_path, bare, no_masks)
        assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == before
    # what is not made this time stays also by force
    written = write_result(tmp_path, bare, no_masks, force=True)
    assert ((tmp_path / name).read_bytes() == b"mine") == (name not in written)


def test_listed_files_lead_out_of_no_folder(tmp_path: Path, light_field: LightField, maps: StageMaps) -> None:
    """A result may come from anyone."""
    (tmp_path / "precious").write_text("mine")
    listed = " ".join((*RESULT_FILES, "depth.pfm", "mask_occluded.png"))
    write_result(tmp_path / "out", light_field, maps)
    (tmp_path / "out" / "notes.txt").write_text("mine")
    with changed(tmp_path / "out" / "result.h5") as file:
        file.attrs["files"] = f"{listed} ../precious notes.txt"
    write_result(tmp_path / "out", light_field, maps)
    assert (tmp_path / "precious").exists()
    assert (tmp_path / "out" / "notes.txt").exists()


def test_results_of_others_are_not_overwritten(tmp_path: Path, light_field: LightField, maps: StageMaps) -> None:
    """Two folders 'views' both write to 'views-depth'; one read otherwise, or changed since, is the same."""
    one, other = (replace(light_field, source=f"{folder}/views", name="views") for folder in "ab")
    other = replace(other, views=light_field.views // 2)
    write_result(tmp_path, one, maps)
    with pytest.raises(SepiError, match=r"holds the result of another light field \(a/views\); .*force=True"):
        write_result(tmp_path, other, maps)
    assert read_result(tmp_path).picture.max() == one.views[1, 2].max()
    for same in (
        replace(one, source="elsewhere"),
        replace(one, source="elsewhere", view=(0, 0)),
        replace(one, views=other.views),
    ):
        write_result(tmp_path, one, maps, force=True)
        write_result(tmp_path, same, maps)
    write_result(tmp_path, other, maps, force=True)
    (tmp_path / "result.h5").write_bytes(b"nothing")
    write_result(tmp_path, other, maps, force=True)


def with_other_bars(maps: StageMaps, **bars: np.ndarray) -> StageMaps:
    barred = with_bars(maps)
    return barred.updated(barred.disparity, barred.confidence, **bars)


BAD_MAPS = {
    "confidence of 0..255": (lambda maps: replace(maps, confidence=200 * maps.confidence), "within 0..1"),
    "confidence of another shape": (lambda maps: replace(maps, confidence=maps.confidence[:5]), "confidence of"),
    "mask of another shape": (lambda maps: replace(maps, extra={"odd": np.ones((3, 3), bool)}), "odd of"),
    "mask that leaves the folder": (
        lambda maps: replace(maps, extra={"/../up": np.ones(SHAPE, bool)}),
        "expected a name",
    ),
    "sigma without bounds": (lambda maps: replace(maps, extra={"sigma": np.ones(SHAPE, np.float32)}), "sigma"),
    "endless sigma": (lambda maps: with_other_bars(maps, sigma=with_bars(maps).sigma * np.inf), "sigma must be finite"),
    "bounds the wrong way round": (
        lambda maps: with_other_bars(maps, low=with_bars(maps).high, high=with_bars(maps).low),
        "low must be no more than high",
    ),
    "disparity beyond": (
        lambda maps: with_other_bars(maps, high=with_bars(maps).high - np.float32(2.5) * with_bars(maps).sigma),
        "must enclose the disparity",
    ),
}


def test_bounds_may_be_rounded(tmp_path: Path, light_field: LightField, maps: StageMaps) -> None:
    """Maps that were counted in other view steps come back to the last digit but one."""
    disparity = maps.disparity
    below = np.nextafter(disparity, np.float32(-np.inf))
    bars = {"sigma": np.ones(SHAPE), "low": disparity - 1, "high": below}
    write_result(tmp_path / "out", light_field, replace(maps, extra=bars))
    assert read_result(tmp_path / "out").sigma.dtype == np.float32


@pytest.mark.parametrize("case", BAD_MAPS)
def test_bad_maps_are_refused(tmp_path: Path, light_field: LightField, maps: StageMaps, case: str) -> None:
    spoil, word = BAD_MAPS[case]
    with pytest.raises(SepiError, match="toy: ") as raised:
        write_result(tmp_path / "out", light_field, spoil(maps), {})
    assert word in str(raised.value)
    assert names_in(tmp_path) == []


def _replaced(name: str, values: np.ndarray | None) -> object:
    def spoil(file: h5py.File) -> None:
        del file[name]
        if values is not None:
            file[name] = values

    return spoil


def _huge(file: h5py.File) -> None:
    """A view of 4 TB that was never written."""
    del file["view"]
    file.create_dataset("view", (2**20, 2**20, 3), np.uint8, chunks=(256, 256, 3), compression="gzip")


BAD_RESULTS = {
    "no view": (_replaced("view", None), "not a result of 'sepi depth'"),
    "no confidence": (_replaced("confidence", None), "no confidence"),
    "stage file": (lambda file: file.attrs.pop("view_position"), "view_position"),
    "camera of nonsense": (lambda file: file.attrs.__setitem__("camera", (0.0, 1.0, -2.0)), "camera"),
    "view of another size": (_replaced("view", np.zeros((4, 4, 3), np.uint8)), "do not fit"),
    "more than the file holds": (_huge, "cannot lie in"),
}


@pytest.mark.parametrize("case", BAD_RESULTS)
def test_a_bad_result_is_named(tmp_path: Path, light_field: LightField, maps: StageMaps, case: str) -> None:
    spoil, word = BAD_RESULTS[case]
    write_result(tmp_path, light_field, maps, {})
    with changed(tmp_path / "result.h5") as file:
        spoil(file)
    with pytest.raises(SepiError, match=r"result\.h5") as raised:
        read_result(tmp_path)
    assert word in str(raised.value)


def test_no_result_at_all(tmp_path: Path) -> None:
    (tmp_path / "text.h5").write_text("no")
    for path, name in [(tmp_path, "result.h5"), (tmp_path / "gone", "gone"), (tmp_path / "text.h5", "text.h5")]:
        with pytest.raises(SepiError, match=name):
            read_result(path)


def test_colours_show_finite_values_whatever_else_is_there() -> None:
    """One infinite pixel must not flatten the picture; a missing one must be seen as missing."""
    values = np.linspace(-1, 1, 400, dtype=np.float32).reshape(20, 20)
    clean = colour_code(values)
    values[0, 0], values[5, 5], values[9, 9] = np.nan, np.inf, -np.inf
    spoilt = colour_code(values)
    assert (spoilt[[0, 5, 9], [0, 5, 9]] == 0).all()
    finite = np.isfinite(values)
    assert np.abs(spoilt[finite].astype(int) - clean[finite]).max() <= 6
    assert len(np.unique(clean.reshape(-1, 3), axis=0)) > 200


def test_unknown_pixels_are_grey_and_take_no_part_of_the_scale() -> None:
    """A guess over a black background must neither look like depth nor use up the colours of what is known."""
    values = np.linspace(-1, 1, 400, dtype=np.float32).reshape(20, 20)
    unknown = np.zeros(values.shape, bool)
    unknown[15:] = True
    values[16:] = 50
    values[19, 19] = np.nan
    picture = colour_code(values, unknown)
    assert (picture[15:][np.isfinite(values[15:])] == 128).all()
    assert (picture[19, 19] == 0).all()
    assert not (picture[:15] == picture[:15, :, :1]).all(axis=2).any()
    np.testing.assert_array_equal(picture[:15], colour_code(values[:15]))


def test_unknown_pixels_are_in_the_folder(tmp_path: Path, light_field: LightField, maps: StageMaps) -> None:
    """As a mask, without points, and read back; the disparity stays a number in every format."""
    unknown = np.zeros(SHAPE, bool)
    unknown[4:9, 5:] = True
    known = replace(light_field, camera=None)
    named = write_result(tmp_path, known, maps.updated(maps.disparity, maps.confidence, unknown=unknown))
    assert "mask_unknown.png" in named
    np.testing.assert_array_equal(pixels_of(tmp_path / "mask_unknown.png") > 0, unknown)
    assert (pixels_of(tmp_path / "disparity.png")[unknown] == 128).all()
    assert (pixels_of(tmp_path / "disparity_16bit.png")[unknown] > 0).all()
    np.testing.assert_array_equal(np.load(tmp_path / "disparity.npy"), maps.disparity)
    np.testing.assert_array_equal(read_result(tmp_path).unknown, unknown)
    points = np.isfinite(maps.disparity) & ~unknown
    assert f"element vertex {points.sum()}\n".encode() in (tmp_path / "points.ply").read_bytes()


def test_what_noise_puts_beyond_infinity_is_no_fault_of_the_camera(tmp_path: Path) -> None:
    """A sky that scatters about infinity says nothing; one that lies well beyond it says that the camera is wrong."""
    light_field = replace(render("dots", size=64, views=3), camera=Camera(8.0, 0.0, 100.0))
    rng = np.random.default_rng(0)
    sky = rng.normal(0, 0.1, (64, 64)).astype(np.float32)
    sigma = np.full(sky.shape, 0.1, np.float32)

    def maps(disparity: FloatMap) -> StageMaps:
        bars = {"sigma": sigma, "low": disparity - 3 * sigma, "high": disparity + 3 * sigma}
        return StageMaps(disparity, np.ones_like(disparity), bars)

    write_result(tmp_path / "sky", light_field, maps(sky))
    with pytest.warns(SepiWarning, match="98 % of the pixels lie beyond infinity.* 0 "):
        write_result(tmp_path / "off", light_field, maps(sky - np.float32(0.5)))


def test_an_interrupt_leaves_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Half of the maps beside those of an earlier run would be of no light field."""

    def stop(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    light_field = render("dots", size=64, views=3)
    maps = StageMaps(light_field.ground_truth, np.ones(light_field.shape, np.float32))
    monkeypatch.setattr("sepi.io.result_folder.write_pfm", stop)
    with pytest.raises(KeyboardInterrupt):
        write_result(tmp_path / "out", light_field, maps)
    assert names_in(tmp_path) == []
