"""
Refocusing, and all in focus
============================

The views of a light field together are one large lens, the *synthetic
aperture*. A photograph through it can be focused after it was taken; and with
the disparity map, everywhere at once.
"""

import matplotlib.pyplot as plt
import numpy as np

import sepi
from sepi.image.noise import noise_level
from sepi.scenes import render

light_field = render("pencils", size=128, views=9)
maps = sepi.estimate_depth(light_field)

# %%
# Focus at one disparity
# ----------------------
#
# Shift each view so that points of one disparity come to lie upon each other,
# and take the mean: these points are sharp, all others are spread over as many
# pixels as they move. It needs no depth map; but the map knows at which
# disparity a thing is in focus. We click on the pot, and on the sheet of paper
# behind the pencils.

clicks = {"the pot": (105, 64), "the paper": (60, 50)}
figure, axes = plt.subplots(1, 2, figsize=(6, 3.4), layout="constrained")
for axis, (name, (y, x)) in zip(axes, clicks.items(), strict=True):
    disparity = float(maps.disparity[y, x])
    axis.imshow(sepi.refocus(light_field, disparity))
    axis.plot(x, y, "+", color="white", markersize=12)
    axis.set_title(f"{name}: {disparity:+.2f} px / step")
    axis.set_axis_off()
plt.show()

# %%
# A smaller lens
# --------------
#
# ``aperture`` is the lens's radius in view steps. A small one has more depth
# of field, as on a camera. With the map, the gaps between the views are
# filled, too: what is out of focus is blurred evenly, without a trace of the
# grid of views.

figure, axes = plt.subplots(1, 2, figsize=(6, 3.4), layout="constrained")
disparity = float(maps.disparity[clicks["the pot"]])
for axis, aperture in zip(axes, (1.5, 5.7), strict=True):
    axis.imshow(sepi.refocus(light_field, disparity, maps, aperture=aperture))
    axis.set_title(f"aperture {aperture}")
    axis.set_axis_off()
plt.show()

# %%
# Sharp everywhere
# ----------------
#
# With the map, each pixel is focused at its own disparity, by those views that
# see it. The picture is as sharp as the centre view and has less noise, since
# that of up to 81 samples averages out. We take a scene whose noise grows to
# the right, and look at its right half.

noisy = render("dots", size=128, views=9)
picture = sepi.all_in_focus(noisy, sepi.estimate_depth(noisy))
half = np.s_[40:104, 64:]
noise = {
    "centre view": noise_level(noisy.reference_view[half]),
    "all in focus": noise_level(picture[half]),
}
figure, axes = plt.subplots(1, 2, figsize=(6, 3.4), layout="constrained")
for axis, shown, (title, level) in zip(
    axes, (noisy.reference_view, picture), noise.items(), strict=True
):
    axis.imshow(shown[half], interpolation="nearest")
    axis.set_title(f"{title}: noise {level:.3f}")
    axis.set_axis_off()
plt.show()
