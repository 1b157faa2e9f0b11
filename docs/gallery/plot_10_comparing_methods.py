"""
Comparing two methods
=====================

Which map is better, and where? This lesson scores three methods on one scene:
``best``, which is the default, the method as its paper describes it, and a
quick one from the literature [1]_.
"""

import matplotlib.pyplot as plt

import sepi
from sepi.evaluate import evaluations_of
from sepi.scenes import render

light_field = render("fine_structures", size=128, views=7)
methods = ("best", "paper", "mishiba")
maps = {
    name: sepi.estimate_depth(light_field, variant=name).disparity
    for name in methods
}

# %%
# Scores
# ------
#
# ``evaluations_of`` scores maps against the ground truth, over the whole map
# and over regions, by two protocols: the one of the paper, and the one of the
# HCI 4D benchmark, which leaves out a border of 15 pixels.
#
# - *MSE*: mean squared error. A few large errors decide it.
# - *BadPix 0.07*: share of the pixels that are wrong by more than 0.07 px /
#   step. It counts errors, large or small.
# - *Q25*: the error that a quarter of the pixels stay below: how exact the
#   method is where the scene is easy.
#
# They need not agree on an order, and a comparison that shows one alone hides
# something.

evaluations = evaluations_of(light_field, maps)
scores = {
    name: evaluation.scores["paper"]
    for name, evaluation in evaluations.items()
}
print(f"{'':10s}{'MSE x100':>10s}{'BadPix %':>10s}{'Q25 x100':>10s}")
for name in methods:
    whole = scores[name]["all"]
    row = [f"{whole[key]:10.2f}" for key in ("mse100", "badpix007", "q25")]
    print(f"{name:10s}", *row, sep="")

# %%
# Error maps
# ----------
#
# ``error`` is estimate minus truth: red is too near, blue too far. All three
# have the same scale, or they would not compare.

figure, axes = plt.subplots(2, 2, figsize=(6, 5.8), layout="constrained")
axes[0, 0].imshow(light_field.reference_view)
axes[0, 0].set_title("centre view")
for axis, name in zip(axes.flat[1:], methods, strict=True):
    image = axis.imshow(
        evaluations[name].error, cmap="RdBu_r", vmin=-0.5, vmax=0.5
    )
    axis.set_title(name)
for axis in axes.flat:
    axis.set_axis_off()
figure.colorbar(
    image, ax=axes, label="error / (px / step)", extend="both", shrink=0.6
)
plt.show()

# %%
# Edges
# -----
#
# Nearly all the errors lie beside depth discontinuities. Two more scores say
# of which kind they are. *Fattening*: pixels of the background that were given
# the foreground's depth, so that a bar comes out too wide. *Thinning*: pixels
# of the foreground that were lost to the background.

figure, axis = plt.subplots(figsize=(6, 3.2), layout="constrained")
for number, (score, colour) in enumerate(
    (("fattening", "#B2182B"), ("thinning", "#2166AC"))
):
    values = [scores[name]["discontinuities"][score] for name in methods]
    places = [place + 0.38 * (number - 0.5) for place in range(len(methods))]
    bars = axis.bar(places, values, 0.36, color=colour, label=score)
    axis.bar_label(bars, fmt="%.1f")
axis.set_xticks(range(len(methods)), methods)
axis.set_ylabel("% of the pixels beside edges")
axis.margins(y=0.15)
axis.legend()
plt.show()

# %%
# One scene proves nothing about methods. ``snakemake comparison`` runs seven
# of the literature over any number of scenes, beside this project's own, and
# puts the tables beside the published figures.
#
# .. [1] Mishiba: Fast depth estimation for light field cameras. IEEE
#    Transactions on Image Processing, 2020.
