"""Folders of pictures under any names: each view comes to the place that its name gives it, and names that leave room
for doubt are asked about. A view in a wrong place makes the depth nonsense without a word.
"""

import itertools
import os
import time
from collections.abc import Callable, Iterable
from pathlib import Path

import cv2
import imageio.v3 as imageio
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sepi.errors import SepiError
from sepi.io.readers.formats import format_of, read
from sepi.io.readers.options import ReadOptions
from sepi.io.readers.view_names import infer_view_numbers, parse_view_numbers
from sepi.lightfield import LightField


def pixels(place: int) -> np.ndarray:
    """RGB picture of the view at a place, (4, 5, 3)."""
    return np.random.default_rng(place).integers(0, 256, (4, 5, 3), np.uint8)


def put(folder: Path, names: Iterable[str], write: Callable[[Path, np.ndarray], object] = imageio.imwrite) -> Path:
    """A folder with a picture under each name, the picture's number being the name's place in the list."""
    folder.mkdir(exist_ok=True)
    for place, name in enumerate(names):
        write(folder / name, pixels(place))
    return folder


def by_place(form: str, rows: Iterable[int], columns: Iterable[int]) -> list[str]:
    return [form.format(row, column) for row, column in itertools.product(rows, columns)]


def by_number(form: str, numbers: Iterable[int]) -> list[str]:
    return [form.format(number) for number in numbers]


def places_of(light_field: LightField) -> list[list[int]]:
    """Which of the pictures stands at each place; -1 for a missing view."""
    T, S = light_field.grid
    known = {pixels(number).tobytes(): number for number in range(400)}
    return [
        [known[light_field.views[t, s].tobytes()] if light_field.present[t, s] else -1 for s in range(S)]
        for t in range(T)
    ]


def grid_of(rows: int, columns: int) -> list[list[int]]:
    return np.arange(rows * columns).reshape(rows, columns).tolist()


