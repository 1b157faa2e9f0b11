"""Checks from the views alone whether they are in the right order, and whether any of them is odd.

A grid of views can be laid out in eight ways: rows and columns of views each run one way or the other, and either comes
first. Only in the right one do all views agree on the disparities. A half turn of the grid only changes the sign of
every disparity. This leaves two orders, in which near and far are exchanged; occlusion distinguishes them.

An odd view is of another scene, rotated, black, or copied from another place. Small pictures of neighbouring views are
alike after a small shift, in any grid. So views form groups; if one group has most views, the others are odd.
"""

from __future__ import annotations

import shlex
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import product

import cv2
import numpy as np
import numpy.typing as npt

from sepi.errors import one_line
from sepi.inspection.disparity_sign import Evidence, Look, occlusion_evidence
from sepi.inspection.view_layouts import Trial, Views, baselines_under, best_trial
from sepi.io.readers.options import AS_GIVEN, ORDERS
from sepi.lightfield import FloatMap, LightField, require_light_field
from sepi.validation import require_known

# Least evidence for the sign: regions of the picture with occlusion, their mean (-2 to 2), and that in standard errors;
# and the same to find near and far exchanged
_FEWEST_REGIONS = 5
_LEAST_EVIDENCE, _LEAST_ERRORS = 0.75, 3.5
_PLAIN_EVIDENCE, _PLAIN_ERRORS = 0.85, 3.75

SIGN_OPEN = "near and far cannot be told apart here"
"""Beginning of the note that depth may be inside out."""

_FAULTS = {
    "flip-rows": "the rows of views run the other way",
    "flip-columns": "the columns of views run the other way",
    "flip-both": "rows and columns of views run the other way, so that near and far are exchanged",
    "transpose": "rows and columns of views are exchanged",
    "transpose-flip-rows": "rows and columns of views are exchanged, and one of them runs the other way",
    "transpose-flip-columns": "rows and columns of views are exchanged, and one of them runs the other way",
    "transpose-flip-both": "rows and columns of views are exchanged, and both run the other way",
}

# a grid in which all orders differ
_GRID = np.arange(6).reshape(2, 3)


@dataclass(frozen=True)
class OrderCheck:
    """Result of :func:`check_order`: matching cost of each order, and the best one.

    Attributes
    ----------
    fits : mapping of str to float
        Order of ``sepi.io.readers.options.ORDERS`` to matching cost, 0..1, lower is better; in the order of ``ORDERS``.
    best : str
        Order of the lowest matching cost; of equal ones the given order, then the first.
    clear : bool
        Whether this order, or the one with near and far exchanged, fits clearly better than the others.
    sign_clear : bool
        Whether occlusion tells near from far.
    read_in : str
        Order in which the light field was read.
    regions, agreeing : int
        Number of regions of the picture with occlusion, and of those that agree on the sign; 0 if camera positions in
        file names tell the sign.
    fits_none : bool
        Whether the views match badly in every order although they show texture.

    Examples
    --------
    >>> from sepi.inspection.view_order import OrderCheck, check_order
    >>> from sepi.scenes import render
    >>> found = check_order(render("pyramids", size=96, views=5))
    >>> isinstance(found, OrderCheck), found.best, found.clear
    (True, 'as-given', True)
    >>> found.fits["as-given"] < 0.5 * found.fits["transpose"]
    True
    >>> found.sign_clear  # hardly anything hides anything here
    False
    """

    fits: Mapping[str, float]
    best: str
    clear: bool
    sign_clear: bool
    read_in: str
    regions: int = 0
    agreeing: int = 0
    fits_none: bool = False

    def verdict(self) -> str:
        """One line for the user.

        Returns
        -------
        str
            Whether the order is right, which one is, or that it is unclear.
        """
        warning = self.warning()
        if warning is not None:
            return warning
        if not self.clear:
            return (
                "unclear: no order fits clearly better than the others (too little texture, or too little movement "
                "between the views)"
            )
        note = self.note()
        return f"the views are in the right order{'' if note is None else f', but {note}'}"

    def note(self) -> str | None:
        """Advice if near and far may be exchanged.

        Returns
        -------
        str or None
            None if near and far are clear, or the order is wrong or unclear.
        """
        if not self.clear or self.sign_clear or self.best != self.read_in:
            return None
        return f"{SIGN_OPEN}; if depth comes out inside out, read it with --order {turned_by_half(self.best)}"

    def warning(self) -> str | None:
        """Advice if the order is wrong.

        Returns
        -------
        str or None
            None, unless another order fits clearly better, or the views fit together in none.
        """
        if self.fits_none:
            return (
                "the views fit together in no order: they show several moments or places, are not rectified, or have "
                "other names than 'sepi info' assumes"
            )
        if not self.clear or self.best == self.read_in:
            return None
        fault = _FAULTS[self.best] if self.read_in == AS_GIVEN else f"--order {self.read_in} does not fit"
        advice = f"read it with --order {self.best}"
        if not self.sign_clear:
            return f"{fault}: {advice}, or {turned_by_half(self.best)} if depth comes out inside out"
        told = f"occlusion agrees in {self.agreeing} of {self.regions} regions of the picture"
        return f"{fault} ({told if self.regions else 'according to camera positions in the names'}): {advice}"


