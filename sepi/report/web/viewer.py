"""What the viewer in a page needs: panels that name arrays, and the arrays, packed and each there once.

A panel is a way to look at one array, or at two: an error is a map less the ground truth, and a page takes that
difference itself. ``templates/viewer.js`` draws them.
"""

from __future__ import annotations

import hashlib
import math
from dataclasses import dataclass, field
from functools import cache
from typing import Any

import cv2
import numpy as np

from sepi.camera import Camera
from sepi.lightfield import BoolMap, FloatMap
from sepi.report.plots.pictures import ERROR_LIMIT, Picture, picture_uri
from sepi.report.web.packing import packed_map, packed_mask, packed_size

ROLES = ("final", "confidence", "other")
"""What a map is kept for, which decides in how fine steps."""

_MASK = "mask"

PRECISIONS = (
    (0.001, 0.01, 0.002),
    (0.001, 0.01, 0.005),
    (0.001, 0.02, 0.01),
    (0.001, 0.02, 0.02),
    (0.001, 0.05, 0.02),
    (0.001, 0.05, 0.03),
    (0.001, 0.05, 0.05),
    (0.001, 0.05, 0.1),
    (0.002, 0.1, 0.1),
    (0.005, 0.1, 0.1),
    (0.01, 0.2, 0.2),
)
"""Steps of the maps of each role, from the finest; the first is taken that keeps the scene within its share."""

# Characters for each pixel: ten scenes of 512x512 and the page round them stay below 15 MB. Imported maps come on top.
_BUDGET = 5.4
_BUDGET_IMPORTED = 0.2
# a smaller scene may take as much as one of 512x512
_LEAST_PIXELS = 2**18

# larger pictures are thinned out, so that a browser can hold all their maps
_MOST_PIXELS = 2**20

# of the reference view: the second where the first takes more than so many characters for each pixel
_PICTURE_QUALITIES = (95, 80)
_PICTURE_SHARE = 0.4


@dataclass(frozen=True)
class _Array:
    """A map and its role, or a mask."""

    values: FloatMap
    role: str

    def packed(self, step: float) -> dict[str, Any]:
        return packed_mask(self.values.astype(bool)) if self.role == _MASK else packed_map(self.values, step)

    def size(self, step: float) -> int:
        return len(self.packed(step)["data"]) if self.role == _MASK else packed_size(self.values, step)