NAMED: dict[str, tuple[list[str], ReadOptions, list[list[int]], str]] = {
    "rows and columns": (by_place("view_{:02d}_{:02d}.png", range(3), range(3)), ReadOptions(), grid_of(3, 3), "order"),
    "17x17": (by_place("v{}x{}.png", range(17), range(17)), ReadOptions(), grid_of(17, 17), "order"),
    "even grid": (by_place("{}-{}.png", range(4), range(6)), ReadOptions(), grid_of(4, 6), "order"),
    "counted from 1": (by_place("2067_{:02d}_{:02d}.png", (1, 2, 3), (1, 2, 3, 4)), ReadOptions(), grid_of(3, 4), ""),
    "counted from 5": (by_place("{} {}.png", (5, 6, 7), (1, 2, 3)), ReadOptions(), grid_of(3, 3), "rows from 5"),
    "counted from the middle": (
        by_place("v_{}_{}.png", (-1, 0, 1), (-1, 0, 1)),
        ReadOptions(),
        grid_of(3, 3),
        "rows from -1",
    ),
    "hyphens": (by_place("v-{}-{}.png", (1, 2), (1, 2, 3)), ReadOptions(), grid_of(2, 3), ""),
    "hyphens after spaces": (by_place("v -{} -{}.png", (1, 2), (1, 2, 3)), ReadOptions(), grid_of(2, 3), ""),
    "gantry": (
        [
            f"out_{row:02d}_{column:02d}_{-381.909271 + row - column}_{1103.376221 * row - 1000.5}.png"
            for row, column in itertools.product(range(3), range(4))
        ],
        ReadOptions(),
        grid_of(3, 4),
        "order",
    ),
    "dots between": (by_place("{:02d}.{:02d}.png", range(3), range(2)), ReadOptions(), grid_of(3, 2), ""),
    "dots after a word": (by_place("v.{}.{}.png", range(3), range(2)), ReadOptions(), grid_of(3, 2), ""),
    "letters": (by_place("Größe é_{}ü{}.png", range(2), range(3)), ReadOptions(), grid_of(2, 3), ""),
    "spaces and braces": (by_place("a b {{{}}} [{}].png", range(2), range(3)), ReadOptions(), grid_of(2, 3), ""),
    "the same number twice": (
        [f"{t}_{s}_{t}.png" for t, s in itertools.product(range(2), range(3))],
        ReadOptions(),
        grid_of(2, 3),
        "",
    ),
    "steps": (by_place("{}_{}.png", (0, 2, 4), (0, 2, 4)), ReadOptions(), grid_of(3, 3), "steps of 2"),
    "steps and a gap": (
        by_place("{}_{}.png", (10, 20, 40), (5, 15)),
        ReadOptions(view=(0, 0)),
        [[0, 1], [2, 3], [-1, -1], [4, 5]],
        "steps of 10",
    ),
    # neighbouring rows are then two steps apart, as their numbers say
    "steps of rows alone": (
        by_place("{}_{}.png", (0, 2), (0, 1, 2)),
        ReadOptions(view=(0, 1)),
        [[0, 1, 2], [-1, -1, -1], [3, 4, 5]],
        "",
    ),
    "steps in a wide grid": (
        by_place("{}_{}.png", (0, 2), (0, 2)),
        ReadOptions(grid=(3, 3), view=(0, 0)),
        [[0, -1, 1], [-1, -1, -1], [2, -1, 3]],
        "",
    ),
    "steps in a tight grid": (
        by_place("{}_{}.png", (0, 2), (0, 2)),
        ReadOptions(grid=(2, 2)),
        [[0, 1], [2, 3]],
        "steps of 2",
    ),
    "missing views": (
        ["0_0.png", "0_2.png", "1_1.png", "2_2.png"],
        ReadOptions(),
        [[0, -1, 1], [-1, 2, -1], [-1, -1, 3]],
        "",
    ),
    "larger grid": (
        by_place("{}_{}.png", range(2), range(2)),
        ReadOptions(grid=(2, 3)),
        [[0, 1, -1], [2, 3, -1]],
        "",
    ),
    "running number": (by_number("img{}.png", range(9)), ReadOptions(), grid_of(3, 3), "3x3 grid row by row"),
    "running number from 1": (by_number("img{:03d}.png", range(1, 17)), ReadOptions(), grid_of(4, 4), "1 to 16"),
    "running number from 7": (by_number("img{:03d}.png", range(7, 16)), ReadOptions(), grid_of(3, 3), "views from 7"),
    "running number, not square": (
        by_number("{}.png", range(6)),
        ReadOptions(grid=(2, 3)),
        grid_of(2, 3),
        "row by row",
    ),
    "running number in steps": (by_number("{}.png", range(0, 90, 10)), ReadOptions(), grid_of(3, 3), "steps of 10"),
    "running number with gaps": (
        by_number("{}.png", (0, 2, 3)),
        ReadOptions(grid=(2, 2)),
        [[0, -1], [1, 2]],
        "",
    ),
    "first views missing": (by_number("{}.png", (2, 3)), ReadOptions(grid=(2, 2)), [[-1, -1], [0, 1]], "2 to 3"),
    "first views missing, from 1": (by_number("{}.png", (3, 4)), ReadOptions(grid=(2, 2)), [[-1, -1], [0, 1]], ""),
    "a scene's number": (by_number("scene_7_img_{:03d}.png", range(9)), ReadOptions(), grid_of(3, 3), "3x3"),
    "one row": (by_number("view_00_{:02d}.png", range(7)), ReadOptions(), grid_of(1, 7), "single row of 7"),
    "one column": (by_number("view_{:02d}_03.png", range(5)), ReadOptions(), grid_of(5, 1), "single column of 5"),
    "one row of 9, said so": (
        by_number("view_00_{:02d}.png", range(9)),
        ReadOptions(grid=(1, 9)),
        grid_of(1, 9),
        "",
    ),
    "two views": (["left_1.png", "left_2.png"], ReadOptions(grid=(1, 2)), [[0, 1]], ""),
    "pattern": (
        by_place("x{}_y{}_7.png", range(2), range(3)),
        ReadOptions(pattern="x{column}_y{row}_*.png"),
        [[0, 3], [1, 4], [2, 5]],
        "",
    ),
    "pattern of three numbers": (
        [f"{3 * t + s}-{t}-{s}.png" for t, s in itertools.product(range(2), range(3))],
        ReadOptions(pattern="*-{row}-{column}.png"),
        grid_of(2, 3),
        "",
    ),
    "pattern of a number": (
        by_number("v1.{}.png", range(4)),
        ReadOptions(pattern="v1.{number}.png"),
        grid_of(2, 2),
        "",
    ),
    "pattern with stars": (
        by_number("a12bcc{:03d}dd.png", range(4)),
        ReadOptions(pattern="a*c{number}*.png"),
        grid_of(2, 2),
        "",
    ),
    "pattern with signs of expressions": (
        by_place("v(+)[{}].^{}$.png", range(2), range(2)),
        ReadOptions(pattern="v(+)[{row}].^{column}$.png"),
        grid_of(2, 2),
        "",
    ),
    "transposed": (
        by_place("{}_{}.png", range(2), range(3)),
        ReadOptions(order="transpose"),
        [[0, 3], [1, 4], [2, 5]],
        "",
    ),
    "central": (
        by_place("{}_{}.png", range(4), range(5)),
        ReadOptions(central=3),
        [[6, 7, 8], [11, 12, 13], [16, 17, 18]],
        "",
    ),
    "excluded": (
        by_place("{}_{}.png", range(2), range(2)),
        ReadOptions(exclude=("0_0.png", "0,1")),
        [[-1, -1], [2, 3]],
        "",
    ),
    "view": (by_place("{}_{}.png", range(2), range(2)), ReadOptions(view=(0, 1)), grid_of(2, 2), ""),
}


