"""Folders of pictures under any names: each view comes to the place that its name gives it, and names that leave room
for doubt are asked about. A view in a wrong place makes the depth nonsense without a word.
"""

import itertools
import time
import warnings
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any, NamedTuple

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
from sepi.reading import read_light_field
from sepi.scenes import render
from sepi.workflow.datasets import own_scene


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


class Case(NamedTuple):
    """Names, what is expected of them (places or a word), a word of the notes, and options."""

    names: list[str]
    expected: Any
    note: str
    options: ReadOptions


def case(names: list[str], expected: Any, note: str = "", **options: Any) -> Case:
    return Case(names, expected, note, ReadOptions(**options))


NAMED: dict[str, Case] = {
    "rows and columns": case(by_place("view_{:02d}_{:02d}.png", range(3), range(3)), grid_of(3, 3), "order"),
    "counted from 5": case(by_place("{} {}.png", (5, 6, 7), (1, 2, 3)), grid_of(3, 3), "rows from 5"),
    "gantry": case(
        [
            f"out_{row:02d}_{column:02d}_{-381.909271 + row - column}_{1103.376221 * row - 1000.5}.png"
            for row, column in itertools.product(range(3), range(4))
        ],
        grid_of(3, 4),
        "order",
    ),
    "steps": case(by_place("{}_{}.png", (0, 2, 4), (0, 2, 4)), grid_of(3, 3), "steps of 2"),
    "steps and a gap": case(
        by_place("{}_{}.png", (10, 20, 40), (5, 15)), [[0, 1], [2, 3], [-1, -1], [4, 5]], "steps of 10", view=(0, 0)
    ),
    # neighbouring rows are then two steps apart, as their numbers say
    "steps of rows alone": case(
        by_place("{}_{}.png", (0, 2), (0, 1, 2)), [[0, 1, 2], [-1, -1, -1], [3, 4, 5]], view=(0, 1)
    ),
    "missing views": case(["0_0.png", "0_2.png", "1_1.png", "2_2.png"], [[0, -1, 1], [-1, 2, -1], [-1, -1, 3]]),
    "running number": case(by_number("img{}.png", range(9)), grid_of(3, 3), "row by row", grid=(3, 3)),
    # --- no grid: the views say which
    "sequence": case(by_number("img{}.png", range(7)), grid_of(1, 7), "numbered 0 to 6"),
    "sequence with gaps": case(
        by_number("img_{:03d}.png", (1, 2, 4, 5, 6, 9)),
        [[0, 1, -1, 2, 3, 4, -1, -1, 5]],
        "numbered 1 to 9, 3 of them missing",
    ),
    # the grid is not known, so a position in it means nothing yet
    "times": case(by_number("IMG_20150106_{}.png", (102134, 102138, 102143, 102148)), grid_of(1, 4), "count no views"),
    "running number and time": case(
        [f"{number}_{time}.png" for number, time in enumerate((34, 38, 61, 79), 1)],
        grid_of(2, 2),
        "as in '{number}_*.png'",
        grid=(2, 2),
    ),
    # --- signs
    # a minus before each row's number is a sign where columns have signs
    "signs of one kind in the rows": case(
        by_place("v_{:+d}_{:+d}.png", (-1, -2, -3), (-1, 0, 1)), [[6, 7, 8], [3, 4, 5], [0, 1, 2]], "rows from -3"
    ),
    "a time for each view": case(
        [f"r{t}_c{s}_time{100 + 7 * t + s}.png" for t, s in itertools.product(range(3), range(2))],
        grid_of(3, 2),
        "as in 'r{row}_c{column}_time*.png'",
    ),
    # --- more numbers than two
    "running number, row, column": case(
        [f"IMG_{3 * t + s:04d}_{t:02d}_{s:02d}.png" for t, s in itertools.product(range(3), range(3))],
        grid_of(3, 3),
        "as in 'IMG_*_{row}_{column}.png'",
    ),
    "pattern": case(
        by_place("x{}_y{}_7.png", range(2), range(3)), [[0, 3], [1, 4], [2, 5]], pattern="x{column}_y{row}_*.png"
    ),
    "pattern of a number": case(
        by_number("v1.{}.png", range(4)), grid_of(2, 2), pattern="v1.{number}.png", grid=(2, 2)
    ),
    "transposed": case(by_place("{}_{}.png", range(2), range(3)), [[0, 3], [1, 4], [2, 5]], order="transpose"),
    "central": case(by_place("{}_{}.png", range(4), range(5)), [[6, 7, 8], [11, 12, 13], [16, 17, 18]], central=3),
    "excluded": case(by_place("{}_{}.png", range(2), range(2)), [[-1, -1], [2, 3]], exclude=("0_0.png", "0,1")),
}


