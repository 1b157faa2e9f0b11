"""Built-in synthetic light fields with exact ground truth.

Examples
--------
>>> from sepi.scenes import SCENES, render
>>> SCENES["fronto_parallel"]
'one textured plane of disparity exactly 1'
>>> light_field = render("fronto_parallel", size=64, views=3)
>>> float(light_field.ground_truth[10, 20])
1.0
"""

from sepi.scenes.definitions import SCENES
from sepi.scenes.folder import write_hci
from sepi.scenes.light_field import render, render_shot, true_disparity

__all__ = ["SCENES", "render", "render_shot", "true_disparity", "write_hci"]