@pytest.mark.parametrize("case", NAMED)
def test_views_stand_where_their_names_say(tmp_path: Path, case: str) -> None:
    names, options, expected, note = NAMED[case]
    folder = put(tmp_path / "my scene", names)
    assert format_of(folder).name == "folder of views"
    light_field = read(folder, options)
    assert places_of(light_field) == expected
    assert note in " ".join(light_field.notes)
    # what the user said is no assumption
    assert ("in that order" in " ".join(light_field.notes)) == (
        options.pattern is None
        and "numbered" not in light_field.notes[0]
        and "all have one" not in light_field.notes[0]
    )
    assert light_field.name == "my scene"
    assert light_field.source == str(folder)
    if options.view:
        assert light_field.reference_position == options.view


@pytest.mark.parametrize("ending", ["png", "PNG", "bmp", "tif", "tiff", "ppm", "pnm", "webp"])
def test_pictures_of_any_kind(tmp_path: Path, ending: str) -> None:
    def write(path: Path, values: np.ndarray) -> None:
        assert cv2.imwrite(str(path), values[:, :, ::-1], [cv2.IMWRITE_WEBP_QUALITY, 101])

    light_field = read(put(tmp_path / "f", by_place(f"{{}}_{{}}.{ending}", range(2), range(3)), write), ReadOptions())
    assert places_of(light_field) == grid_of(2, 3)


SORTS: dict[str, tuple[Callable[[np.ndarray], np.ndarray], type]] = {
    "grey": (lambda rgb: rgb[:, :, :1], np.uint8),
    "grey 16": (lambda rgb: rgb[:, :, :1].astype(np.uint16) * 200, np.uint16),
    "RGB 16": (lambda rgb: rgb.astype(np.uint16) * 200, np.uint16),
    "RGB float": (lambda rgb: (rgb / 255).astype(np.float32), np.float32),
    "grey float": (lambda rgb: (rgb[:, :, :1] / 255).astype(np.float32), np.float32),
}


@pytest.mark.parametrize("sort", SORTS)
def test_depth_of_pixels_is_kept(tmp_path: Path, sort: str) -> None:
    convert, kind = SORTS[sort]
    folder = put(
        tmp_path / "f",
        by_number("{}.tif", range(4)),
        lambda path, rgb: cv2.imwrite(str(path), convert(rgb)[:, :, ::-1]),
    )
    light_field = read(folder, ReadOptions())
    assert light_field.views.dtype == kind
    for number in range(4):
        np.testing.assert_array_equal(light_field.views[divmod(number, 2)], convert(pixels(number)))


def test_what_is_no_view_is_left_out_with_a_note(tmp_path: Path) -> None:
    folder = put(tmp_path / "f", by_place("view_{}_{}.png", range(2), range(2)))
    imageio.imwrite(folder / "thumb.png", pixels(9)[:2])
    imageio.imwrite(folder / "view_0_0_depth.png", pixels(9)[:2])
    (folder / "notes_1_1.txt").write_text("not a picture")
    (folder / "._view_0_0.png").write_bytes(b"what some systems leave behind")
    (folder / "view_5_5.png").mkdir()
    put(folder / "inner", ["view_7_7.png"])
    light_field = read(folder, ReadOptions())
    assert places_of(light_field) == grid_of(2, 2)
    assert "2 pictures whose names are unlike the views' were left out: thumb.png, view_0_0_depth.png" in (
        light_field.notes
    )
    with_pattern = read(folder, ReadOptions(pattern="view_{row}_{column}.png"))
    assert places_of(with_pattern) == grid_of(2, 2)
    assert with_pattern.notes[0] == light_field.notes[0]