@pytest.mark.parametrize("case", NAMED)
def test_views_stand_where_their_names_say(tmp_path: Path, case: str) -> None:
    names, expected, note, options = NAMED[case]
    folder = put(tmp_path / "my scene", names)
    assert format_of(folder).name == "folder of views"
    light_field = read(folder, options)
    assert places_of(light_field) == expected
    assert note in " ".join(light_field.notes)
    assert light_field.name == "my scene"
    assert light_field.source == str(folder)
    if options.view and light_field.arranged:
        assert light_field.reference_position == options.view


@pytest.mark.parametrize(
    "form", ["cam_x{s}_y{t}.png", "c{s}r{t}.png", "ViewX{s}Y{t}.png", "Col_{s}-Row_{t}.png", "row{t}_column{s}.png"]
)
def test_names_say_which_number_is_the_column(tmp_path: Path, form: str) -> None:
    """The column taken for the row transposes the grid: depth is nonsense."""
    folder = put(tmp_path / "scene", [form.format(t=t, s=s) for t, s in itertools.product(range(2), range(3))])
    light_field = read(folder, ReadOptions())
    assert places_of(light_field) == grid_of(2, 3)
    pattern = form.format(t="{row}", s="{column}")
    assert light_field.notes == (f"the names say row and column, as in '{pattern}'",)
    assert places_of(read(folder, ReadOptions(pattern=pattern))) == grid_of(2, 3)


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
    assert "2 images whose names are unlike the views' were left out: thumb.png, view_0_0_depth.png" in (
        light_field.notes
    )
    with_pattern = read(folder, ReadOptions(pattern="view_{row}_{column}.png"))
    assert places_of(with_pattern) == grid_of(2, 2)
    assert with_pattern.notes[0] == light_field.notes[0]


PLACES = by_place("v_{}_{}.png", range(3), range(3))

BAD: dict[str, Case] = {
    "no numbers": case(["a.png", "b.png"], "expected names such as 'view_{row}_{column}.png'"),
    "several light fields": case(
        [f"f{f}_{t}_{s}.png" for f, t, s in itertools.product(range(2), range(3), range(3))],
        "such as 'f0_{row}_{column}.png'",
    ),
    "cameras and exposures": case(by_place("cam{:02d}_exp{}.png", range(9), range(3)), "after 'exp' count no"),
    "times of cameras": case(by_place("t{}_c{}.png", range(3), range(9)), "after 't' count no views"),
    "two running numbers": case(["1_3.png", "2_1.png", "3_2.png"], "--pattern, such as '{number}_*.png'"),
    "rows and columns of --grid exchanged": case(PLACES[:6], "--grid has 3x2", grid=(3, 2)),
    "about as many of two sorts": case([*PLACES, *by_place("w_{}_{}.png", range(2), range(3))], "(9 and 6)"),
    "positions alone": case(by_place("cam_{}_{}.png", (0.0, 0.5, 1.0), (-1.5, 0.0)), "give --grid, or --pattern"),
    "twice": case([*PLACES, "v_01_01.png"], "view 1, 1 is given twice, also as v_01_01.png"),
    "huge row": case([*PLACES, "v_999999999_1.png"], "1000000000x3"),
    "centre missing": case(["0_0.png", "0_1.png", "0_2.png", "2_2.png"], "centre view"),
    "pattern of other names": case(PLACES, "no file has a name like", pattern="u_{row}_{column}.png"),
    "pattern without column": case(PLACES, "{row} and {column} once each", pattern="v_{row}_*.png"),
    "long pattern": case(PLACES, "{row} and {column} once each", pattern="{number}" + "*" * 10**6),
}


