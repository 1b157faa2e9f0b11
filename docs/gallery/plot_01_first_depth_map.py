"""
First depth map
===============

A *light field* is a grid of pictures of one scene, each taken from a position
one step beside the last. Near things move more from view to view than distant
ones. How far a pixel moves per step is its *disparity*, and a map of it, one
value for each pixel of one view, is a depth map.
"""

# sphinx_gallery_thumbnail_number = 2
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import sepi
from sepi.scenes import render

# %%
# A light field
# -------------
#
# We render a built-in scene: shapes that hover at several depths before a
# lawn. For pictures of your own, the line is
# ``sepi.read_light_field("folder")``. The views are one array with five axes:
# rows and columns of the grid of views, then rows, columns and colours of each
# picture.

light_field = render("curved_occluders", size=128, views=7)
print("views (T, S, H, W, C):", light_field.views.shape)
print("the depth map belongs to view", light_field.reference_position)

# %%
# Here are the first and the last view of the middle row. The dotted line is at
# the same column in both. The ring at the upper right is near, and is carried
# to the left, across the line; the grass, far away, moves to the right.

middle = light_field.reference_position[0]
figure, axes = plt.subplots(1, 2, figsize=(6, 3.3), layout="constrained")
for axis, s in zip(axes, (0, 6), strict=True):
    axis.imshow(light_field.views[middle, s])
    axis.axvline(93, color="white", linestyle=":")
    axis.set_title(f"view ({middle}, {s})")
    axis.set_axis_off()
plt.show()

# %%
# Its depth
# ---------
#
# One call does the rest. The scene is a rendered one, so the true disparity is
# known; the estimate never sees it.

maps = sepi.estimate_depth(light_field)
truth = light_field.ground_truth
error = np.abs(maps.disparity - truth)
low, high = maps.disparity.min(), maps.disparity.max()
print(f"disparity from {low:.2f} to {high:.2f} px / step")
print(f"median error {np.median(error):.4f} px / step")
print(f"pixels wrong by more than 0.07: {100 * np.mean(error > 0.07):.1f} %")

figure, axes = plt.subplots(2, 2, figsize=(6, 5.6), layout="constrained")
for axis in axes.flat:
    axis.set_axis_off()
axes[0, 0].imshow(light_field.reference_view)
axes[0, 0].set_title("centre view")
for axis, picture, title in (
    (axes[1, 0], truth, "true disparity"),
    (axes[1, 1], maps.disparity, "estimate"),
):
    image = axis.imshow(
        picture, vmin=truth.min(), vmax=truth.max(), cmap="viridis"
    )
    axis.set_title(title)
figure.colorbar(image, ax=axes[1, :], label="px / step", shrink=0.85)
image = axes[0, 1].imshow(error, vmax=0.2, cmap="magma")
axes[0, 1].set_title("error")
figure.colorbar(
    image, ax=axes[0, :], label="px / step", shrink=0.85, extend="max"
)
plt.show()

# %%
# What errors there are lie along outlines. There, some views see the shape and
# others the grass behind it: :ref:`sphx_glr_examples_plot_03_occlusion.py`
# looks closer.
#
# Keep it
# -------
#
# ``write_result`` writes the map as numbers (PFM, NumPy, 16-bit PNG) and in
# colour, the confidence, a point cloud, and one HDF5 file with all of it.

with tempfile.TemporaryDirectory() as folder:
    names = sepi.write_result(
        Path(folder) / "curved_occluders-depth", light_field, maps
    )
print(*names, sep="\n")