def renamed(folder: Path, old: str, new: str) -> None:
    (folder / old).rename(folder / new)


PLACES = by_place("v_{}_{}.png", range(3), range(3))

BAD: dict[str, tuple[list[str], ReadOptions, str]] = {
    "two sorts of names": ([*PLACES, *by_place("w_{}_{}.png", range(3), range(3))], ReadOptions(), "v_0_0.png as like"),
    "every name another": (["a1b.png", "b1a.png", "c3.png"], ReadOptions(), "--pattern"),
    "no numbers": (["a.png", "b.png"], ReadOptions(), "no picture's name has a number"),
    "numbers all alike": (["a1.png", "a01.png"], ReadOptions(), "no number in the names counts the views"),
    "three numbers": (
        [f"{t}_{s}_{5 * s + 11 * t}x.png" for t, s in itertools.product(range(2), range(3))],
        ReadOptions(),
        "'*_{row}_{column}x.png'",
    ),
    "one picture": (["a1.png", "b.png"], ReadOptions(), "no number in the names counts"),
    "one picture by pattern": (["a1.png", "a.png"], ReadOptions(pattern="a{number}.png"), "only one view, a1.png"),
    "not square": (by_number("{}.png", range(8)), ReadOptions(), "give --grid ROWSxCOLUMNS"),
    "gaps": (by_number("{}.png", (0, 1, 2, 4)), ReadOptions(), "numbers are missing"),
    "one row or a square": (by_number("view_00_{:02d}.png", range(9)), ReadOptions(), "--grid 1x9 or --grid 3x3"),
    "one column or a square": (by_number("v_{}_0.png", range(4)), ReadOptions(), "--grid 4x1 or --grid 2x2"),
    "twice": ([*PLACES, "v_01_01.png"], ReadOptions(), "view 1, 1 is given twice, also as v_01_01.png"),
    "twice under two endings": (
        ["1.png", "2.png", "1.PNG"],
        ReadOptions(),
        "given twice",
    ),
    "twice by pattern": (["a1b.png", "a1c.png"], ReadOptions(pattern="a{number}*"), "given twice"),
    "huge row": ([*PLACES, "v_999999999_1.png"], ReadOptions(), "1000000000x3"),
    "huge numbers": (["v_0_0.png", f"v_{10**17}_{10**17}.png", "v_1_0.png"], ReadOptions(), "--pattern"),
    "huge running number": (["0.png", "1.png", "999999999999.png"], ReadOptions(), "numbers are missing"),
    "sparse": (["0_0.png", "1_1.png", "300_2.png"], ReadOptions(), "301x3"),
    "huge grid": (PLACES, ReadOptions(grid=(999_999, 999_999)), "at most 10000 views"),
    "small grid": (PLACES, ReadOptions(grid=(2, 3)), "the 2x3 grid that --grid gives"),
    "no grid": (PLACES, ReadOptions(grid=(0, 0)), "0x0"),
    "no grid, running": (by_number("{}.png", range(4)), ReadOptions(grid=(0, 3)), "0x3"),
    "small grid, running": (by_number("{}.png", range(1, 5)), ReadOptions(grid=(1, 3)), "4.png: beyond the 3 views"),
    "centre missing": (["0_0.png", "0_1.png", "0_2.png", "2_2.png"], ReadOptions(), "centre view"),
    "no such view": (PLACES, ReadOptions(view=(3, 3)), "outside the grid"),
    "axes": (PLACES, ReadOptions(axes="TSHWC"), "--axes does not apply"),
    "variable": (PLACES, ReadOptions(variable="LF"), "--variable does not apply"),
    "pattern of other names": (PLACES, ReadOptions(pattern="u_{row}_{column}.png"), "no file has a name like"),
    "pattern without fields": (PLACES, ReadOptions(pattern="v_*.png"), "{row} and {column} once each"),
    "pattern without column": (PLACES, ReadOptions(pattern="v_{row}_*.png"), "{row} and {column} once each"),
    "pattern with all fields": (PLACES, ReadOptions(pattern="{number}_{row}_{column}"), "{row} and {column} once each"),
    "pattern with a field twice": (PLACES, ReadOptions(pattern="{number}_{number}"), "{row} and {column} once each"),
    "pattern with other fields": (PLACES, ReadOptions(pattern="v_{t}_{s}.png"), "{row} and {column} once each"),
    "pattern with an open brace": (PLACES, ReadOptions(pattern="v_{row_{column}.png"), "{row} and {column} once each"),
    "pattern with fields together": (PLACES, ReadOptions(pattern="v{row}{column}.png"), "{row} and {column} once each"),
    "pattern of a path": (PLACES, ReadOptions(pattern="../v_{row}_{column}.png"), "{row} and {column} once each"),
    "pattern of a Windows path": (
        PLACES,
        ReadOptions(pattern="f\\v_{row}_{column}.png"),
        "{row} and {column} once each",
    ),
    "empty pattern": (PLACES, ReadOptions(pattern=""), "{row} and {column} once each"),
    "long pattern": (PLACES, ReadOptions(pattern="{number}" + "*" * 10**6), "{row} and {column} once each"),
}