def check_order(light_field: LightField, read_in: str = AS_GIVEN, views: Views | None = None) -> OrderCheck:
    """Check in which order the views fit together.

    Parameters
    ----------
    light_field : LightField
        Its disparity range, ground truth and reference view are not used.
    read_in : str
        Order in which it was read, one of :data:`sepi.io.readers.options.ORDERS`; the result's orders replace it.
    views : Views, optional
        Its views, if prepared before.

    Returns
    -------
    OrderCheck

    Examples
    --------
    A light field with its rows of views in reverse:

    >>> from sepi import LightField
    >>> from sepi.inspection.view_order import check_order
    >>> from sepi.scenes import render
    >>> light_field = render("pyramids", size=96, views=5)
    >>> found = check_order(LightField(light_field.views[::-1].copy(), "upside down"))
    >>> found.best
    'flip-rows'
    >>> print(found.warning())  # doctest: +ELLIPSIS
    the rows of views run the other way: read it with --order flip-rows...
    """
    require_light_field(light_field)
    require_known("order", [read_in], ORDERS)
    views = views or Views(light_field)
    trial, fits_none = best_trial(light_field, views)
    if trial is None:
        return OrderCheck(dict.fromkeys(ORDERS, 1.0), read_in, clear=False, sign_clear=False, read_in=read_in)
    costs = dict(trial.costs)
    sign_clear, evidence = False, Evidence(0.0, 0.0, 0, 0)
    if trial.clear:
        # the sign of the given order, if that may be right: rejecting it needs more evidence
        kept = next((sign for order, sign in trial.best.items() if order == AS_GIVEN), None)
        evidence, sign_clear = _evidence_of_sign(light_field, trial, kept, views)
        if sign_clear:
            # less than half way to the next layout, since even the wrong sign fits better than another layout
            for order, sign in trial.best.items():
                costs[order] += trial.gap / 2 * (0.5 - sign * evidence.mean / 4)
        elif any(light_field.directions):
            evidence = Evidence(0.0, 0.0, 0, 0)
            for order in trial.best:
                # direction of coordinates from column to column in this order; 0: unknown
                right = int(baselines_under(order, np.eye(2))[:, 1] @ light_field.directions)
                sign_clear = right != 0
                costs[order] += trial.gap / 4 * (1 - right)
    # from changes of this light field to orders that replace the given one
    fits = {order: costs[change_of_order(read_in, order)] for order in ORDERS}
    best = min(ORDERS, key=lambda order: (fits[order], order != read_in))
    return OrderCheck(fits, best, trial.clear, sign_clear, read_in, evidence.regions, evidence.agreeing, fits_none)


def _evidence_of_sign(light_field: LightField, trial: Trial, kept: int | None, views: Views) -> tuple[Evidence, bool]:
    """Evidence of occlusion, and whether it is clear; ``kept`` is the sign of the given order, if that may be right.

    A quick check is enough to accept the order. Rejecting it needs a closer check that the closest does not contradict.
    """
    doubt: Evidence | None = None
    for look in Look if kept is not None else (Look.AXES, Look.MANY_VIEWS):
        evidence = occlusion_evidence(light_field, trial, look, views)
        doubted = kept is not None and kept * evidence.mean < 0
        clear = _is_clear(evidence, plainly=doubted or look is Look.GLANCE)
        if clear and not doubted:
            return evidence, True
        if clear and look is Look.AXES:
            doubt = evidence
    return (evidence, clear) if doubt is None else (doubt, True)


def _is_clear(evidence: Evidence, plainly: bool) -> bool:
    mean, errors = (_PLAIN_EVIDENCE, _PLAIN_ERRORS) if plainly else (_LEAST_EVIDENCE, _LEAST_ERRORS)
    return evidence.regions >= _FEWEST_REGIONS and abs(evidence.mean) >= mean and evidence.errors >= errors


def change_of_order(read_in: str, target: str) -> str:
    """The order that changes a grid read in order ``read_in`` to one read in order ``target``."""
    turned = ORDERS[target](_GRID)
    return next(order for order in ORDERS if np.array_equal(ORDERS[order](ORDERS[read_in](_GRID)), turned))


def turned_by_half(order: str) -> str:
    """The order that differs from another by half a turn, which exchanges near and far."""
    # reading in one order and rotating equals reading in the other
    return next(other for other in ORDERS if change_of_order(order, other) == "flip-both")


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
    small = views.details(baselines)
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
