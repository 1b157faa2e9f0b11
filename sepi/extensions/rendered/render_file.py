"""Files of path-traced light fields: linear light, ground truth and masks of every view.

An HDF5 file holds ``views (T, S, H, W, 3) float16`` (linear, 1 is white), ``disparity (T, S, H, W) float32`` (pixels
per view step, at pixel centres), ``normal (T, S, H, W, 3) float16`` (right, down, away), ``masks (T, S, H, W) uint16``
(bits in the order of its attribute ``names``), ``positions (T, S, 2) float64`` (view steps), ``turns (T, S, 3)
float64`` (radians), and attributes with the scene, the camera and the options.

A pixel shows the surface that the ray through its middle meets first. Masks tell the kinds of surfaces, depth steps,
and which other views see them.
"""

import json
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from sepi.extensions.rendered.surfaces import FirstSurface, raster_of
from sepi.extensions.rendered.world import FloatArray, Thing
from sepi.io.hdf5 import attribute, create_hdf5, fixed_text, open_hdf5, read_dataset
from sepi.kernels import reprojection as kernels
from sepi.lightfield import BoolMap, FloatMap
from sepi.scoring.regions import edges_of, textureless

MASKS = ("textured", "textureless", "glossy", "mirror", "glass", "thin", "discontinuities", "occluded", "alone")
"""Names of the masks.

Textured and textureless: matte or glossy surfaces with and without a change of the painted colours
(:func:`sepi.scoring.regions.textureless` on colours without light); glossy, mirror, glass: surfaces of these kinds;
thin: wires, sticks, twigs; discontinuities: two pixels beside a depth step; occluded: hidden from another view; alone:
seen by no other view.
"""

Bits = npt.NDArray[np.uint16]

_BIT = {name: 1 << number for number, name in enumerate(MASKS)}

# largest difference of disparities of one surface, pixels per view step
_SAME = 0.05


def albedo_of(things: Sequence[Thing], seen: FirstSurface) -> FloatArray:
    """Colours of a view's surfaces without light, sRGB; shape (H, W, 3)."""
    colours = np.zeros((*seen.thing.shape, 3), np.float32)
    for number in np.unique(seen.thing[seen.thing >= 0]).tolist():
        raster, here = raster_of(things[number].material.pattern), seen.thing == number
        size = np.array(raster.shape[:2], np.int64)
        row, column = ((seen.uv[here][:, ::-1] % 1 * size).astype(np.int64) % size).T
        colours[here] = raster[row, column]
    return colours


def surface_bits(things: Sequence[Thing], seen: FirstSurface, disparity: FloatMap) -> Bits:
    """Masks of a view that do not depend on other views: kinds of surfaces, and depth steps."""
    kinds = np.array([thing.material.kind for thing in things] + ["matte"])[seen.thing]
    thin = np.array([thing.thin for thing in things] + [False])[seen.thing]
    plain = textureless(albedo_of(things, seen))
    solid = (kinds == "matte") | (kinds == "glossy")
    masks = {"textured": solid & ~plain, "textureless": solid & plain, "thin": thin}
    masks |= {kind: kinds == kind for kind in ("glossy", "mirror", "glass")}
    masks["discontinuities"] = edges_of(disparity).region
    return np.asarray(np.bitwise_or.reduce([mask.astype(np.uint16) * _BIT[name] for name, mask in masks.items()]))


def seen_bits(disparities: FloatArray, positions: npt.NDArray[np.float64]) -> Bits:
    """Masks ``occluded`` and ``alone`` of all views, ``(N, H, W)``.

    Parameters
    ----------
    disparities : ndarray, shape (N, H, W), float32
        Disparity of all views, pixels per view step.
    positions : ndarray, shape (N, 2), float64
        Positions of the views, ``(down, across)`` in view steps.
    """
    bits = np.empty(disparities.shape, np.uint16)
    hidden, seen = np.empty((2, *disparities.shape[1:]), bool)
    for view in range(len(disparities)):
        kernels.seen_elsewhere(disparities, positions - positions[view], view, _SAME, hidden, seen)
        bits[view] = hidden * np.uint16(_BIT["occluded"]) + ~seen * np.uint16(_BIT["alone"])
    return bits


