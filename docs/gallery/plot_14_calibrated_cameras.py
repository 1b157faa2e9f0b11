"""
Cameras that stand in no grid
=============================

An array is never built as it was drawn: cameras stand a little beside their
places, look a little aside, and no two lenses are alike. Where their poses
and lenses are known, their pictures become a light field all the same, and
depth comes back to the pictures as they were taken.
"""

import tempfile
from pathlib import Path

import cv2
import matplotlib.pyplot as plt
import numpy as np
import yaml

import sepi
from sepi.camera.rig import Lens, Shot
from sepi.io.disparity_maps import read_pfm
from sepi.io.result_folder import write_as_taken
from sepi.scenes import render_shot

# %%
# Nine cameras
# ------------
#
# They stand 5 cm apart, more or less: up to a fifth of that beside their
# places, turned by up to three degrees, with focal lengths that differ by five
# percent, and with lenses that distort.

SIZE, FOCAL = 96, 120.0
scene_camera = sepi.Camera(scale=6.0, offset=4.0, focal_px=FOCAL)
rng = np.random.default_rng(4)
shots = []
for t, s in np.ndindex(3, 3):
    place = np.array([s - 1, t - 1, 0]) + rng.uniform(-0.2, 0.2, 3) * (
        1,
        1,
        0.2,
    )
    turn = cv2.Rodrigues(np.radians(rng.uniform(-3, 3, 3)))[0]
    focal = FOCAL * rng.uniform(0.95, 1.05)
    x, y = ((SIZE - 1) / 2 + place[:2] * scene_camera.offset).tolist()
    bend = rng.uniform(-0.1, 0.1)
    lens = Lens(SIZE, SIZE, (focal, focal), (x, y), distortion=(bend,))
    shots.append(Shot(f"{t}{s}.png", lens, turn, 0.05 * place))
seen = [
    render_shot("pyramids", shot, camera=scene_camera, size=SIZE)
    for shot in shots
]

figure, axes = plt.subplots(1, 3, figsize=(6, 2.2), layout="constrained")
for axis, n in zip(axes, (0, 4, 8), strict=True):
    axis.imshow(seen[n].picture)
    axis.set_title(shots[n].name)
    axis.set_axis_off()
plt.show()

# %%
# A table says where they stood
# -----------------------------
#
# Any program can write it; a model of COLMAP or a ``transforms.json`` would do
# as well. ``sepi depth FOLDER`` takes such a folder; here we do the same from
# Python.

workplace = tempfile.TemporaryDirectory()
folder = Path(workplace.name)
entries = []
for shot, view in zip(shots, seen, strict=True):
    cv2.imwrite(str(folder / shot.name), view.picture[..., ::-1])
    entries.append(
        {
            "file": shot.name,
            "position": shot.centre.tolist(),
            "rotation": shot.rotation.tolist(),
            "focal": shot.lens.focal[0],
            "principal": list(shot.lens.principal),
            "distortion": list(shot.lens.distortion),
        }
    )
table = {"units": "metres", "cameras": entries}
(folder / "cameras.yaml").write_text(yaml.safe_dump(table))

light_field = sepi.read_cameras(folder, disparity_range=(-2.5, 2.5))
print(f"{light_field.grid} views of {light_field.shape}")
for note in light_field.notes:
    print(note)

# %%
# The pictures are turned and straightened, so that all cameras look the same
# way; what not all of them show is cut off. Where the cameras stand is kept:

positions = light_field.positions[light_field.present]
figure, axes = plt.subplots(1, 2, figsize=(6, 2.8), layout="constrained")
axes[0].imshow(np.clip(light_field.reference_view, 0, 1))
axes[0].set(title="rectified reference view")
axes[0].set_axis_off()
axes[1].scatter(positions[:, 1], positions[:, 0], color="tab:orange")
axes[1].invert_yaxis()
axes[1].set(
    title="positions / view steps",
    aspect="equal",
    xlabel="across",
    ylabel="down",
)
plt.show()

# %%
# Depth in the picture as it was taken
# ------------------------------------
#
# The map is that of the rectified view. ``original_depth.pfm``, which ``sepi
# depth`` writes beside it, has depth at the pixels of the middle camera's own
# picture, in metres along its own axis; what the rectified view does not show
# is not known there.

maps = sepi.estimate_depth(light_field)
write_as_taken(folder, light_field, maps.disparity)
depth = read_pfm(folder / "original_depth.pfm")
true = seen[4].depth
workplace.cleanup()

figure, axes = plt.subplots(1, 3, figsize=(7, 2.6), layout="constrained")
axes[0].imshow(maps.disparity, cmap="viridis")
axes[0].set_title("disparity, rectified")
image = axes[1].imshow(depth, cmap="viridis_r")
axes[1].set_title("depth, as taken")
figure.colorbar(image, ax=axes[1], label="m", shrink=0.8)
error = 1000 * np.abs(depth - true)
image = axes[2].imshow(error, cmap="magma", vmin=0, vmax=50)
axes[2].set_title("error")
figure.colorbar(image, ax=axes[2], label="mm", shrink=0.8)
for axis in axes:
    axis.set_axis_off()
known = np.isfinite(depth)
print(f"known: {100 * known.mean():.0f} % of the picture")
print(f"median error: {np.median(error[known]):.1f} mm of {true.mean():.2f} m")
plt.show()
