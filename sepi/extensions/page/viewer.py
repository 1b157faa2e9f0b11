"""Data of a page's viewer: arrays, each packed once, and panels that refer to them.

``templates/viewer.js`` draws the panels, and computes errors as map minus ground truth. An array is packed as short
text: whole steps, differences to the row above, deflated, in base64. A browser unpacks it with base64,
``DecompressionStream("deflate")``, and a sum down the columns (``templates/unpack.js``). Values are whole multiples of
the map's step, so a page shows the map's value exactly rounded to this step.
"""

import base64
import hashlib
import math
import zlib
from collections.abc import Sequence
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt

from sepi.lightfield import LightField
from sepi.report.panels import Panel
from sepi.report.pictures import ERROR_LIMIT, SIGMA_LIMITS, logarithms, outlines, picture_uri, reference_picture

# number of levels of two bytes, without the one for unknown
_LEVELS = 2**16 - 1
# largest exact whole number of steps
_LARGEST = 2**52


def packed(values: npt.NDArray[Any], step: float) -> dict[str, Any]:
    """A map or mask, rounded to whole steps.

    Parameters
    ----------
    values : ndarray, shape (H, W), float or bool
        Values that are not finite are unknown.
    step : float
        Step in the values' unit; it grows by factors of ten if 65533 steps do not span the values.

    Returns
    -------
    dict
        ``step``; ``base``: level of the smallest value; ``data``: base64 of the deflated differences.
    """
    known = np.isfinite(values)
    exact = np.where(known, values, 0).astype(np.float64)
    low, high = (float(exact[known].min()), float(exact[known].max())) if known.any() else (0.0, 0.0)
    while (high - low) / step > _LEVELS - 2 or max(-low, high) / step > _LARGEST:
        step *= 10
    # 1 / step is a whole number for the usual steps, and so exact
    whole = np.rint(exact * (1 / step)).astype(np.int64)
    base = round(low * (1 / step))
    # counted from 1, with 0 for unknown
    levels = np.where(known, whole - base + 1, 0).astype(np.uint16)
    # modulo 2^16, like the sum
    change = np.diff(levels, axis=0, prepend=np.zeros_like(levels[:1])).view(np.int16)
    # 0, -1, 1, -2, ... as 0, 1, 2, 3, ..., so that high bytes are mostly zero
    folded = ((change << 1) ^ (change >> 15)).view(np.uint16)
    planes = (folded & 255).astype(np.uint8).tobytes() + (folded >> 8).astype(np.uint8).tobytes()
    compressor = zlib.compressobj(6, strategy=zlib.Z_FILTERED)
    data = compressor.compress(planes) + compressor.flush()
    return {"step": step, "base": base, "data": base64.b64encode(data).decode("ascii")}


STEPS = (
    (0.001, 0.01, 0.002),
    (0.001, 0.02, 0.01),
    (0.001, 0.05, 0.01),
    (0.001, 0.05, 0.02),
    (0.001, 0.05, 0.05),
    (0.01, 0.2, 0.2),
)
"""Steps of precise maps, confidences and other maps, finest first; the first steps that keep a scene within its share
are used."""

PRECISE, CONFIDENCE, OTHER, MASK, LOGARITHM = range(5)
"""Role of an array, its place in a row of :data:`STEPS`; masks have steps of 1, logarithms of 12 %."""

_FIXED = (1.0, 0.05)

# mean number of characters per pixel of an array, so that a page with ten scenes of 512x512 stays below 20 MB; a small
# scene may take as much as one of 512x512
_SHARE = 0.255
_LEAST_PIXELS = 2**18

# of larger pictures, only some rows and columns are kept, so that a browser can hold all their maps
_MOST_PIXELS = 2**20

# quality of the reference view's picture
_WEBP = [cv2.IMWRITE_WEBP_QUALITY, 90]


# digest of an array to the array and its role
_Held = dict[str, tuple[npt.NDArray[Any], int]]


def _number(held: _Held, values: npt.NDArray[Any], role: int) -> int:
    """Number of an array, added unless an equal one is there; the finest of several roles counts."""
    values = values if role == MASK else values.astype(np.float32)
    key = values.dtype.name + hashlib.sha256(values.tobytes()).hexdigest()
    _, before = held.get(key, (None, role))
    held[key] = (values, min(role, before))
    return list(held).index(key)


