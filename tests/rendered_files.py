"""Files as the renderer writes them, without it: of built-in scenes, drawn at once."""

from pathlib import Path

import numpy as np

from sepi.extensions.rendered.render_file import MASKS, Render, write_render
from sepi.scenes import render

CAMERA = {"focal_length_mm": 100.0, "baseline_mm": 25.0, "focus_distance_m": 4.25, "sensor_size_mm": 35.0}


def write_drawn(path: Path, name: str, builtin: str = "dots", size: int = 64, views: int = 3) -> None:
    """A rendered scene's file with light and truth of a built-in one; its upper quarter is called glossy."""
    drawn = render(builtin, size=size, views=views)
    masks = {**drawn.masks, "textured": ~drawn.masks["textureless"], "glossy": np.arange(size)[:, None] < size // 4}
    bits = sum((masks[mask].astype(np.uint16) << bit for bit, mask in enumerate(MASKS) if mask in masks), np.uint16(0))
    grid = (views, views)
    truth = np.broadcast_to(drawn.ground_truth, (*grid, size, size))
    write_render(
        path,
        Render(
            name,
            ((drawn.views / 255) ** 2.2).astype(np.float16),
            truth,
            np.zeros((*truth.shape, 3), np.float16),
            np.broadcast_to(np.uint16(bits), truth.shape),
            np.stack(np.meshgrid(*[np.arange(views) - views // 2.0] * 2, indexing="ij"), axis=-1),
            np.zeros((*grid, 3)),
            CAMERA,
        ),
    )