@pytest.mark.parametrize("case", BAD)
def test_names_that_leave_doubt_are_one_line_that_says_what_to_give(tmp_path: Path, case: str) -> None:
    names, options, word = BAD[case]
    folder = put(tmp_path / "f", names)
    started = time.perf_counter()
    with pytest.raises(SepiError) as caught:
        read(folder, options, "images")
    assert time.perf_counter() - started < 2
    assert word in str(caught.value)
    assert str(folder) in str(caught.value)
    assert "\n" not in str(caught.value)


def outside(folder: Path) -> None:
    imageio.imwrite(folder.parent / "elsewhere.png", pixels(0))
    (folder / "v_0_0.png").unlink()
    (folder / "v_0_0.png").symlink_to(folder.parent / "elsewhere.png")


SPOILT: dict[str, tuple[Callable[[Path], object], str]] = {
    "empty file": (lambda f: (f / "v_1_2.png").write_bytes(b""), "v_1_2.png: not a PNG"),
    "text": (lambda f: (f / "v_1_2.png").write_text("hello"), "v_1_2.png: not a PNG"),
    "cut off": (lambda f: os.truncate(f / "v_1_2.png", 100), "v_1_2.png: not a PNG, or damaged"),
    "another size": (lambda f: imageio.imwrite(f / "v_1_2.png", pixels(5)[1:]), "v_1_2.png: 5x3"),
    "another depth": (
        lambda f: cv2.imwrite(str(f / "v_1_2.png"), pixels(5).astype(np.uint16)),
        "v_1_2.png: 5x4 RGB of 16 bit",
    ),
    "grey": (lambda f: imageio.imwrite(f / "v_1_2.png", pixels(5)[:, :, 0]), "v_1_2.png: 5x4 grey"),
    "link out": (outside, "v_0_0.png: a link out of the folder"),
    "link to nothing": (
        lambda f: ((f / "v_1_2.png").unlink(), (f / "v_1_2.png").symlink_to("gone.png")),
        "v_1_2.png: cannot be read: no plain file, or a link to nothing",
    ),
    "link to itself": (
        lambda f: ((f / "v_1_2.png").unlink(), (f / "v_1_2.png").symlink_to("v_1_2.png")),
        "v_1_2.png",
    ),
}


@pytest.mark.parametrize("case", SPOILT)
def test_bad_view_is_one_line_that_names_it(tmp_path: Path, case: str, capfd: pytest.CaptureFixture[str]) -> None:
    spoil, word = SPOILT[case]
    folder = put(tmp_path / "f", PLACES)
    spoil(folder)
    with pytest.raises(SepiError) as caught:
        read(folder, ReadOptions())
    assert word in str(caught.value)
    assert "\n" not in str(caught.value)
    assert capfd.readouterr() == ("", "")


def test_bad_view_can_be_excluded(tmp_path: Path) -> None:
    folder = put(tmp_path / "f", PLACES)
    (folder / "v_1_2.png").write_bytes(b"")
    light_field = read(folder, ReadOptions(exclude=("v_1_2.png",)))
    assert places_of(light_field) == [[0, 1, 2], [3, 4, -1], [6, 7, 8]]


def test_link_out_of_the_folder_is_followed_when_asked_for(tmp_path: Path) -> None:
    folder = put(tmp_path / "f", PLACES)
    outside(folder)
    assert places_of(read(folder, ReadOptions(follow_links=True))) == grid_of(3, 3)


