"""Built-in scenes seen by cameras of any pose and lens.

The world's axes are those of a camera at the scene's centre view: x to the right, y down, z forward;
:class:`sepi.camera.Camera` converts its disparities to depth. Rays are traced to the scene's planes, so that images and
depth are exact for every pose and distortion.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from sepi.camera import Camera
from sepi.camera.rig import Shot
from sepi.kernels import rendering as kernels
from sepi.lightfield import FloatMap
from sepi.scenes.light_field import drawn
from sepi.scenes.rendering import boxes_round

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
    depth = met(1)[0].reshape(shape).astype(np.float32)
    return Posed(np.round(np.clip(mean, 0, 1) * 255).astype(np.uint8), depth)
