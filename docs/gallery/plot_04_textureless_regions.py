"""
Regions without texture
=======================

A bare wall looks the same from everywhere: every disparity explains it equally
well. What can be known of it comes from its border. This lesson shows how the
method finds such regions and what it puts there.
"""

# sphinx_gallery_thumbnail_number = 3
import matplotlib.pyplot as plt
import numpy as np

import sepi
from sepi.extensions.page.curves import cost_curves
from sepi.matching.plane_sweep import SweepParameters
from sepi.scenes import render
from sepi.scoring.scores import score

light_field = render("wall", size=128, views=7)
truth = light_field.ground_truth
bare = light_field.masks["textureless"]
print(f"{100 * bare.mean():.0f} % of the picture is bare wall")

# %%
# A flat curve
# ------------
#
# Two pixels, one on the brick and one on the bare wall, and their cost curves.
# The brick has one clear minimum. The wall is cheap everywhere: its curve is
# flat, and where its lowest point lies is decided by the noise of the
# pictures.

pixels = {"brick": (40, 6), "bare wall": (70, 30)}
figure, axes = plt.subplots(1, 2, figsize=(6, 3.2), layout="constrained")
axes[0].imshow(light_field.reference_view)
axes[0].set_axis_off()
for (name, (y, x)), colour in zip(
    pixels.items(), ("#D55E00", "#0072B2"), strict=True
):
    curves = cost_curves(light_field, y, x, SweepParameters())
    axes[0].plot(x, y, "o", color=colour, markeredgecolor="white")
    axes[1].plot(curves.disparities, curves.costs[0], color=colour, label=name)
    axes[1].axvline(truth[y, x], color=colour, linestyle=":")
    found = curves.minimum()[0]
    print(f"{name}: minimum at {found:+.2f}, truth {truth[y, x]:+.2f}")
axes[1].set(
    xlabel="disparity / (px / step)",
    ylabel="mean cost",
    ylim=(0, 1),
    title="dotted: truth",
)
axes[1].legend()
plt.show()

# %%
# Where there is texture
# ----------------------
#
# The paper cuts the view into superpixels and counts in each the *texture
# points*: pixels on an edge, or with a distinct slope. Their share is the
# *local texture information* (LTI). Where it is low, the depth is propagated
# into the superpixel, as a plane, from the reliable edges around it.

maps = sepi.estimate_depth(light_field, variant="paper")
lti, replaced = maps.extra["lti"], maps.extra["textureless"]
figure, axes = plt.subplots(1, 2, figsize=(6, 3.3), layout="constrained")
image = axes[0].imshow(lti, cmap="cividis", vmin=0, vmax=1)
axes[0].set_title("LTI")
figure.colorbar(
    image, ax=axes[0], location="bottom", label="share of texture points"
)
shown = light_field.reference_view * np.where(replaced, 1, 0.35)[..., None]
axes[1].imshow(shown)
axes[1].set_title("depth replaced (bright)")
for axis in axes:
    axis.set_axis_off()
print(f"median LTI of the bare wall {np.median(lti[bare]):.2f},", end=" ")
print(f"elsewhere {np.median(lti[~bare]):.2f}")
plt.show()

# %%
# With and without
# ----------------
#
# ``no_textureless`` is the paper's method without that stage. ``best`` fits
# one plane to a whole uniform region, supported by its border; a wall is
# mostly just that.

figure, axes = plt.subplots(2, 2, figsize=(6, 5.8), layout="constrained")
panels = {"truth": truth}
mse = {}
for variant in ("no_textureless", "paper", "best"):
    panels[variant] = sepi.estimate_depth(light_field, variant).disparity
    mse[variant] = score(panels[variant], truth, region=bare)["mse100"]
    print(f"{variant:15s} MSE x100 on the bare wall: {mse[variant]:7.2f}")
for axis, (name, picture) in zip(axes.flat, panels.items(), strict=True):
    image = axis.imshow(
        picture, vmin=truth.min(), vmax=truth.max(), cmap="viridis"
    )
    axis.set_title(name)
    axis.set_axis_off()
figure.colorbar(image, ax=axes, label="disparity / (px / step)", shrink=0.6)
plt.show()
