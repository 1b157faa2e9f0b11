"""Views that are none of the scene's: of another scene or turned over, black, or copied from another place.

Small pictures of neighbouring views are alike where one is moved a little, whatever grid they stand in. So views fall
into groups; where most are of one, the others fit none of these.
"""

from __future__ import annotations

import shlex
from collections import Counter
from collections.abc import Iterable
from itertools import product

import cv2
import numpy as np
import numpy.typing as npt

from sepi.errors import one_line
from sepi.inspection.view_layouts import Views
from sepi.lightfield import FloatMap, LightField

Places = npt.NDArray[np.int64]

# Pixels of the small pictures, at most
_MOST_PIXELS = 5_200
# Movement to each side, as part of the shorter side; how many views each is compared with: nearest ones
# and, where it is like none of those, some from all over the grid
_MOVEMENT = 1 / 8
_NEIGHBOURS = 4
_OTHERS = 32
# Correlation from which on two views are alike, and of half of the views with the one most alike: with less, noise or
# wide steps leave nothing to judge by. Views of other scenes have 0.17 at most, those of sound light fields 0.6 or so.
_ALIKE = 0.3
_USUAL = 0.45


def odd_views(light_field: LightField) -> list[str]:
    """What to say of views that fit none of the others, and of those that are the same picture.

    Parameters
    ----------
    light_field : LightField
        Arranged or not.

    Returns
    -------
    list of str
        Lines for the user, which name the views by the flags that leave them out.

    Examples
    --------
    >>> from sepi.inspection.odd_views import odd_views
    >>> from sepi.scenes import render
    >>> light_field = render("dots", size=96, views=3)
    >>> odd_views(light_field)
    []
    >>> light_field.views[0, 2] = light_field.views[0, 2, ::-1]
    >>> odd_views(light_field)  # doctest: +ELLIPSIS
    ['views that fit none of the others (...), to leave out: --exclude 0,2']
    """
    views = Views(light_field, _MOST_PIXELS)
    baselines = [(0, 0), *views.baselines]
    places = np.array(baselines, np.int64) + np.array(views.middle, np.int64)
    small = [views.detail(baseline, 1) for baseline in baselines]
    looks = [picture.tobytes() for picture in small]
    times = Counter(looks)
    found = {
        "are the same picture as others": [n for n, look in enumerate(looks) if times[look] > 1 and small[n].any()],
        "fit none of the others (black, of another scene, or turned, whatever EXIF says)": _misfits(places, small),
    }
    return [f"views that {what}, to leave out: {_flags(light_field, places[at])}" for what, at in found.items() if at]


def _flags(light_field: LightField, places: Places) -> str:
    """What leaves views out: names of their files, or their positions where they have none of their own."""
    files = light_field.files
    at = sorted(places.tolist())
    names = [f"{t},{s}" if files is None else shlex.quote(one_line(str(files[t, s]))) for t, s in at]
    return " ".join(f"--exclude {name}" for name in names)


def _misfits(places: Places, small: list[FloatMap]) -> list[int]:
    """Views that are like none of most of the others; none where these are too little like each other."""
    group, best = np.arange(len(places)), np.zeros(len(places))

    def compare(pairs: Iterable[tuple[int, int]]) -> None:
        for first, second in pairs:
            alike = _correlation(small[first], small[second])
            best[[first, second]] = np.maximum(best[[first, second]], alike)
            if alike >= _ALIKE:
                group[group == group[second]] = group[first]

    near = set()
    for at, place in enumerate(places):
        away = abs(places - place)
        nearest = np.lexsort((away.min(axis=1), away.max(axis=1)))[1 : 1 + _NEIGHBOURS].tolist()
        near |= {(min(at, other), max(at, other)) for other in nearest}
    compare(near)
    usual = group == np.bincount(group).argmax()
    # in a wrong order neighbours are not
    compare(product(np.flatnonzero(~usual).tolist(), np.flatnonzero(usual)[:: 1 + usual.sum() // _OTHERS].tolist()))
    odd = np.flatnonzero(group != np.bincount(group).argmax())
    return odd.tolist() if 2 * odd.size < len(places) and np.median(best) >= _USUAL else []


def _correlation(first: FloatMap, second: FloatMap) -> float:
    """Highest correlation, -1 to 1, of one picture with the other's middle, over small movements."""
    edge = max(1, round(_MOVEMENT * min(first.shape)))
    middle = second[edge:-edge, edge:-edge]
    # what has no contrast is alike to all for OpenCV
    if not (middle.size and np.ptp(middle) and np.ptp(first)):
        return 0.0
    return float(cv2.matchTemplate(first, middle, cv2.TM_CCOEFF_NORMED).max())
