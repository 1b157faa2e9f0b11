"""A scene as a folder in the layout of the HCI 4D light field benchmark."""

from __future__ import annotations

from collections.abc import Mapping
from configparser import RawConfigParser
from pathlib import Path

import numpy as np

from sepi.errors import SepiError
from sepi.io.disparity_maps import write_pfm
from sepi.io.files import atomic_folder
from sepi.io.images import Pixels, write_png
from sepi.lightfield import FloatMap, LightField, require_light_field
from sepi.validation import require_path

# A fictitious camera with the benchmark's numbers. A disparity of d pixels is a depth of 36.57 / (d + 8.605) metres,
# finite for all disparities of the scenes; the baseline scales with the image to preserve this.
CAMERA = {"focal_length_mm": 100.0, "sensor_size_mm": 35.0, "focus_distance_m": 4.25}
BASELINE_MM_AT_512 = 25.0


def write_hci(
    light_field: LightField,
    folder: str | Path,
    camera: Mapping[str, float] | None = None,
    maps: Mapping[str, FloatMap] | None = None,
) -> None:
    """Write a scene as an HCI 4D benchmark folder, atomically.

    The folder contains ``input_CamNNN.png`` (number ``S * t + s``), ``parameters.cfg`` and, if known,
    ``gt_disp_lowres.pfm`` and one ``mask_NAME.png`` per mask (white inside).

    Parameters
    ----------
    light_field : LightField
        As returned by :func:`sepi.scenes.render`: all views present, uint8 or uint16 RGB, with a disparity range and
        with equal spacing of rows and columns, since the layout has only one baseline.
    folder : str or Path
        Must be empty or not exist.
    camera : mapping of str to float, optional
        ``focal_length_mm``, ``baseline_mm``, ``focus_distance_m`` and ``sensor_size_mm``; default: a fictitious camera.
    maps : mapping of str to ndarray, shape (H, W), float32, optional
        Further maps to write, by file name without ``.pfm``.

    Raises
    ------
    SepiError
        If rows and columns of views differ in spacing, views lie off the grid, or the folder cannot be written.

    Examples
    --------
    >>> from pathlib import Path
    >>> import sepi
    >>> from sepi.scenes import render, write_hci
    >>> write_hci(render("dots", size=64, views=3), Path("scenes/dots"))
    >>> sorted(path.name for path in Path("scenes/dots").iterdir())[:3]
    ['gt_disp_lowres.pfm', 'input_Cam000.png', 'input_Cam001.png']
    >>> light_field = sepi.read_light_field("scenes/dots")
    >>> light_field.disparity_range.source, light_field.camera is not None
    ('parameters', True)
    """
    require_light_field(light_field)
    folder = require_path("folder of the light field", folder)
    if light_field.row_spacing != 1 or light_field.positions is not None:
        raise SepiError(f"{light_field.name}: the layout of the HCI benchmark needs views on a grid of even spacing")
    with atomic_folder(folder) as temporary:
        kind: type[np.unsignedinteger] = np.uint16 if light_field.views.dtype == np.uint16 else np.uint8
        views: Pixels = light_field.views.astype(kind, copy=False)
        for number, view in enumerate(views.reshape(-1, *light_field.shape, 3)):
            write_png(temporary / f"input_Cam{number:03d}.png", view)
        with (temporary / "parameters.cfg").open("w", encoding="utf-8") as file:
            _settings(light_field, camera).write(file)
        if light_field.ground_truth is not None:
            write_pfm(temporary / "gt_disp_lowres.pfm", light_field.ground_truth)
        for name, values in (maps or {}).items():
            write_pfm(temporary / f"{name}.pfm", values)
        for name, mask in light_field.masks.items():
            write_png(temporary / f"mask_{name}.png", mask)


def _settings(light_field: LightField, camera: Mapping[str, float] | None) -> RawConfigParser:
    """Content of ``parameters.cfg``."""
    height, width = light_field.shape
    rows, columns = light_field.grid
    known = light_field.require_disparity_range()
    camera = camera or {**CAMERA, "baseline_mm": BASELINE_MM_AT_512 * 512 / max(width, height)}
    settings = RawConfigParser()
    settings.read_dict(
        {
            "intrinsics": {
                "focal_length_mm": camera["focal_length_mm"],
                "image_resolution_x_px": width,
                "image_resolution_y_px": height,
                "sensor_size_mm": camera["sensor_size_mm"],
                "fstop": 100.0,
            },
            "extrinsics": {
                "num_cams_x": columns,
                "num_cams_y": rows,
                "baseline_mm": camera["baseline_mm"],
                "focus_distance_m": camera["focus_distance_m"],
                **{f"center_cam_{key}": 0.0 for key in ("x_m", "y_m", "z_m", "rx_rad", "ry_rad", "rz_rad")},
            },
            "meta": {
                "scene": light_field.name,
                "category": light_field.source,
                "disp_min": known.minimum,
                "disp_max": known.maximum,
                "depth_map_scale": 1.0,
            },
        }
    )
    return settings
