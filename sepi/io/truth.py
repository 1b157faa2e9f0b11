"""Ground truth apart from the views: what scores are made with, and no stage reads.

A truth file holds ``ground_truth (H, W) float32`` in pixels per view step and ``masks/NAME (H, W)``, both of the light
field's reference view, as far as the scene has any.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from sepi.io.hdf5 import create_hdf5, open_hdf5, put_truth, read_light_field, truth_in
from sepi.lightfield import LightField, Truth


def write_truth(path: Path, truth: Truth) -> None:
    """Write what is known of a scene's reference view; equal content gives equal bytes."""
    with create_hdf5(path) as file:
        put_truth(file, truth)


def read_with_truth(light_field: Path, truth: Path | None) -> LightField:
    """Read a light field and the ground truth that lies apart from it; without a file of that, its own.

    Raises
    ------
    SepiError
        If one of the files is missing or not what it should be, or they do not have the same size.
    """
    found = read_light_field(light_field)
    if truth is None:
        return found
    with open_hdf5(truth, "truth file (written by python -m sepi.truth)") as file:
        ground_truth, masks = truth_in(truth, file)
        return replace(found, ground_truth=ground_truth, masks=masks)
