"""A built-in scene as a light field, and as seen by cameras of any pose and lens.

The world's axes are those of a camera at the scene's centre view: x to the right, y down, z forward;
:class:`sepi.camera.Camera` converts its disparities to depth. Rays of such a camera are traced to the scene's planes,
so that images and depth are exact for every pose and distortion.
"""

from __future__ import annotations

import math
import zlib
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from sepi.camera import Camera
from sepi.camera.rig import Shot
from sepi.errors import SepiError
from sepi.kernels import rendering as kernels
from sepi.lightfield import DisparityRange, FloatMap, LightField, Truth
from sepi.scenes.definitions import DEFINITIONS
from sepi.scenes.rendering import Drawing, boxes_round, drawing, occluded, render_view, visible
from sepi.validation import require_known

SMALLEST, LARGEST = 64, 1024
MOST_VIEWS = 17
# Margin of a scene's disparity range around its surfaces, and the range's minimum width, so that even a scene of one
# plane needs a search.
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
        Width and height of each view in pixels, 64 to 1024. Shapes scale with it; disparities and the scale of the
        textures do not.
    views : int
        Rows and columns of the view grid, 2 to 17.
    row_spacing : float
        Distance between rows of views in view steps.
    positions : ndarray, shape (views, views, 2), float64, optional
        Position of each view, ``(down, across)`` in view steps; default: the grid.

    Returns
    -------
    LightField
        Views uint8 RGB; exact disparity of the surface at each pixel centre as ``ground_truth``; the masks ``occluded``
        (the point is hidden by a nearer surface in at least one view) and ``textureless`` (the surface has no texture
        from which to estimate depth). Equal arguments give equal bytes.

    Raises
    ------
    SepiError
        If there is no such scene, size or views is out of bounds, or row spacing or positions are invalid.

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


def read_scene(name: str | Path, size: int = 192, views: int = 9) -> LightField:
    """The light field of :func:`render`, for a job of the workflow."""
    return render(str(name), size=size, views=views)


def read_truth(name: str | Path, size: int = 192, views: int = 9) -> Truth:
    """Ground truth and masks of the light field of :func:`render`, without drawing its views."""
    _, light_field = _with_truth(str(name), size, views, textured=False)
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
    """The drawing, with or without textures, and the light field without its views."""
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
    """Exact disparity of a built-in scene in an arbitrary view.

    Parameters
    ----------
    name : str
        A key of ``sepi.scenes.SCENES``.
    size : int
        Width and height of each view in pixels, as in :func:`render`.
    baseline : (float, float)
        Position of the view relative to the centre view, ``(down, across)`` in view steps, as in the ``baselines`` of
        the light field.

    Returns
    -------
    ndarray, shape (size, size), float32
        Disparity of the nearest surface at each pixel centre, pixels per view step; for a zero baseline, the
        ``ground_truth`` of :func:`render`.

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
    """A scene's surfaces, cached since making the textures takes longer than drawing a view."""
    _require_scene(name, size)
    return drawing(DEFINITIONS[name].surfaces(), size)


def _require_scene(name: str, size: int) -> None:
    require_known("built-in scenes", [name], DEFINITIONS)
    _require_whole(name, "size", size, SMALLEST, LARGEST)


def _require_whole(name: str, what: str, value: int, least: int, most: int) -> None:
    if type(value) is not int or not least <= value <= most:
        raise SepiError(f"scene {name}: {what} must be a whole number from {least} to {most}, got {value!r}")


def _range_around(disparity: npt.NDArray[np.float64]) -> DisparityRange:
    """Bounds with a margin on both sides, rounded outward to tenths."""
    low, high = float(disparity.min()), float(disparity.max())
    middle = (low + high) / 2
    low, high = min(low - MARGIN, middle - LEAST_WIDTH / 2), max(high + MARGIN, middle + LEAST_WIDTH / 2)
    # rounding first keeps bounds that equal a tenth up to floating-point error
    return DisparityRange(math.floor(round(10 * low, 6)) / 10, math.ceil(round(10 * high, 6)) / 10, "parameters")


# sub-samples per pixel and direction
_SAMPLES = 4


class Posed(NamedTuple):
    """Image and depth of a camera.

    Attributes
    ----------
    picture : ndarray, shape (H, W, 3), uint8
    depth : ndarray, shape (H, W), float32
        Along the camera's axis at pixel centres, in units of the scene's camera; infinite where there is no surface.
    """

    picture: npt.NDArray[np.uint8]
    depth: FloatMap


def render_shot(name: str, shot: Shot, *, camera: Camera, size: int = 192) -> Posed:
    """Render a built-in scene as seen by a camera of any pose and lens.

    Parameters
    ----------
    name : str
        A key of ``sepi.scenes.SCENES``; sensor noise is not added.
    shot : Shot
        The camera, in the axes of the camera at the scene's centre view.
    camera : Camera
        Converts the scene's disparities to depth.
    size : int
        Width and height of the scene's centre view in pixels, as in :func:`sepi.scenes.render`.

    Returns
    -------
    Posed
        Image, and depth along the camera's axis.

    Raises
    ------
    SepiError
        If there is no such scene, or size is out of bounds.

    Examples
    --------
    A camera one view step to the right of the centre sees the same as the view there:

    >>> import numpy as np
    >>> from sepi import Camera
    >>> from sepi.camera.rig import Lens, Shot
    >>> from sepi.scenes import render, render_shot
    >>> camera = Camera(scale=10.0, offset=0.0, focal_px=100.0)
    >>> lens = Lens(64, 64, (100.0, 100.0), (31.5, 31.5))
    >>> right = Shot("right", lens, np.eye(3), np.array([0.1, 0.0, 0.0]))
    >>> seen = render_shot("fronto_parallel", right, camera=camera, size=64)
    >>> views = render("fronto_parallel", size=64, views=3).views
    >>> int(abs(seen.picture.astype(int) - views[1, 2]).max()), float(seen.depth[0, 0])
    (0, 10.0)
    """
    scene = drawn(name, size)
    middle = (size - 1) / 2
    a, b, c = scene.planes.T
    across, down = camera.focal_px * b, camera.focal_px * c
    normals = np.column_stack([across, down, a + camera.offset + (b + c) * middle]) / camera.scale
    boxes, pinhole = boxes_round(scene), np.array([camera.focal_px, middle, middle])

    def met(samples: int) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
        """Depths and colours hit by rays, for a number of samples per pixel and direction."""
        y, x = (np.indices((shot.lens.height * samples, shot.lens.width * samples)) + 0.5) / samples - 0.5
        rays = shot.lens.rays(np.column_stack([x.ravel(), y.ravel()])) @ shot.rotation
        depths, colours = np.empty(len(rays)), np.empty((len(rays), 3))
        origin = np.ascontiguousarray(shot.centre, np.float64)
        kernels.cast(scene, boxes, normals, origin, rays, pinhole, depths, colours)
        return depths, colours

    shape = shot.lens.height, shot.lens.width
    mean = met(_SAMPLES)[1].reshape(shape[0], _SAMPLES, shape[1], _SAMPLES, 3).mean(axis=(1, 3))
    # rays have z = 1, so that their lengths are depths
    return Posed(np.round(np.clip(mean, 0, 1) * 255).astype(np.uint8), met(1)[0].reshape(shape).astype(np.float32))
