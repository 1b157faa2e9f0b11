"""Samples of pixels with cues and errors, for fitting and evaluating the error model."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
import numpy.typing as npt

from bench.noisy import few_views, with_noise
from bench.sweep import scene_for_choosing
from sepi.error_bars.bars import error_bars
from sepi.error_bars.calibration import SECOND_ORDER, WLS, Calibration
from sepi.extensions.rendered.exposure import read_scene
from sepi.io.hdf5 import has_dataset
from sepi.lightfield import LightField
from sepi.pipeline import estimate_depth
from sepi.stage import REACH
from sepi.workflow.rendered_scenes import NOISE_LEVELS, rendered_scene

PIXELS = 6000
"""Number of random pixels per map."""

CALIBRATIONS: dict[str, Calibration] = {"second_order": SECOND_ORDER, "wls": WLS}
"""Choice of the last stage to its calibration."""


@dataclass(frozen=True)
class Sample:
    """Pixels of a map, in units in which the farthest view is four view steps away.

    Attributes
    ----------
    name, world, variant : str
        Name of the light field, including its noise; of the scene without it; of the map's variant.
    error : ndarray, shape (N,)
        Ground truth minus map.
    cues : dict of str to ndarray, shape (N,)
        Cues of :mod:`sepi.error_bars.cues`.
    step : float
        Rounding step of the ground truth.
    """

    name: str
    world: str
    variant: str
    error: npt.NDArray[np.float64]
    cues: dict[str, npt.NDArray[np.float64]]
    step: float


def light_fields(
    scenes: Iterable[str], sigmas: Sequence[float], held_out: bool = False, grids: Iterable[tuple[int, int]] = ()
) -> Iterator[tuple[str, LightField]]:
    """Light fields and names: built-in scenes, ``street:SEED`` and folders with the given noise, renders at all levels.

    All but renders also as so many rows and columns of views from the reference view on.

    Raises
    ------
    SepiError
        If a scene is not a light field, has no ground truth, or is held out from choosing without being requested.
    """
    for scene in scenes:
        if has_dataset(Path(scene), "turns"):
            for level in NOISE_LEVELS:
                light_field = read_scene(Path(scene), level, 1) if held_out else scene_for_choosing(scene, level)
                yield light_field.name, light_field
            continue
        light_field = scene_for_choosing(scene, NOISE_LEVELS[0])
        for sigma in sigmas:
            noisy = with_noise(light_field, sigma) if sigma else light_field
            name = f"{light_field.name} + {sigma:g}" if sigma else light_field.name
            yield name, noisy
            for rows, columns in grids:
                yield f"{name} + {rows}x{columns}", few_views(noisy, rows, columns)


def sample(light_field: LightField, name: str, variant: str, step: float = 0.0, kept: Path | None = None) -> Sample:
    """Sample of a variant's map of a light field; ground truth is rounded to ``step`` in the light field's view steps.

    With a folder ``kept``, samples are stored there and reused.
    """
    world = rendered_scene(name.partition(" +")[0]).world
    factor = REACH / light_field.reach
    file = None
    if kept is not None:
        # a rendered scene and a folder may have the same name
        views = hashlib.sha256(repr((name, light_field.grid, light_field.shape)).encode()).hexdigest()
        file = kept / f"{variant}_{views[:16]}.npz"
    if file is not None and file.exists():
        with np.load(file) as found:
            error, cues = found["error"], {key: found[key] for key in found if key != "error"}
    else:
        error, cues = _computed(light_field, variant, factor)
        if file is not None:
            file.parent.mkdir(parents=True, exist_ok=True)
            np.savez(file, error=error, **cues)
    wide = {key: values.astype(np.float64) for key, values in cues.items()}
    return Sample(name, world, variant, error.astype(np.float64), wide, step / factor)


def _computed(light_field: LightField, variant: str, factor: float) -> tuple[Any, dict[str, Any]]:
    told: dict[str, Any] = {}

    def listened(disparity: Any, cues: Any, known: Any, calibration: Calibration) -> dict[str, Any]:
        told.update(cues, disparity=disparity)
        return error_bars(disparity, cues, known, calibration)

    with patch("sepi.optimize.error_bars", listened):
        maps = estimate_depth(light_field, variant)
    assert light_field.ground_truth is not None
    disparity = told.pop("disparity")
    error = light_field.ground_truth / np.float32(factor) - disparity
    pixels = np.flatnonzero(np.isfinite(error) & ~maps.mask("unknown"))
    chosen = np.random.default_rng(0).permutation(pixels)[:PIXELS]
    return error.ravel()[chosen], {key: values.ravel()[chosen] for key, values in told.items()}
