"""
Looking into SEPIs and cost curves
==================================

Where does a disparity come from? From straight lines. This lesson follows one
pixel: through an epipolar plane image (EPI), through the *stitched* EPI (SEPI)
that gives the method its name, to the curve whose minimum is the disparity.
"""

# sphinx_gallery_thumbnail_number = 2
import matplotlib.pyplot as plt
import numpy as np

from sepi.extensions.page.curves import cost_curves
from sepi.matching.plane_sweep import SweepParameters
from sepi.matching.stitched_epi import stitched_epi
from sepi.scenes import render

light_field = render("curved_occluders", size=128, views=9)
y, x = 92, 32
true = float(light_field.ground_truth[y, x])
print(f"pixel (y, x) = ({y}, {x}), true disparity {true:.3f} px / step")

# %%
# One row of views: the EPI
# -------------------------
#
# Take row ``y`` of each of the nine views in the middle row of the grid, and
# put them one below the other. A scene point moves by its disparity from one
# view to the next, so it draws a straight line, and the slope of the line is
# its depth. Near points lean one way, distant ones the other; what lies in the
# plane of focus stands upright.

t0, s0 = light_field.reference_position
epi = light_field.views[t0, :, y]
figure, axes = plt.subplots(
    2, 1, figsize=(6, 5.4), layout="constrained", height_ratios=[3, 1]
)
axes[0].imshow(light_field.reference_view)
axes[0].axhline(y, color="white", linewidth=1)
axes[0].plot(x, y, "o", color="white", markeredgecolor="black")
axes[0].set_title("centre view, and the row that we follow")
axes[0].set_axis_off()
axes[1].imshow(epi, aspect="auto")
rows = np.arange(9)
axes[1].plot(x - true * (rows - s0), rows, color="white", linestyle="--")
axes[1].set(
    title="EPI, and the line of our pixel",
    xlabel="column x / px",
    ylabel="view s",
)
plt.show()

# %%
# All rows of views: the SEPI
# ---------------------------
#
# Nine samples are few. The other eight rows of views see the point too, each
# in a row of pixels that depends on the disparity. For a *candidate* disparity
# those EPIs can be found, shifted so that their lines continue one another,
# and stitched: 81 samples on one line. If the candidate is wrong, the pieces
# do not fit, and the line crosses all sorts of colours.

candidates = {"right candidate": true, "wrong candidate": true - 0.4}
figure, axes = plt.subplots(
    1, 2, figsize=(6, 4.2), layout="constrained", sharey=True
)
for axis, (name, disparity) in zip(axes, candidates.items(), strict=True):
    sepi_of_row = stitched_epi(light_field, y, disparity)
    axis.imshow(sepi_of_row.image(), aspect="auto")
    axis.plot(
        x - disparity * sepi_of_row.positions,
        np.arange(81),
        color="white",
        linestyle="--",
    )
    axis.set(
        xlim=(0, 64), title=f"{name}, {disparity:.2f}", xlabel="column x / px"
    )
axes[0].set_ylabel("view (row by row)")
plt.show()

# %%
# The samples along the two lines, laid out as the grid of views, show it at a
# glance: the *angular patch* of the right candidate is of one colour, since
# all views look at the same point of the scene.

figure, axes = plt.subplots(1, 2, figsize=(6, 3.2), layout="constrained")
spread = {}
for axis, (name, disparity) in zip(axes, candidates.items(), strict=True):
    samples, _ = stitched_epi(light_field, y, disparity).along_line(x)
    spread[name] = float(samples.std(axis=0).mean())
    axis.imshow(samples.reshape(9, 9, 3))
    axis.set(
        title=name,
        xlabel="view s",
        ylabel="view t",
        xticks=[0, 4, 8],
        yticks=[0, 4, 8],
    )
    print(f"{name}: standard deviation of the colours {spread[name]:.3f}")
plt.show()

# %%
# Every candidate: the cost curve
# -------------------------------
#
# The method tries every candidate and takes the mean colour difference along
# its line, *photo-consistency*: each difference is bounded, so that a few
# views that see something else do not decide. The minimum is the disparity. A
# parabola through the minimum and its neighbours finds it more finely than the
# candidates are spaced.

curves = cost_curves(light_field, y, x, SweepParameters())
found, lowest = curves.minimum()
print(f"minimum at {found:.3f} px / step, error {abs(found - true):.4f}")

figure, axis = plt.subplots(figsize=(6, 3.4), layout="constrained")
axis.plot(
    curves.disparities,
    curves.costs[curves.names.index("full")],
    label="all 81 views",
)
axis.axvline(true, color="black", linestyle=":", label="truth")
axis.plot(found, lowest, "o", label="minimum")
axis.set(
    xlabel="candidate disparity / (px / step)",
    ylabel="mean cost (0 to 1)",
    ylim=(0, None),
)
axis.legend()
plt.show()

# %%
# A sharp, deep minimum like this one means that the colours decide. Where the
# scene has no texture the curve is flat
# (:ref:`sphx_glr_examples_plot_04_textureless_regions.py`); where some views
# see something else, it has no deep minimum or one at the wrong place
# (:ref:`sphx_glr_examples_plot_03_occlusion.py`).
