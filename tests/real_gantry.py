"""A real light field of a gantry, whose files are named after where its camera stood."""

import re
from functools import cache
from pathlib import Path

import numpy as np
import numpy.typing as npt

from sepi.io.readers.options import ReadOptions
from sepi.lightfield import LightField
from sepi.reading import read_light_field

NAME = re.compile(r"jpg_out_(\d+)_(\d+)_(-?[\d.]+)_(-?[\d.]+)\.jpg")
ORDER = "flip-rows"


@cache
def gantry(folder: Path) -> tuple[LightField, npt.NDArray[np.float64]]:
    """The light field in the right order, and where its views stand, (T, S, 2) in view steps, by their names.

    Names give the camera's place as vertical and horizontal coordinate; rows of the light field run the other way than
    those of the files, and down is where they go.
    """
    light_field = read_light_field(folder, options=ReadOptions(order=ORDER), check_order=False)
    places = np.empty((*light_field.grid, 2))
    for path in folder.iterdir():
        if found := NAME.fullmatch(path.name):
            row, column, *place = found.groups()
            places[int(row), int(column)] = [float(value) for value in place]
    places = places[::-1]
    t, s = np.indices(light_field.grid)
    of_grid = np.stack([np.ones(t.size), t.ravel(), s.ravel()], axis=1)
    _, per_row, per_column = np.linalg.lstsq(of_grid, places.reshape(-1, 2), rcond=None)[0]
    return light_field, places * np.sign([per_row[0], per_column[1]]) / abs(per_column[1])