@pytest.mark.parametrize("case", BAD)
def test_names_that_leave_doubt_are_one_line_that_says_what_to_give(tmp_path: Path, case: str) -> None:
    names, word, _, options = BAD[case]
    folder = put(tmp_path / "f", names)
    started = time.process_time()
    with pytest.raises(SepiError) as caught:
        read(folder, options, "images")
    assert time.process_time() - started < 2
    assert word in str(caught.value)
    assert str(folder) in str(caught.value)
    assert "\n" not in str(caught.value)


def outside(folder: Path) -> None:
    imageio.imwrite(folder.parent / "elsewhere.png", pixels(0))
    (folder / "v_0_0.png").unlink()
    (folder / "v_0_0.png").symlink_to(folder.parent / "elsewhere.png")


SPOILT: dict[str, tuple[Callable[[Path], object], str]] = {
    "empty file": (lambda f: (f / "v_1_2.png").write_bytes(b""), "v_1_2.png: not a PNG"),
    "another size": (lambda f: imageio.imwrite(f / "v_1_2.png", pixels(5)[1:]), "v_1_2.png: 5x3"),
    "link out": (outside, "v_0_0.png: a link out of the folder"),
    "link to nothing": (
        lambda f: ((f / "v_1_2.png").unlink(), (f / "v_1_2.png").symlink_to("gone.png")),
        "v_1_2.png: cannot be read: ",
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


@pytest.mark.parametrize("name", ["v_7.png", "v_10.png", "notes.txt"])
def test_any_file_can_be_excluded(tmp_path: Path, name: str) -> None:
    """Nobody should have to know which pictures would have been left out anyhow."""
    folder = put(tmp_path / "f", by_number("v_{}.png", range(9)))
    (folder / name).write_bytes(b"damaged")
    places = [[-1 if name == f"v_{number}.png" else number for number in range(9)]]
    assert places_of(read(folder, ReadOptions(exclude=(name,)))) == places
    with pytest.raises(SepiError, match=r"--exclude gone\.png: "):
        read(folder, ReadOptions(exclude=(name, "gone.png")))


def test_views_of_a_sequence_can_be_excluded_by_name_and_by_place(tmp_path: Path) -> None:
    """The name counts before the grid is found, the place in it after."""
    views = render("curved_occluders", size=64, views=3).views
    folder = tmp_path / "f"
    folder.mkdir()
    for number in range(9):
        imageio.imwrite(folder / f"{number}.png", views[divmod(number, 3)])
    options = ReadOptions(exclude=("0.png", "2,2"))
    with warnings.catch_warnings(action="ignore"):
        light_field = read_light_field(folder, options=options)
    assert light_field.arranged
    assert np.argwhere(~light_field.present).tolist() == [[0, 0], [2, 2]]
    np.testing.assert_array_equal(light_field.views[light_field.present], views.reshape(9, 64, 64, 3)[1:8])


def test_an_edge_that_is_excluded_by_name_is_part_of_the_grid_still(tmp_path: Path) -> None:
    """Else the centre view, whose depth is made, would be another one."""
    folder = put(tmp_path / "f", PLACES)
    light_field = read(folder, ReadOptions(exclude=("v_0_0.png", "v_0_1.png", "v_0_2.png")))
    assert places_of(light_field) == [[-1, -1, -1], [3, 4, 5], [6, 7, 8]]


@pytest.mark.parametrize(
    "case", ["several light fields", "two running numbers", "cameras and exposures", "times of cameras"]
)
def test_the_pattern_that_an_error_suggests_can_be_followed(tmp_path: Path, case: str) -> None:
    names = BAD[case].names
    folder = put(tmp_path / "f", names)
    with pytest.raises(SepiError) as caught:
        read(folder, ReadOptions())
    pattern = str(caught.value).split("'")[-2]
    assert read(folder, ReadOptions(pattern=pattern)).present.all()


GANTRY = {
    (t, s): f"out_{t:02d}_{s:02d}_{-381.5 - 9.5 * t + 0.1 * s:.4f}_{468.0 + 10 * s + ((t, s) == (1, 2)) / 2:.4f}.png"
    for t, s in itertools.product(range(3), range(4))
}


def test_camera_positions_in_names_are_those_of_the_views(tmp_path: Path) -> None:
    """Cameras of a gantry stand up to a fifth of a step off their places: pixels, where views are far apart."""
    light_field = read(put(tmp_path / "f", GANTRY.values()), ReadOptions())
    assert light_field.row_spacing == pytest.approx(0.95, abs=0.02)
    steps = light_field.positions - light_field.positions[0, 0]
    np.testing.assert_allclose(steps[2, 0], [1.9, 0], atol=0.02)
    np.testing.assert_allclose(steps[1, 2] - steps[1, 1], [-0.01, 1.05], atol=0.02)
    assert any(note.startswith("camera positions from the names; rows 0.9") for note in light_field.notes)


@pytest.mark.parametrize("pattern", [None, "img_0.{row}_0.{column}.png"])
def test_decimals_that_are_row_and_column_are_no_positions(tmp_path: Path, pattern: str | None) -> None:
    """They would say how far apart rows are, which the views tell."""
    names = by_place("img_{:.2f}_{:.2f}.png", (0.0, 0.25, 0.5), (0.25, 0.35, 0.45))
    light_field = read(put(tmp_path / "f", names), ReadOptions(pattern="img_0.{row}_0.{column}.png"))
    assert places_of(light_field)[0][0] == 0
    assert light_field.row_spacing == 1
    assert "camera positions" not in " ".join(light_field.notes)


def test_link_out_of_the_folder_is_followed_when_asked_for(tmp_path: Path) -> None:
    folder = put(tmp_path / "f", PLACES)
    outside(folder)
    assert places_of(read(folder, ReadOptions(follow_links=True))) == grid_of(3, 3)


ROWS: dict[str, Case] = {
    "words": case(by_place("row_{}/col_{}.png", range(3), range(4)), grid_of(3, 4)),
    "numbers": case(by_place("{}/{}.png", range(3), range(3)), grid_of(3, 3)),
    "a view left out": case(by_place("{}/{}.png", range(2), range(3)), [[0, 1, 2], [3, 4, -1]], exclude=("1/2.png",)),
    "columns": case(
        by_place("col_{}/row_{}.png", range(2), range(3)),
        [[0, 3], [1, 4], [2, 5]],
        pattern="col_{column}/row_{row}.png",
    ),
}


@pytest.mark.parametrize("case", ROWS)
def test_folder_of_rows_is_a_grid(tmp_path: Path, case: str) -> None:
    """Whoever is told to give one of the folders gets depth from one row."""
    names, expected, _, options = ROWS[case]
    for name in names:
        (tmp_path / name).parent.mkdir(exist_ok=True)
    light_field = read(put(tmp_path, names), options)
    assert places_of(light_field) == expected
    assert [scene.views for scene in [own_scene("toy", tmp_path, (), "here")]] == [len(names)]


SCENES = {
    "numbered through": by_place("{}/{}.png", range(3), range(9)),
    "rows and columns": by_place("{}/v_{}_0.png", range(3), range(2)) + by_place("{}/v_{}_1.png", range(3), range(2)),
    "other words": by_place("scene_{}/{}.png", range(3), range(3)),
}


@pytest.mark.parametrize("case", SCENES)
def test_folder_of_light_fields_is_no_grid(tmp_path: Path, case: str) -> None:
    for name in SCENES[case]:
        (tmp_path / name).parent.mkdir(exist_ok=True)
    put(tmp_path, SCENES[case])
    with pytest.raises(SepiError, match="a folder of light fields; give one of them") as caught:
        format_of(tmp_path)
    assert ("--format images" in str(caught.value)) == (case == "numbered through")


def test_hci_folder_stays_one(tmp_path: Path) -> None:
    folder = put(tmp_path / "f", by_number("input_Cam{:03d}.png", range(9)))
    assert format_of(folder).name == "HCI folder"
    with pytest.raises(SepiError, match="--pattern does not apply"):
        read(folder, ReadOptions(pattern="input_Cam{number}.png"))
    by_names = read(folder, ReadOptions(pattern="input_Cam{number}.png", grid=(3, 3)), "images")
    np.testing.assert_array_equal(by_names.views, read(folder, ReadOptions()).views)


TEXT = st.text(st.sampled_from("01290_-. ax{}*()[]\\/?+^$|é\n٣²") | st.characters(), max_size=24)


@given(st.lists(TEXT, max_size=8))
def test_any_names_give_numbers_or_an_error(names: list[str]) -> None:
    try:
        found = infer_view_numbers("folder", names)
    except SepiError:
        return
    assert set(found.numbers) | set(found.unmatched) == set(names)
    assert all(found.numbers_of(name) in (None, numbers) for name, numbers in found.numbers.items())
    assert all(len(numbers) in (1, 2) for numbers in found.numbers.values())
    assert len({len(numbers) for numbers in found.numbers.values()}) == 1


@given(st.integers(-(10**17), 10**17), st.integers(0, 10**17), TEXT.filter(lambda text: not set("{}*/\\-") & set(text)))
def test_pattern_finds_the_numbers_that_made_the_name(row: int, column: int, text: str) -> None:
    between = text.strip("0123456789-") or "_"
    names = [f"{row}{between}{column}.png", f"5{between}5.png"]
    found = parse_view_numbers("folder", names, f"{{row}}{between}{{column}}.png")
    assert found.numbers[names[0]] == (row, column)


@pytest.mark.parametrize("pattern", ["*" * 200 + "{number}x", "*a" * 100 + "{number}b", "*{row}*{column}*a*a*a*a*a*b"])
def test_no_pattern_takes_long(pattern: str) -> None:
    """A pattern of many stars may take for ever where each star may end anywhere."""
    started = time.process_time()
    names = ["a" * 255, "1" * 255, "a1" * 127, "-" * 255, "1a" * 127]
    with pytest.raises(SepiError, match="no file has a name like"):
        parse_view_numbers("folder", names, pattern)
    assert time.process_time() - started < 1


@pytest.mark.parametrize("name", ["1" * 255, "1." * 127, "-" * 255, "1_" * 127, "-1" * 127, "._" * 127])
def test_no_name_takes_long(name: str) -> None:
    started = time.process_time()
    with pytest.raises(SepiError):
        infer_view_numbers("folder", [name, name + "a"])
    assert time.process_time() - started < 1


def test_lytro_views_are_read(real_data: Path) -> None:
    """9x9 views numbered from 01, under a scene's number."""
    folder = real_data / "lytro" / "2067"
    light_field = read(folder, ReadOptions())
    assert light_field.grid == (9, 9)
    assert light_field.present.all()
    np.testing.assert_array_equal(light_field.views[2, 6], imageio.imread(folder / "2067_03_07.png")[:, :, :3])


@pytest.mark.parametrize("names", [("left.png", "right.png"), ("L.png", "R.png"), ("a_left_1.png", "a_right_1.png")])
def test_a_pair_is_a_row_of_two_views(tmp_path: Path, names: tuple[str, str]) -> None:
    put(tmp_path, names[::-1])
    light_field = read(tmp_path, ReadOptions())
    assert places_of(light_field) == [[1, 0]]
    assert light_field.arranged


def test_one_picture_of_each_camera_in_a_folder_of_its_own(tmp_path: Path) -> None:
    """Recorders of camera arrays keep one folder for each."""
    for camera in range(9):
        put(tmp_path / f"cam_{camera:02d}", ["frame_0007.png"])
        imageio.imwrite(tmp_path / f"cam_{camera:02d}/frame_0007.png", pixels(camera))
    assert format_of(tmp_path).name == "folder of views"
    assert places_of(read(tmp_path, ReadOptions())) == [list(range(9))]


@pytest.mark.parametrize(
    "form", ["cam_{:02d}/{:04d}.png", "cam_{:02d}/frame_{:04d}.png", "cam_{:02d}_frame_{:04d}.png"]
)
def test_pictures_at_several_times_are_no_columns_of_views(tmp_path: Path, form: str) -> None:
    """9 cameras and 3 moments were read as 9x3 views: nearly every pixel of the map was wrong."""
    names = by_place(form, range(9), range(3))
    for name in names:
        (tmp_path / name).parent.mkdir(exist_ok=True)
    put(tmp_path, names)
    with pytest.raises(SepiError, match="--pattern, such as '") as caught:
        read(tmp_path, ReadOptions(), "images")
    pattern = str(caught.value).split("'")[-2]
    assert places_of(read(tmp_path, ReadOptions(pattern=pattern), "images")) == [list(range(0, 27, 3))]
