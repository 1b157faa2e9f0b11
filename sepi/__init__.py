"""Light field depth by stitched epipolar plane images.

Examples
--------
>>> import sepi
>>> light_field = sepi.read_light_field("cotton")  # doctest: +SKIP
>>> maps = sepi.estimate_depth(light_field)  # doctest: +SKIP
>>> maps.disparity  # (H, W) float32, pixels per view step  # doctest: +SKIP
>>> sepi.write_result("cotton-depth", light_field, maps)  # doctest: +SKIP
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from sepi.applications.all_views import AllViews, estimate_all_views
    from sepi.errors import SepiError, SepiWarning
    from sepi.io.readers.options import ReadOptions
    from sepi.io.result_folder import write_result
    from sepi.lightfield import DisparityRange, LightField
    from sepi.pipeline import estimate_depth
    from sepi.reading import read_light_field

    __version__: str

__all__ = [
    "AllViews",
    "DisparityRange",
    "LightField",
    "ReadOptions",
    "SepiError",
    "SepiWarning",
    "__version__",
    "estimate_all_views",
    "estimate_depth",
    "read_light_field",
    "write_result",
]

_HOME = {
    "AllViews": "sepi.applications.all_views",
    "DisparityRange": "sepi.lightfield",
    "LightField": "sepi.lightfield",
    "ReadOptions": "sepi.io.readers.options",
    "SepiError": "sepi.errors",
    "SepiWarning": "sepi.errors",
    "estimate_all_views": "sepi.applications.all_views",
    "estimate_depth": "sepi.pipeline",
    "read_light_field": "sepi.reading",
    "write_result": "sepi.io.result_folder",
}


def __getattr__(name: str) -> Any:
    # on first use: the pipeline imports every stage, which `sepi --help` and the commands of single stages do without
    if name == "__version__":
        from sepi.io.provenance import package_version

        return package_version()
    if name in _HOME:
        return getattr(importlib.import_module(_HOME[name]), name)
    raise AttributeError(f"module 'sepi' has no attribute '{name}'")


def __dir__() -> list[str]:
    return __all__