def test_folders_that_are_no_light_field_are_not_taken_for_one(tmp_path: Path) -> None:
    """Else results of a run, or a folder of Lytro pictures, are read as views."""
    results = put(tmp_path / "depth", ["disparity.png", "confidence.png", "occluded.png"])
    lytro = put(tmp_path / "lytro", ["IMG_1_eslf.png", "IMG_2_eslf.png"])
    single = put(tmp_path / "single", ["IMG_1.png"])
    for folder in (results, lytro, single):
        with pytest.raises(SepiError, match=r"not a light field of a known format|a folder of light fields"):
            format_of(folder)
    with pytest.raises(SepiError, match="not a folder"):
        read(single / "IMG_1.png", ReadOptions(), "images")


def test_hci_folder_stays_one(tmp_path: Path) -> None:
    folder = put(tmp_path / "f", by_number("input_Cam{:03d}.png", range(9)))
    assert format_of(folder).name == "HCI folder"
    with pytest.raises(SepiError, match="--pattern does not apply"):
        read(folder, ReadOptions(pattern="input_Cam{number}.png"))
    by_names = read(folder, ReadOptions(pattern="input_Cam{number}.png"), "images")
    np.testing.assert_array_equal(by_names.views, read(folder, ReadOptions()).views)


TEXT = st.text(st.sampled_from("01290_-. ax{}*()[]\\/?+^$|é\n٣²") | st.characters(), max_size=24)


@given(st.lists(TEXT, max_size=8))
def test_any_names_give_numbers_or_an_error(names: list[str]) -> None:
    try:
        found = infer_view_numbers("folder", names)
    except SepiError:
        return
    assert set(found.numbers) | set(found.unmatched) == set(names)
    assert all(len(numbers) in (1, 2) for numbers in found.numbers.values())
    assert len({len(numbers) for numbers in found.numbers.values()}) == 1


@given(st.lists(TEXT, max_size=5), TEXT, st.sampled_from(["{number}", "{row}_{column}", "{column}*{row}", ""]), TEXT)
def test_any_pattern_is_one_or_an_error(names: list[str], before: str, fields: str, after: str) -> None:
    pattern = before + fields + after
    names = [*names, before + fields.format(number=7, row=3, column=-4) + after]
    try:
        found = parse_view_numbers("folder", names, pattern)
    except SepiError:
        return
    assert set(found.numbers) | set(found.unmatched) == set(names)


@given(st.integers(-(10**17), 10**17), st.integers(0, 10**17), TEXT.filter(lambda text: not set("{}*/\\-") & set(text)))
def test_pattern_finds_the_numbers_that_made_the_name(row: int, column: int, text: str) -> None:
    between = text.strip("0123456789-") or "_"
    names = [f"{row}{between}{column}.png", f"5{between}5.png"]
    found = parse_view_numbers("folder", names, f"{{row}}{between}{{column}}.png")
    assert found.numbers[names[0]] == (row, column)


@pytest.mark.parametrize("pattern", ["*" * 200 + "{number}x", "*a" * 100 + "{number}b", "*{row}*{column}*a*a*a*a*a*b"])
def test_no_pattern_takes_long(pattern: str) -> None:
    """A pattern of many stars may take for ever where each star may end anywhere."""
    started = time.perf_counter()
    names = ["a" * 255, "1" * 255, "a1" * 127, "-" * 255, "1a" * 127]
    with pytest.raises(SepiError, match="no file has a name like"):
        parse_view_numbers("folder", names, pattern)
    assert time.perf_counter() - started < 1


@pytest.mark.parametrize("name", ["1" * 255, "1." * 127, "-" * 255, "1_" * 127, "-1" * 127, "._" * 127])
def test_no_name_takes_long(name: str) -> None:
    started = time.perf_counter()
    with pytest.raises(SepiError):
        infer_view_numbers("folder", [name, name + "a"])
    assert time.perf_counter() - started < 1


def test_lytro_views_are_read(real_data: Path) -> None:
    """9x9 views numbered from 01, under a scene's number."""
    folder = real_data / "lytro" / "2067"
    light_field = read(folder, ReadOptions())
    assert light_field.grid == (9, 9)
    assert light_field.present.all()
    np.testing.assert_array_equal(light_field.views[2, 6], imageio.imread(folder / "2067_03_07.png")[:, :, :3])
