"""
Missing views
=============

Not every light field is a full square of views. A camera array may be a cross
or a single row; a lens leaves the corner views dark; a file is damaged.
``sepi`` needs to be told which views exist, and computes with those.
"""

# sphinx_gallery_thumbnail_number = 2
from dataclasses import replace

import matplotlib.pyplot as plt
import numpy as np

import sepi
from sepi.scenes import render
from sepi.scoring.scores import score

light_field = render("pencils", size=128, views=9)
truth = light_field.ground_truth

# %%
# Say which views exist
# ---------------------
#
# ``present`` is a mask over the grid. Files that are read from disk have it
# filled in: what is not there is missing, and
# ``sepi.ReadOptions(exclude=...)`` leaves out more. Here we make four arrays
# of cameras out of one.

t, s = np.mgrid[:9, :9]
arrays = {
    "all": np.ones((9, 9), bool),
    "star": (t == 4) | (s == 4) | (t == s) | (t + s == 8),
    "cross": (t == 4) | (s == 4),
    "row": t == 4,
}
figure, axes = plt.subplots(1, 4, figsize=(6, 2), layout="constrained")
for axis, (name, present) in zip(axes, arrays.items(), strict=True):
    axis.imshow(present, cmap="gray_r", vmin=0, vmax=1.5)
    axis.set(title=f"{name}: {present.sum()}", xticks=[], yticks=[])
plt.show()

# %%
# Depth from fewer views
# ----------------------
#
# A pixel counts as wrong when it is off by more than 0.07 px / step. A star of
# 33 views does as well as all 81: its views reach as far, and in more
# directions than two. With fewer views there is less to average the noise
# with, and beside a pencil a pixel of the row is seen by half a row at best.

figure, axes = plt.subplots(2, 2, figsize=(6, 5.8), layout="constrained")
bad = {}
for axis, (name, present) in zip(axes.flat, arrays.items(), strict=True):
    fewer = replace(light_field, present=present)
    disparity = sepi.estimate_depth(fewer).disparity
    bad[name] = score(disparity, truth)["badpix007"]
    print(f"{name:5s} {present.sum():2d} views: {bad[name]:5.2f} % wrong")
    image = axis.imshow(np.abs(disparity - truth), vmax=0.2, cmap="magma")
    axis.set_title(name)
    axis.set_axis_off()
figure.colorbar(
    image, ax=axes, label="error / (px / step)", extend="max", shrink=0.6
)
plt.show()

# %%
# A damaged view is worse than a missing one
# ------------------------------------------
#
# Let the left four columns and the upper two rows of views be black, as behind
# a hand, without saying so: then more than half of all samples are wrong. Said
# to be missing, they do less harm.

hand = (s < 4) | (t < 2)
views = light_field.views.copy()
views[hand] = 0
damaged = replace(light_field, views=views)
told = replace(damaged, present=~hand)
for name, one in {"black, not told": damaged, "black, told": told}.items():
    bad[name] = score(sepi.estimate_depth(one).disparity, truth)["badpix007"]
    print(f"{name:16s} {bad[name]:5.2f} % wrong")
