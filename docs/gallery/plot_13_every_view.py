"""
Depth for every view
====================

Editing a light field, or drawing new views between the old ones, takes a depth
map of each view. One could estimate them one by one; but most of a scene is
seen by nearly all views, so a few maps tell nearly everything.
"""

import matplotlib.pyplot as plt
import numpy as np

import sepi
from sepi.scenes import render

light_field = render("curved_occluders", size=96, views=5)
every = sepi.estimate_all_views(light_field)
print("disparity (T, S, H, W):", every.disparity.shape)

# %%
# One map per view
# ----------------
#
# ``estimate_all_views`` estimates the map of the reference view and those of
# the four corners, and carries them to all others, where they vote. Here are
# the first and the last view of the middle row: near things have moved, and
# each view has an outline of its own.

figure, axes = plt.subplots(2, 2, figsize=(6, 5.8), layout="constrained")
for column, s in zip(axes.T, (0, 4), strict=True):
    column[0].imshow(light_field.views[2, s])
    column[0].set_title(f"view (2, {s})")
    image = column[1].imshow(
        every.disparity[2, s], cmap="viridis", vmin=-2.6, vmax=2
    )
for axis in axes.flat:
    axis.set_axis_off()
figure.colorbar(image, ax=axes[1, :], label="px / step", shrink=0.85)
plt.show()

# %%
# Do they agree?
# --------------
#
# Put row 24 of the five views of the middle row one below the other, as an
# EPI, and the same row of their maps. In both, a point draws a line; and along
# its line, the disparity must stay the same.

y = 24
figure, axes = plt.subplots(
    2, 1, figsize=(6, 3.6), layout="constrained", sharex=True
)
axes[0].imshow(
    light_field.views[2, :, y], aspect="auto", interpolation="nearest"
)
axes[0].set(title="EPI of the views", ylabel="view s")
image = axes[1].imshow(
    every.disparity[2, :, y],
    aspect="auto",
    interpolation="nearest",
    cmap="viridis",
    vmin=-2.6,
    vmax=2,
)
axes[1].set(title="EPI of the maps", ylabel="view s", xlabel="column x / px")
figure.colorbar(image, ax=axes[1], label="px / step")
plt.show()

# %%
# As a number: we follow each pixel of the centre's map into every view, and
# look whether the map there says the same. Where it does not, something nearer
# hides the point, or the point lies on an outline.

centre = every.disparity[light_field.reference_position]
rows, columns = np.mgrid[:96, :96]
agree, hidden = np.zeros((5, 5)), np.zeros((5, 5))
for t, s in np.ndindex(5, 5):
    down, across = light_field.baselines[t, s]
    row = np.rint(rows - centre * down).astype(int)
    column = np.rint(columns - centre * across).astype(int)
    inside = (row >= 0) & (row < 96) & (column >= 0) & (column < 96)
    difference = (
        every.disparity[t, s][row[inside], column[inside]] - centre[inside]
    )
    agree[t, s] = np.mean(np.abs(difference) < 0.1)
    hidden[t, s] = np.mean(difference >= 0.1)

figure, axis = plt.subplots(figsize=(6, 4.2), layout="constrained")
image = axis.imshow(100 * agree, cmap="cividis", vmax=100)
for (t, s), value in np.ndenumerate(100 * agree):
    axis.text(
        s,
        t,
        f"{value:.0f}",
        ha="center",
        va="center",
        color="black" if value > 92 else "white",
    )
axis.set(
    title="pixels of the centre that agree / %",
    xlabel="view s",
    ylabel="view t",
    xticks=range(5),
    yticks=range(5),
)
figure.colorbar(image, ax=axis, label="%")
print(f"agree: {100 * agree.mean():.1f} %")
print(f"hidden by something nearer: {100 * hidden.mean():.1f} %")
print(f"contradict: {100 * (1 - agree - hidden).mean():.1f} %")
plt.show()
