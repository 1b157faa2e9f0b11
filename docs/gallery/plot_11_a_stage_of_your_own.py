"""
A stage of your own
===================

The method is four stages: ``initial`` makes a first map, ``occlusion`` and
``textureless`` mend it, ``optimize`` smooths it. Each has several choices, and
a variant names one of each. In twenty lines we add a choice, and see what it
is worth.
"""

from dataclasses import replace

import matplotlib.pyplot as plt
import numpy as np
from pydantic import Field
from scipy import ndimage

import sepi
from sepi.scenes import render
from sepi.scoring.scores import score
from sepi.stage import Choice, Parameters
from sepi.variants import Variant, add_choice

# %%
# The idea
# --------
#
# Instead of a global optimisation, take doubtful pixels from their nearest
# sure neighbour, and smooth a little by a median.
#
# A stage is a function of the light field, the maps of the stage before, its
# parameters, and a callback that is told the fraction done. It returns new
# maps. Its parameters are a class with defaults, bounds and descriptions, so
# that a wrong value is told in one line. It never sees the ground truth.


class FillParameters(Parameters):
    """What our stage can be told."""

    doubtful: float = Field(
        0.1,
        ge=0,
        le=1,
        description="share of the pixels that are replaced",
    )
    window: int = Field(
        5, ge=1, le=15, description="side of the median's window, pixels"
    )


def fill(light_field, previous, parameters, progress):
    """Doubtful pixels from the nearest sure one, then a median."""
    sure = previous.confidence >= np.quantile(
        previous.confidence, parameters.doubtful
    )
    nearest = ndimage.distance_transform_edt(
        ~sure, return_distances=False, return_indices=True
    )
    progress(0.5)
    filled = ndimage.median_filter(
        previous.disparity[tuple(nearest)], parameters.window
    )
    return previous.updated(filled, previous.confidence, filled=~sure)


add_choice("optimize", "fill", Choice(FillParameters, fill))

# %%
# Three variants
# --------------
#
# The first map alone; with our stage; and with ``wls``, the paper's global
# optimisation. Parameters are checked: see what a window of 99 pixels gives.

alone = Variant(
    initial="sepi", occlusion="none", textureless="none", optimize="none"
)
variants = {
    "first map": alone,
    "fill": replace(alone, optimize="fill"),
    "wls": replace(alone, optimize="wls"),
}

light_field = render("pyramids", size=128, views=7)
try:
    sepi.estimate_depth(
        light_field, variants["fill"], parameters={"optimize": {"window": 99}}
    )
except sepi.SepiError as error:
    refused = str(error)
    print("refused:", refused)

# %%
# Is it better?
# -------------
#
# On the pyramids it is, by far: their slopes are smooth, and doubtful pixels
# are few and single.

truth = light_field.ground_truth
maps = {
    name: sepi.estimate_depth(light_field, variant)
    for name, variant in variants.items()
}
bad = {
    name: score(found.disparity, truth)["badpix007"]
    for name, found in maps.items()
}

figure, axes = plt.subplots(2, 2, figsize=(6, 5.8), layout="constrained")
axes[0, 0].imshow(light_field.reference_view)
axes[0, 0].set_title("centre view")
for axis, (name, found) in zip(axes.flat[1:], maps.items(), strict=True):
    image = axis.imshow(
        np.abs(found.disparity - truth), cmap="magma", vmax=0.2
    )
    axis.set_title(f"{name}: {bad[name]:.1f} % wrong")
for axis in axes.flat:
    axis.set_axis_off()
figure.colorbar(
    image, ax=axes, label="error / (px / step)", extend="max", shrink=0.6
)
plt.show()

# %%
# The masks that a stage returns travel with the maps: here, which pixels were
# filled.

filled = maps["fill"].extra["filled"]
print(f"{100 * filled.mean():.0f} % of the pixels were filled")

# %%
# Is it always better?
# --------------------
#
# One scene is no test. Confidence is low on both sides of an outline, and the
# nearest sure pixel may lie on the wrong one: thin things are eaten. Before a
# stage is kept, it is tried on scenes that are hard for it.

hard = render("pencils", size=128, views=7)
mse = {}
for name, variant in variants.items():
    mse[name] = score(
        sepi.estimate_depth(hard, variant).disparity, hard.ground_truth
    )["mse100"]
    print(f"pencils, {name:10s} MSE x100 {mse[name]:6.1f}")
