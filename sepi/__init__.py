"""Light field depth by stitched epipolar plane images.

Examples
--------
A built-in scene takes the place of your own light field; :func:`sepi.read_light_field` reads all known formats.

>>> from pathlib import Path
>>> import sepi
>>> from sepi.scenes import render, write_hci
>>> write_hci(render("pyramids", size=64, views=3), Path("pyramids"))
>>> light_field = sepi.read_light_field("pyramids")
>>> maps = sepi.estimate_depth(light_field)
>>> maps.disparity.shape, maps.disparity.dtype.name  # pixels per view step
((64, 64), 'float32')
>>> files = sepi.write_result("pyramids-depth", light_field, maps)
>>> "disparity.pfm" in files
True
"""

from __future__ import annotations

import importlib
from importlib.machinery import PathFinder
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from sepi.camera import Camera as Camera
    from sepi.errors import SepiError as SepiError
    from sepi.errors import SepiWarning as SepiWarning
    from sepi.extensions.cameras.reader import read_cameras as read_cameras
    from sepi.extensions.views.all_views import AllViews as AllViews
    from sepi.extensions.views.all_views import estimate_all_views as estimate_all_views
    from sepi.extensions.views.refocusing import all_in_focus as all_in_focus
    from sepi.extensions.views.refocusing import refocus as refocus
    from sepi.io.readers.options import ReadOptions as ReadOptions
    from sepi.io.result_folder import read_result as read_result
    from sepi.io.result_folder import write_result as write_result
    from sepi.lightfield import DisparityRange as DisparityRange
    from sepi.lightfield import LightField as LightField
    from sepi.pipeline import estimate_depth as estimate_depth
    from sepi.reading import read_light_field as read_light_field
    from sepi.stage import StageMaps as StageMaps

    __version__: str
    """Version of the installed package; ``"unknown"`` in a source tree that was never installed.

    Examples
    --------
    State it with your results: maps of two versions may differ.

    >>> import sepi
    >>> f"sepi {sepi.__version__}"  # doctest: +ELLIPSIS
    'sepi ...'
    """

_HOME = {
    "Camera": "sepi.camera",
    "DisparityRange": "sepi.lightfield",
    "LightField": "sepi.lightfield",
    "ReadOptions": "sepi.io.readers.options",
    "SepiError": "sepi.errors",
    "SepiWarning": "sepi.errors",
    "StageMaps": "sepi.stage",
    "estimate_depth": "sepi.pipeline",
    "read_light_field": "sepi.reading",
    "read_result": "sepi.io.result_folder",
    "write_result": "sepi.io.result_folder",
}
__all__ = [*_HOME, "__version__"]


def __getattr__(name: str) -> Any:
    # on first use: the pipeline imports every stage, and `sepi --help` and single stages do not need it
    if name == "__version__":
        from sepi.io.provenance import package_version

        return package_version()
    if name in _HOME:
        return getattr(importlib.import_module(_HOME[name]), name)
    # asked for a submodule, too, before it is imported
    if not name.startswith("_") and PathFinder.find_spec(f"{__name__}.{name}", __path__) is None:
        from sepi.registry import added

        if name in added("names"):
            return getattr(importlib.import_module(added("names")[name]), name)
    raise AttributeError(f"module 'sepi' has no attribute '{name}'")


def __dir__() -> list[str]:
    from sepi.registry import added

    return sorted([*__all__, *added("names")])
