"""
Confidence, and what to throw away
==================================

Beside each disparity stands a *confidence*, 0 to 1: the probability that the
disparity is nearly right. It tells how many pixels to doubt, and which ones
first. The *sparsification curve* shows how well it does the latter.
"""

import matplotlib.pyplot as plt
import numpy as np

import sepi
from sepi.scenes import render
from sepi.scoring.error_bars import oracle, sparsification

light_field = render("dots", size=128, views=7)
maps = sepi.estimate_depth(light_field)
error = np.abs(maps.disparity - light_field.ground_truth)

# %%
# The noise of this scene grows from left to right, and confidence falls with
# it. It is low round every outline, where some views see the disc and others
# what lies behind it. There lie nearly all of the large errors, though by far
# not all of these pixels are wrong.

figure, axes = plt.subplots(2, 2, figsize=(6, 5.8), layout="constrained")
panels = [
    (light_field.reference_view, "centre view", {}),
    (maps.disparity, "disparity / (px / step)", {"cmap": "viridis"}),
    (maps.confidence, "confidence", {"cmap": "gray", "vmin": 0, "vmax": 1}),
    (error, "error / (px / step)", {"cmap": "magma", "vmin": 0, "vmax": 0.5}),
]
for axis, (picture, title, style) in zip(axes.flat, panels, strict=True):
    image = axis.imshow(picture, **style)
    axis.set_title(title)
    axis.set_axis_off()
    if style:
        figure.colorbar(
            image,
            ax=axis,
            location="bottom",
            extend="max" if "error" in title else "neither",
        )
plt.show()

# %%
# What nearly right is
# --------------------
#
# Off by at most 0.07 px / step, where the farthest view is four steps away.
# The nearer it is, the less views tell: here it is three steps away, and the
# error may be a third larger. The mean confidence is the share of pixels that
# are expected to be so close. It is right over many scenes; in a single one it
# may be off by a tenth or two.

close = 0.07 * 4 / light_field.reach
print(f"nearly right: off by at most {close:.3f} px / step")
print(f"expected: {100 * maps.confidence.mean():.0f} % of the pixels")
print(f"found:    {100 * np.mean(error <= close):.0f} %")

# %%
# The sparsification curve
# ------------------------
#
# Take away the least confident pixels, one per cent after the other, and look
# at the mean error of the rest. The *oracle* takes away those with the largest
# errors first: nothing can lie below it. A confidence that says nothing would
# leave the error where it is. (The two functions give errors times 100.)

curves = {
    "by confidence": sparsification(maps.confidence, error) / 100,
    "oracle": oracle(error) / 100,
}
taken = np.arange(100)
figure, axis = plt.subplots(figsize=(6, 3.6), layout="constrained")
axis.plot(taken, curves["by confidence"], label="by confidence")
axis.plot(taken, curves["oracle"], "--", label="oracle")
axis.axhline(error.mean(), color="grey", linestyle=":", label="at random")
axis.set(
    xlabel="pixels taken away / %",
    ylabel="mean error / (px / step)",
    ylim=(0, None),
)
axis.legend()
plt.show()

# %%
# What to keep
# ------------
#
# For a point cloud or a measurement, a threshold is often enough. Since
# confidence is a probability, it can be chosen before there is a map: here we
# keep what is nearly right four times out of five, or more often. To keep a
# certain share of the pixels, take a quantile of the confidence in its place.

kept = maps.confidence >= 0.8
right = np.mean(error[kept] <= close)
print(f"kept: {100 * kept.mean():.0f} %, nearly right: {100 * right:.0f} %")
print(f"mean error of all pixels:  {error.mean():.4f} px / step")
print(f"mean error of those kept:  {error[kept].mean():.4f} px / step")

figure, axis = plt.subplots(figsize=(6, 4.4), layout="constrained")
image = axis.imshow(np.where(kept, maps.disparity, np.nan), cmap="viridis")
axis.set(title="disparity where it is sure (white: thrown away)")
axis.set_axis_off()
figure.colorbar(image, ax=axis, label="px / step")
plt.show()

# %%
# One more mask is always there: ``unknown`` marks pixels for whose depth no
# view has evidence, such as a black background or an overexposed window.
# Confidence is 0 there. This scene has none.

print("unknown pixels:", int(maps.extra["unknown"].sum()))
