"""Real light fields from public repositories: the arrangement, order, row spacing and range that their views tell.

The ranges were measured by block matching and by eye, and are those of 99 % of the textured pixels.
"""

import warnings
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from sepi.errors import SepiWarning
from sepi.inspection.disparity_range import estimate_range, unmatched
from sepi.inspection.view_order import check_order
from sepi.io.disparity_maps import read_pfm
from sepi.io.readers.options import ReadOptions
from sepi.lightfield import LightField
from sepi.reading import read_light_field


class Known(NamedTuple):
    """What is known of a light field: folder, order that sets it right, grid, views, range, and what it has beyond."""

    folder: str
    order: str
    grid: tuple[int, int]
    views: int
    low: float
    high: float
    warning: str | None = None


SETS = {
    # its table, nearer than the box, reaches 0.65
    "refocus15_crop": Known("refocus15_crop", "as-given", (15, 15), 225, -0.25, 0.65),
    "legoknights3": Known("legoknights3", "as-given", (3, 3), 9, -5.4, 5.0),
    "gantry-jellybeans": Known(
        "gantry-jellybeans", "flip-rows", (17, 17), 289, -4.1, 1.4, "read it with --order flip-r"
    ),
    "t_rex": Known("t_rex", "as-given", (5, 5), 25, -54, 47),
    "openlf 4D": Known("openlf/4D/rgb", "as-given", (5, 5), 25, 4.95, 7.5),
    "openlf 3DH": Known("openlf/3DH/rgb", "as-given", (1, 5), 5, 4.95, 7.5),
    "openlf 3DV": Known("openlf/3DV/rgb", "as-given", (5, 1), 5, 4.95, 7.5),
    "openlf CROSS": Known("openlf/CROSS/rgb", "as-given", (5, 5), 9, 4.95, 7.5),
    "openlf HDF5": Known("openlf/4D/test_lf4D_rgb.h5", "as-given", (5, 5), 25, 4.95, 7.5),
    "lytro10x10": Known("lytro10x10-every2", "transpose", (5, 5), 25, -1.42, -1.14, "read it with --order transpose,"),
    "seahorse5": Known("seahorse5/camImagesFlat", "as-given", (5, 5), 25, 0.7, 2.0),
    "mansion51": Known("mansion51/images", "as-given", (1, 51), 51, 0.04, 0.57),
}


def path_of(real_data: Path, name: str) -> Path:
    path = real_data / "real" / SETS[name].folder
    if not path.exists():
        pytest.skip(f"{path} is absent")
    return path


