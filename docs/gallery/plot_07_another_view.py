"""
Depth of another view
=====================

The map belongs to the centre view unless another one is asked for. Two maps of
the same scene can check each other: a point has the same disparity in every
view that sees it.
"""

import matplotlib.pyplot as plt
import numpy as np

import sepi
from sepi.scenes import render

light_field = render("curved_occluders", size=128, views=7)
corner = light_field.seen_from((0, 0))
print(
    "reference view:",
    light_field.reference_position,
    "and",
    corner.reference_position,
)

# %%
# ``seen_from`` changes the reference view and nothing else: the pictures are
# the same, and not copied. All distances between views, ``baselines``, now
# count from the corner. (Files: ``sepi.ReadOptions(view=(0, 0))``.)

centre_map = sepi.estimate_depth(light_field).disparity
corner_map = sepi.estimate_depth(corner).disparity
figure, axes = plt.subplots(2, 2, figsize=(6, 5.8), layout="constrained")
axes[0, 0].imshow(light_field.reference_view)
axes[0, 1].imshow(corner.reference_view)
for axis, disparity in zip(axes[1], (centre_map, corner_map), strict=True):
    image = axis.imshow(
        disparity, vmin=centre_map.min(), vmax=centre_map.max(), cmap="viridis"
    )
axes[0, 0].set_title("centre view")
axes[0, 1].set_title("view (0, 0)")
for axis in axes.flat:
    axis.set_axis_off()
figure.colorbar(image, ax=axes[1, :], label="px / step", shrink=0.85)
plt.show()

# %%
# Do they agree?
# --------------
#
# A pixel of the corner view with disparity *d* lies in the centre view at its
# own place minus *d* times the baseline from the corner to the centre. We look
# up the centre's map there. Where the two disparities differ, one of them is
# wrong, or the centre view does not see the point: something nearer lies
# there.

down, across = corner.baselines[light_field.reference_position]
y, x = np.mgrid[:128, :128]
row = np.rint(y - corner_map * down).astype(int)
column = np.rint(x - corner_map * across).astype(int)
inside = (row >= 0) & (row < 128) & (column >= 0) & (column < 128)
difference = np.full(corner_map.shape, np.nan)
difference[inside] = (
    centre_map[row[inside], column[inside]] - corner_map[inside]
)

same = np.abs(difference[inside]) < 0.1
nearer = difference[inside] > 0.1
print("of the pixels that lie inside the centre view,")
print(f"{100 * same.mean():.1f} % agree,")
print(f"{100 * nearer.mean():.1f} % have something nearer before them,")
print(f"{100 * (~same & ~nearer).mean():.1f} % contradict")

figure, axis = plt.subplots(figsize=(6, 4.6), layout="constrained")
axis.set_facecolor("0.75")
image = axis.imshow(difference, cmap="RdBu_r", vmin=-2, vmax=2)
axis.set(
    title="centre's map minus corner's (grey: outside)", xticks=[], yticks=[]
)
figure.colorbar(image, ax=axis, label="px / step", extend="both")
plt.show()

# %%
# The red crescents are the points that only the corner sees. They lie on the
# side of each shape that the step from the corner to the centre covers up.
# Single blue pixels are outlines, where the rounding to whole pixels hits the
# other surface. Everything else is nearly white: the two maps were computed
# independently, and agree.