@dataclass
class Viewer:
    """Panels of one scene, and the arrays that they show.

    Attributes
    ----------
    shape : (int, int)
        Height and width of all maps.
    limits : (float, float)
        Ends of the scale of disparity, pixels per view step.
    picture : ndarray, shape (H, W, 3), uint8, or None
        The reference view.
    camera : Camera or None
        For a cloud in metres.
    from_centre : (int, int)
        Rows below and columns to the right of the grid's centre view at which the reference view stands.
    """

    shape: tuple[int, int]
    limits: tuple[float, float]
    picture: Picture | None = None
    camera: Camera | None = None
    from_centre: tuple[int, int] = (0, 0)
    panels: list[dict[str, Any]] = field(default_factory=list)
    _arrays: dict[str, _Array] = field(default_factory=dict)
    _imported: int = 0

    def map(self, values: FloatMap, role: str = "other") -> int:
        """Keep a map (H, W) of one of :data:`ROLES`; returns the number that panels call it by."""
        return self._number(self.thinned(values.astype(np.float32)), role)

    def mask(self, values: BoolMap) -> int:
        """Keep a mask (H, W); returns its number."""
        return self.kept_mask(self.thinned(values))

    def kept_mask(self, values: BoolMap) -> int:
        """Keep a mask that is thinned out already; returns its number."""
        return self._number(values.astype(np.float32), _MASK)

    def imported(self, values: FloatMap) -> int:
        """Keep a map of another method, which may take its own share of characters; returns its number."""
        self._imported += 1
        return self.map(values)

    def panel(self, group: str, key: str, title: str, kind: str, **more: Any) -> None:
        """Add a panel.

        Parameters
        ----------
        group : str
            Heading that it stands under.
        key : str
            Its name, which no other panel has.
        title : str
        kind : str
            ``picture``, ``disparity``, ``error``, ``change``, ``confidence``, ``grey``, ``mask`` or ``outline``.
        **more
            ``map``: number of its array; ``minus``: of the array taken from it; ``ground_truth``: of the ground truth
            that both are compared with; ``confidence``: of the confidence that is read out beside it; ``note``: what is
            to be said of it; ``ends``: words for the low and the high end of its scale.
        """
        if any(panel["key"] == key for panel in self.panels):
            raise ValueError(f"two panels are called {key!r}")
        known = {name: value for name, value in more.items() if value is not None}
        self.panels.append({"group": group, "key": key, "title": title, "kind": kind, **known})

    @property
    def stride(self) -> int:
        """Every so-many-th row and column is kept."""
        return max(1, math.ceil(math.sqrt(self.shape[0] * self.shape[1] / _MOST_PIXELS)))

    def to_json(self, reserved: int = 0) -> dict[str, Any]:
        """Everything, ready for ``json.dumps``.

        Parameters
        ----------
        reserved : int
            Characters that what stands beside it takes of the scene's share.
        """
        picture = "" if self.picture is None else _webp(self.thinned(self.picture))
        height, width = (len(range(0, side, self.stride)) for side in self.shape)
        share = (_BUDGET + _BUDGET_IMPORTED * self._imported) * max(_LEAST_PIXELS, height * width)
        budget = share - reserved - len(picture)
        steps = self._affordable_steps(budget)
        return {
            "height": height,
            "width": width,
            "stride": self.stride,
            "limits": list(self.limits),
            "error_limit": ERROR_LIMIT,
            "camera": self._camera_json(),
            "picture": picture,
            "panels": self.panels,
            "arrays": [array.packed(steps[array.role]) for array in self._arrays.values()],
        }

    def _affordable_steps(self, budget: float) -> dict[str, float]:
        """Steps of each role: the finest that keep all arrays within a number of characters, or the coarsest."""
        arrays = list(self._arrays.values())
        size = cache(lambda number, step: arrays[number].size(step))
        for precision in PRECISIONS:
            steps = dict(zip((*ROLES, _MASK), (*precision, 1.0), strict=True))
            total = 0
            for number, array in enumerate(arrays):
                total += size(number, steps[array.role])
                if total > budget:
                    break
            else:
                return steps
        return steps

    def _camera_json(self) -> dict[str, Any] | None:
        if self.camera is None:
            return None
        return {
            "scale": self.camera.scale,
            "offset": self.camera.offset,
            "focal": self.camera.focal_px,
            "from_centre": list(self.from_centre),
        }

    def thinned(self, values: Any) -> Any:
        """The rows and columns of an array (H, W, ...) that are kept."""
        return values[:: self.stride, :: self.stride]

    def _number(self, values: FloatMap, role: str) -> int:
        kind = "mask" if role == _MASK else "map"
        key = kind + hashlib.sha256(np.ascontiguousarray(values).tobytes()).hexdigest()
        before = self._arrays.get(key)
        # an equal map that is held more finely serves both
        finer = role if before is None else min(before.role, role, key=[*ROLES, _MASK].index)
        self._arrays[key] = _Array(values, finer)
        return list(self._arrays).index(key)


def _webp(picture: Picture) -> str:
    for quality in _PICTURE_QUALITIES:
        text = picture_uri(np.ascontiguousarray(picture), "webp", [cv2.IMWRITE_WEBP_QUALITY, quality])
        if len(text) <= _PICTURE_SHARE * max(_LEAST_PIXELS, picture.shape[0] * picture.shape[1]):
            break
    return text
