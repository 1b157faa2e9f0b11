"""A built-in scene as a light field."""

from __future__ import annotations

import math
import zlib
from dataclasses import replace
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from sepi.errors import SepiError
from sepi.lightfield import DisparityRange, FloatMap, LightField, Truth
from sepi.scenes.definitions import DEFINITIONS
from sepi.scenes.rendering import Drawing, drawing, occluded, render_view, visible
from sepi.validation import require_known

SMALLEST, LARGEST = 64, 1024
MOST_VIEWS = 17
# The range given with a scene reaches this far beyond its surfaces, and is at least this wide, so that a scene of one
# plane still has to be searched.
MARGIN, LEAST_WIDTH = 0.2, 2.0


def render(
    name: str,
    *,
    size: int = 192,
    views: int = 9,
    row_spacing: float = 1.0,
    positions: npt.NDArray[np.float64] | None = None,
) -> LightField:
    """Render a built-in scene.

    Parameters
    ----------
    name : str
        A key of ``sepi.scenes.SCENES``.
    size : int
        Width and height of each view in pixels, 64 to 1024. Shapes grow with it, disparities and the fineness of the
        textures stay.
    views : int
        Rows and columns of the view grid, 2 to 17.
    row_spacing : float
        Distance from one row of views to the next, in view steps.
    positions : ndarray, shape (views, views, 2), float64, optional
        Where each view is taken, ``(down, across)`` in view steps; on the grid unless given.

    Returns
    -------
    LightField
        Views uint8 RGB; exact disparity of the surface at each pixel centre as ``ground_truth``; the masks ``occluded``
        (the point is hidden by a nearer surface in at least one view) and ``textureless`` (the surface carries no
        depth). Equal arguments give equal bytes.

    Raises
    ------
    SepiError
        If there is no such scene, size or views is out of bounds, or row spacing or positions are none of a light
        field.

    Examples
    --------
    >>> from sepi.scenes import render
    >>> light_field = render("pyramids", size=64, views=3)
    >>> light_field.views.shape, light_field.views.dtype.name
    ((3, 3, 64, 64, 3), 'uint8')
    >>> light_field.ground_truth.shape, sorted(light_field.masks)
    ((64, 64), ['occluded', 'textureless'])

    A plane of disparity 1 moves by one pixel from view to view:

    >>> light_field = render("fronto_parallel", size=64, views=3)
    >>> left, right = light_field.views[1, 1], light_field.views[1, 2]
    >>> bool((left[:, 1:] == right[:, :-1]).all())
    True
    """
    scene, light_field = _with_truth(name, size, views, row_spacing, positions)
    baselines = light_field.baselines
    rng = np.random.default_rng(zlib.crc32(name.encode()))
    deviation = np.linspace(*DEFINITIONS[name].pixel_noise, size)[:, None]
    for t, s in np.ndindex(views, views):
        picture = render_view(scene, size, *baselines[t, s]).astype(np.float64)
        if deviation.any():
            picture += deviation * rng.standard_normal(picture.shape)
        light_field.views[t, s] = np.round(np.clip(picture, 0, 1) * 255)
    return light_field


def scene_truth(name: str, size: int, views: int) -> Truth:
    """Ground truth and masks of what :func:`render` makes, without its pictures."""
    _, light_field = _with_truth(name, size, views, textured=False)
    return light_field.ground_truth, light_field.masks


def _with_truth(
    name: str,
    size: int,
    views: int,
    row_spacing: float = 1.0,
    positions: npt.NDArray[np.float64] | None = None,
    *,
    textured: bool = True,
) -> tuple[Drawing, LightField]:
    """What is to be drawn, with textures or only where, and the light field with all but its pictures."""
    _require_scene(name, size)
    _require_whole(name, "views", views, 2, MOST_VIEWS)
    surfaces = DEFINITIONS[name].surfaces()
    scene = drawing(surfaces, size, textured=textured)
    disparity, owner = visible(scene, size)
    light_field = LightField(
        views=np.zeros((views, views, size, size, 3), np.uint8),
        name=name,
        source="built-in",
        disparity_range=_range_around(disparity),
        ground_truth=disparity.astype(np.float32),
        masks={"textureless": np.array([surface.textureless for surface in surfaces])[owner]},
        row_spacing=row_spacing,
        positions=positions,
    )
    masks = {"occluded": occluded(scene, disparity, light_field.baselines), **light_field.masks}
    return scene, replace(light_field, masks=masks)


def true_disparity(name: str, *, size: int = 192, baseline: tuple[float, float] = (0.0, 0.0)) -> FloatMap:
    """Exact disparity of a built-in scene in any view.

    Parameters
    ----------
    name : str
        A key of ``sepi.scenes.SCENES``.
    size : int
        Width and height of each view in pixels, as in :func:`render`.
    baseline : (float, float)
        Of the view from the centre view, ``(down, across)`` in view steps: an entry of the ``baselines`` of the light
        field that :func:`render` makes.

    Returns
    -------
    ndarray, shape (size, size), float32
        Disparity of the nearest surface at each pixel centre, pixels per view step; at a baseline of zero the
        ``ground_truth`` of the light field.

    Raises
    ------
    SepiError
        If there is no such scene or size is out of bounds.

    Examples
    --------
    >>> from sepi.scenes import render, true_disparity
    >>> light_field = render("dots", size=64, views=3)
    >>> bool((true_disparity("dots", size=64) == light_field.ground_truth).all())
    True
    >>> corner = true_disparity("dots", size=64, baseline=light_field.baselines[0, 2])
    >>> corner.shape, bool((corner == light_field.ground_truth).all())
    ((64, 64), False)
    """
    disparity, _ = visible(drawn(name, size), size, *map(float, baseline))
    return disparity.astype(np.float32)


@lru_cache(maxsize=1)
def drawn(name: str, size: int) -> Drawing:
    """A scene's surfaces, kept from view to view: their textures take longer than a view."""
    _require_scene(name, size)
    return drawing(DEFINITIONS[name].surfaces(), size)


def _require_scene(name: str, size: int) -> None:
    require_known("built-in scenes", [name], DEFINITIONS)
    _require_whole(name, "size", size, SMALLEST, LARGEST)


def _require_whole(name: str, what: str, value: int, least: int, most: int) -> None:
    if type(value) is not int or not least <= value <= most:
        raise SepiError(f"scene {name}: {what} must be a whole number from {least} to {most}, got {value!r}")


def _range_around(disparity: npt.NDArray[np.float64]) -> DisparityRange:
    """Bounds in tenths that leave a margin on both sides."""
    low, high = float(disparity.min()), float(disparity.max())
    middle = (low + high) / 2
    low, high = min(low - MARGIN, middle - LEAST_WIDTH / 2), max(high + MARGIN, middle + LEAST_WIDTH / 2)
    # rounding first keeps a bound that is a tenth up to the last bit where it is
    return DisparityRange(math.floor(round(10 * low, 6)) / 10, math.ceil(round(10 * high, 6)) / 10, "parameters")