def _all_packed(held: _Held, pixels: int) -> list[dict[str, Any]]:
    """All arrays, in the finest steps that keep them within their share of characters, or the coarsest."""
    # error bars have no share of their own, so other maps of a full page get slightly coarser
    budget = _SHARE * pixels * sum(role != LOGARITHM for _, role in held.values())
    for steps in STEPS:
        found = [packed(values, (*steps, *_FIXED)[role]) for values, role in held.values()]
        if sum(len(array["data"]) for array in found) <= budget:
            break
    return found


def viewer_json(
    panels: Sequence[Panel], limits: tuple[float, float], light_field: LightField | None = None
) -> dict[str, Any]:
    """Panels and arrays, ready for ``json.dumps``.

    Parameters
    ----------
    panels : sequence of Panel
        Panels of maps of one size; at least one has values.
    limits : (float, float)
        Ends of the scale of disparity, pixels per view step.
    light_field : LightField, optional
        For the reference view, and the camera of a point cloud in metres.
    """
    full_height, full_width = next(panel.values.shape for panel in panels if panel.values is not None)
    stride = max(1, math.ceil(math.sqrt(full_height * full_width / _MOST_PIXELS)))
    height, width = -(-full_height // stride), -(-full_width // stride)
    held: _Held = {}
    entries = [_entry(panel, stride, held) for panel in panels]
    picture = None if light_field is None else reference_picture(light_field)[::stride, ::stride]
    return {
        "height": height,
        "width": width,
        "stride": stride,
        "limits": list(limits),
        "error_limit": ERROR_LIMIT,
        "sigma_limits": list(SIGMA_LIMITS),
        "camera": light_field and _camera(light_field),
        "picture": "" if picture is None else picture_uri(picture, "webp", _WEBP),
        "panels": entries,
        "arrays": _all_packed(held, max(_LEAST_PIXELS, height * width)),
    }


def _entry(panel: Panel, stride: int, held: _Held) -> dict[str, Any]:
    """A panel with the numbers of its arrays, without empty fields."""
    entry: dict[str, Any] = {name: getattr(panel, name) for name in ("key", "title", "group", "kind")}
    entry |= {name: text for name in ("note", "ends", "no_interval") if (text := getattr(panel, name))}
    role = {"mask": MASK, "outline": MASK, "confidence": CONFIDENCE, "sigma": LOGARITHM}.get(
        panel.kind, PRECISE if panel.precise else OTHER
    )
    shown = {
        "map": (logarithms(panel.values) if panel.kind == "sigma" and panel.values is not None else panel.values, role),
        "minus": (panel.minus, OTHER),
        "ground_truth": (panel.ground_truth, OTHER),
        "confidence": (panel.confidence, CONFIDENCE),
        **_bars(panel),
    }
    for name, (values, held_for) in shown.items():
        if values is not None:
            thinned: npt.NDArray[Any] = values[::stride, ::stride]
            # reduced before drawing, since borders of one pixel would break
            thinned = outlines(thinned) if panel.kind == "outline" else thinned
            entry[name] = _number(held, thinned, held_for)
    return entry


def _bars(panel: Panel) -> dict[str, tuple[npt.NDArray[Any], int]]:
    """Logarithms of the standard deviation, and of the interval's extent below and above the map as multiples of it.

    These multiples vary little, and take a quarter of the characters of the widths.
    """
    values, bars = panel.values, panel.bars
    if values is None or bars is None or bars.sigma is None or bars.low is None or bars.high is None:
        return {}
    sigma, below, above = (logarithms(widths) for widths in (bars.sigma, values - bars.low, bars.high - values))
    found = {"sigma": sigma, "below": below - sigma, "above": above - sigma}
    return {name: (logarithm, LOGARITHM) for name, logarithm in found.items()}


def _camera(light_field: LightField) -> dict[str, Any] | None:
    camera, centre = light_field.camera, list(light_field.from_centre)
    if camera is None:
        return None
    return {"scale": camera.scale, "offset": camera.offset, "focal": camera.focal_px, "from_centre": centre}