def masks_in(bits: Bits) -> dict[str, BoolMap]:
    """A view's masks by name."""
    return {name: np.asarray(bits & _BIT[name], bool) for name in MASKS}


# the arrays of a file, and the names of their axes
_ARRAYS = {"views": "t s y x channel", "disparity": "t s y x", "normal": "t s y x (right, down, away)"}
_ARRAYS |= {"masks": "t s y x", "positions": "", "turns": ""}


@dataclass(frozen=True)
class Render:
    """A path-traced light field.

    Attributes
    ----------
    name : str
        Name of the scene.
    views : ndarray, shape (T, S, H, W, 3), float16
        Linear light; 1 is white.
    disparity : ndarray, shape (T, S, H, W), float32
        Disparity of the first surface at the middle of each pixel, pixels per view step.
    normal : ndarray, shape (T, S, H, W, 3), float16
        Normal of that surface, towards the camera: right, down, away.
    masks : ndarray, shape (T, S, H, W), uint16
        Bits, in the order of :data:`sepi.extensions.rendered.render_file.MASKS`.
    positions : ndarray, shape (T, S, 2), float64
        Positions of the views from the centre view, ``(down, across)`` in view steps.
    turns : ndarray, shape (T, S, 3), float64
        Rotations of the views about x, y and z, radians.
    settings : mapping of str to float
        ``focal_length_mm``, ``baseline_mm``, ``focus_distance_m``, ``sensor_size_mm``.
    light : float
        Light of the scene relative to other scenes.
    made_by : mapping
        Record of the scene's options and versions.
    """

    name: str
    views: npt.NDArray[np.float16]
    disparity: npt.NDArray[np.float32]
    normal: npt.NDArray[np.float16]
    masks: npt.NDArray[np.uint16]
    positions: npt.NDArray[np.float64]
    turns: npt.NDArray[np.float64]
    settings: dict[str, float]
    light: float = 1.0
    made_by: dict[str, Any] = field(default_factory=dict)

    @property
    def centre(self) -> tuple[int, int]:
        """Grid position of the reference view."""
        return self.views.shape[0] // 2, self.views.shape[1] // 2


def write_render(path: Path, render: Render) -> None:
    """Write a render, whole or not at all; equal content gives equal bytes."""
    with create_hdf5(path) as file:
        for name, axes in _ARRAYS.items():
            # worth while for masks only
            compression = "gzip" if name == "masks" else None
            file.create_dataset(name, data=getattr(render, name), compression=compression)
            if axes:
                file[name].attrs["axes"] = axes
        file["masks"].attrs["names"] = [fixed_text(name) for name in MASKS]
        file["disparity"].attrs["units"] = "pixels per view step"
        file.attrs["render"] = fixed_text(render.name)
        file.attrs["light"] = render.light
        for key in ("settings", "made_by"):
            file.attrs[key] = fixed_text(json.dumps(getattr(render, key), sort_keys=True))


def read_render(path: Path) -> Render:
    """The render in a file.

    Raises
    ------
    SepiError
        If the file is not a render, or damaged.
    """
    with open_hdf5(path, "render of a scene") as file:
        arrays: dict[str, Any] = {name: read_dataset(path, file[name]) for name in _ARRAYS}
        told: dict[str, Any] = {key: json.loads(attribute(file, key)) for key in ("settings", "made_by")}
        return Render(name=str(attribute(file, "render")), light=float(attribute(file, "light")), **arrays, **told)


def read_truth(path: Path, **_: object) -> tuple[FloatMap, dict[str, BoolMap]]:
    """Disparity and masks of a render's reference view, read without its pictures."""
    with open_hdf5(path, "render of a scene") as file:
        centre = tuple(count // 2 for count in file["disparity"].shape[:2])
        bits = read_dataset(path, file["masks"], centre)
        return read_dataset(path, file["disparity"], centre), masks_in(bits)
