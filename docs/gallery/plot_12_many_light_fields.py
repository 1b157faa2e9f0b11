"""
Many light fields
=================

A folder of light fields, a loop, a folder of results. What matters in the long
run: one that is broken must not end the loop, memory has a bound, and cores
are used well.
"""

import shutil
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import sepi
from sepi.process.threads import use_threads
from sepi.scenes import render, write_hci
from sepi.scoring.scores import score

# %%
# Something to work on
# --------------------
#
# Three light fields on disk, and a fourth whose pictures were cut off when the
# disk was full.

workplace = tempfile.TemporaryDirectory()
inputs, outputs = (
    Path(workplace.name) / "scenes",
    Path(workplace.name) / "depth",
)
for name in ("dots", "pyramids", "wall"):
    write_hci(render(name, size=96, views=5), inputs / name)
shutil.copytree(inputs / "dots", inputs / "broken")
for picture in (inputs / "broken").glob("*.png"):
    picture.write_bytes(picture.read_bytes()[:200])

# %%
# The loop
# --------
#
# - *Threads.* One light field on all cores, as here, or a process for each
#   core with one thread each, which is faster for many small ones:
#   ``use_threads(1)``.
# - *Memory.* ``memory`` is the number of bytes that the process should stay
#   within. The maps are the same; with little memory it takes longer.
# - *Failures.* What a user can mend is a ``SepiError`` of one line, which
#   names the file. Anything else is a bug, and better not caught.
# - *Results.* ``write_result`` writes a folder whole or not at all: after an
#   interruption, what is there is complete.

use_threads(1)
done, failed = {}, {}
for folder in sorted(inputs.iterdir()):
    try:
        light_field = sepi.read_light_field(folder)
        maps = sepi.estimate_depth(
            light_field, variant="fast", memory=2_000_000_000
        )
        sepi.write_result(outputs / folder.name, light_field, maps)
    except sepi.SepiError as error:
        failed[folder.name] = str(error).replace(workplace.name, "...")
        continue
    done[folder.name] = maps.disparity
    mse = score(maps.disparity, light_field.ground_truth)["mse100"]
    print(f"{folder.name:10s} {light_field.views.shape}  MSE x100 {mse:.2f}")
for name, message in failed.items():
    print(f"{name:10s} FAILED: {message}")

# %%
# The results
# -----------
#
# Each folder holds the map in several formats. We read one kind back for an
# overview.

figure, axes = plt.subplots(2, 2, figsize=(6, 5.8), layout="constrained")
for axis in axes.flat:
    axis.set_axis_off()
for axis, name in zip(axes.flat, done, strict=False):
    disparity = np.load(outputs / name / "disparity.npy")
    image = axis.imshow(disparity, cmap="viridis", vmin=-1.4, vmax=1.7)
    axis.set_title(name)
figure.colorbar(image, ax=axes, label="disparity / (px / step)", shrink=0.6)
axes[1, 1].text(0.5, 0.5, f"failed: {', '.join(failed)}", ha="center")
same = all(
    np.array_equal(np.load(outputs / name / "disparity.npy"), disparity)
    for name, disparity in done.items()
)
print("written and read back unchanged:", same)
plt.show()

# %%
# For hundreds of light fields, with scores, tables and a report, the Snakemake
# workflow does all this, and computes again only what a change affects:
# ``snakemake --config hci_root=scenes -- all``.

workplace.cleanup()
