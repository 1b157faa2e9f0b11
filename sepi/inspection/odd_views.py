"""Finds odd views: of another scene, rotated, black, or copied from another place.

Small pictures of neighbouring views are alike after a small shift, in any grid. So views form groups; if one group has
most views, the others are odd.
"""

from __future__ import annotations

import shlex
from collections import Counter
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
# Movement searched to each side, as a share of the shorter side; number of other views, spread over the grid, for the
# comparison of a view unlike its neighbours
_MOVEMENT = 1 / 8
_OTHERS = 32
# Views are alike if their correlation is at least this share of the median of all views' best correlations. If that is
# below the least, no view is judged, since noise or wide steps hide the likeness.
_ALIKE = 0.4
_LEAST = 0.18


def odd_views(light_field: LightField) -> list[str]:
    """Messages about views that match none of the others, and about identical pictures.

    Parameters
    ----------
    light_field : LightField
        Arranged or not.

    Returns
    -------
    list of str
        Lines for the user, which name the views by the flags that leave them out.
    """
    views = Views(light_field, _MOST_PIXELS)
    baselines = [(0, 0), *views.baselines]
    places = np.array(baselines, np.int64) + np.array(views.middle, np.int64)
    small = [views.detail(baseline, 1) for baseline in baselines]
    looks = [picture.tobytes() for picture in small]
    times = Counter(looks)
    found = {
        "show the same picture as others": [n for n, look in enumerate(looks) if times[look] > 1 and small[n].any()],
        "match none of the others (black, of another scene, or rotated; EXIF is not used)": _misfits(places, small),
    }
    return [f"views that {what}; leave out by {_flags(light_field, places[at])}" for what, at in found.items() if at]


def _flags(light_field: LightField, places: Places) -> str:
    """Flags that leave out views: by file name, or by position if views have no files of their own."""
    files = light_field.files
    at = sorted(places.tolist())
    names = [f"{t},{s}" if files is None else shlex.quote(one_line(str(files[t, s]))) for t, s in at]
    return " ".join(f"--exclude {name}" for name in names)


def _misfits(places: Places, small: list[FloatMap]) -> list[int]:
    """Views outside the largest group of similar views; none if views are too different."""
    index = {(t, s): at for at, (t, s) in enumerate(places.tolist())}
    pairs = [(at, index.get(next_to, at)) for (t, s), at in index.items() for next_to in ((t, s + 1), (t + 1, s))]
    found = [(at, other, _correlation(small[at], small[other])) for at, other in pairs if at != other]
    group, best = np.arange(len(places)), np.zeros(len(places))
    for at, other, alike in found:
        best[[at, other]] = np.maximum(best[[at, other]], alike)
    least = _ALIKE * float(np.median(best))

    def odd() -> npt.NDArray[np.int64]:
        for at, other, alike in found:
            if alike >= least:
                group[group == group[other]] = group[at]
        return np.flatnonzero(group != np.bincount(group).argmax())

    # in a wrong order, neighbours in the grid are not neighbours
    usual = np.setdiff1d(np.arange(len(places)), odd())
    others = product(odd().tolist(), usual[:: 1 + usual.size // _OTHERS].tolist())
    found += [(at, other, _correlation(small[at], small[other])) for at, other in others]
    return odd().tolist() if 2 * odd().size < len(places) and least >= _LEAST else []


def _correlation(first: FloatMap, second: FloatMap) -> float:
    """Highest correlation, -1 to 1, of one picture with the other's middle, over small movements."""
    edge = max(1, round(_MOVEMENT * min(first.shape)))
    middle = second[edge:-edge, edge:-edge]
    # OpenCV finds pictures without contrast alike to all
    if not (middle.size and np.ptp(middle) and np.ptp(first)):
        return 0.0
    return float(cv2.matchTemplate(first, middle, cv2.TM_CCOEFF_NORMED).max())
