"""Ground truth in a file apart from the views: only scores use it, no stage reads it.

A truth file holds ``ground_truth (H, W) float32`` in pixels per view step and ``masks/NAME (H, W)`` of the light
field's reference view, if the scene has them.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from sepi.io.hdf5 import create_hdf5, open_hdf5, put_truth, read_light_field, truth_in
from sepi.lightfield import LightField, Truth


def write_truth(path: Path, truth: Truth) -> None:
    """Write the ground truth and masks of a scene; equal content gives equal bytes."""
    with create_hdf5(path) as file:
        put_truth(file, truth)


def read_with_truth(light_field: Path, truth: Path | None) -> LightField:
    """Light field with the ground truth from a truth file; without that file, with its own.

    Raises
    ------
    SepiError
        If a file is missing or of another kind, or they differ in size.
    """
    found = read_light_field(light_field)
    if truth is None:
        return found
    with open_hdf5(truth, "truth file (written by python -m sepi.truth)") as file:
        ground_truth, masks = truth_in(truth, file)
        return replace(found, ground_truth=ground_truth, masks=masks)