@cache
def read_set(path: Path) -> tuple[LightField, list[str]]:
    """The light field as it is read by itself, and what is warned of then."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        light_field = read_light_field(path)
    return light_field, [str(warning.message) for warning in caught if issubclass(warning.category, SepiWarning)]


def known_set(path: Path, name: str) -> LightField:
    """The light field with its views in the right order."""
    if SETS[name].warning is None:
        return read_set(path)[0]
    # of large grids as many views as are looked at
    options = ReadOptions(order=SETS[name].order, central=9 if min(SETS[name].grid) > 9 else None)
    return read_light_field(path, options=options, check_order=False)


@pytest.mark.parametrize("name", SETS)
def test_the_views_are_put_where_they_belong(real_data: Path, name: str) -> None:
    """A cross taken for a square, or rows for columns, is depth of nothing; a false warning turns it inside out."""
    known = SETS[name]
    light_field, found = read_set(path_of(real_data, name))
    assert light_field.grid == known.grid
    assert light_field.present.sum() == known.views
    # of the gantry's camera positions, and of steps of 35 and 14 pixels; a Lytro's shifted views are no other spacing
    spacing = {"gantry-jellybeans": 0.981, "t_rex": 0.394}.get(name, 1)
    assert light_field.row_spacing == pytest.approx(spacing, abs=0 if spacing == 1 else 0.008)
    if known.warning is None:
        assert not found
    else:
        assert len(found) == 1
        assert known.warning in found[0]


@pytest.mark.parametrize(
    "folder",
    [
        *("hci_new/cotton", "hci_new/antinous", "lytro/2067", "rendered/bust", "rendered/desk", "rendered/mirrors"),
        *("stereo/cones", "stereo/venus", "stereo/poster1", "stereo/tsukuba", "real/omnistic-views"),
    ],
)
def test_nothing_is_warned_of_in_sound_sets(real_data: Path, folder: str) -> None:
    """Of views on a disc, in one row, in noise, of mirrors: none is odd, and they fit together."""
    if not (real_data / folder).exists():
        pytest.skip(f"{folder} is absent")
    assert not read_set(real_data / folder)[1]


@pytest.mark.parametrize("name", ["legoknights3", "t_rex", "mansion51"])
def test_near_and_far_are_told(real_data: Path, name: str) -> None:
    """A row of fifty views moves little from one to the next: what hides what shows between distant ones."""
    found = check_order(known_set(path_of(real_data, name), name))
    assert found.sign_clear
    assert found.verdict() == "the views are in the right order"


@pytest.mark.parametrize("name", SETS)
def test_the_range_holds_the_scene_and_little_more(real_data: Path, name: str) -> None:
    """Too narrow, it cuts off the nearest or most distant surface; too wide, it costs time and accuracy."""
    known = SETS[name]
    light_field = known_set(path_of(real_data, name), name)
    # where things move by so much that the search takes long, a part that has the nearest and the most distant ones
    part = {"t_rex": np.s_[:, :, :, 210:630]}.get(name, np.s_[:])
    found = estimate_range(replace(light_field, views=light_field.views[part]))
    assert found.minimum <= known.low
    assert found.maximum >= known.high
    assert found.maximum - found.minimum <= 1.5 * (known.high - known.low)
    # no word of a range that is sound
    assert unmatched(replace(light_field, views=light_field.views[part], disparity_range=found)) < 0.06


# of each folder rows and columns of the views, and how many steps they are apart
MEASURED = {
    "stereo/cones": {
        "a pair": (np.s_[:, [2, 6]], 4),
        "a wide pair": (np.s_[:, [0, 8]], 8),
        "all": (np.s_[:], 1),
        "three far apart": (np.s_[:, ::4], 4),
    },
    "stereo/venus": {"a pair": (np.s_[:, [2, 6]], 4), "each second": (np.s_[:, ::2], 2)},
    "stereo/poster1": {"a pair": (np.s_[:, [2, 6]], 4), "each second": (np.s_[:, ::2], 2)},
    "hci_new/cotton": {"a wide pair": (np.s_[4:5, [0, 8]], 8)},
    "hci_new/antinous": {"a column": (np.s_[:, 4:5], 1)},
    "rendered/desk": {"all": (np.s_[:], 1), "a row": (np.s_[4:5], 1), "a pair": (np.s_[4:5, [3, 4]], 1)},
}


@pytest.mark.parametrize("folder", MEASURED)
def test_the_range_holds_the_truth(real_data: Path, folder: str) -> None:
    """Of two or three views too, whose steps are of a hundred pixels, and no word that it does not."""
    if not (real_data / folder).is_dir():
        pytest.skip(f"{real_data / folder} is absent")
    whole = read_set(real_data / folder)[0]
    truth = whole.ground_truth if "stereo" not in folder else read_pfm(real_data / folder / "truth.pfm")
    for name, (kept, steps) in MEASURED[folder].items():
        low, high = steps * np.quantile(truth[np.isfinite(truth)], [0.0025, 0.9975])
        light_field = LightField(np.ascontiguousarray(whole.views[kept]), name)
        found = estimate_range(light_field)
        # of a hundred pixels a step, what is nearest is not in both pictures
        assert found.minimum <= low, name
        assert found.maximum >= (high if steps * high < 400 else 0.98 * high), name
        assert found.maximum - found.minimum <= 1.5 * (high - low) + 0.5, name
        assert unmatched(light_field.with_range(found)) < 0.06, name
