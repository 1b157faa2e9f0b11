"""
A point cloud in metres
=======================

Disparity tells near from far, but no distances. With the camera's geometry it
becomes metric depth, and the map a cloud of points that can be measured.
"""

# sphinx_gallery_thumbnail_number = 2
import tempfile
from dataclasses import replace
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import sepi
from sepi.camera import camera_from
from sepi.io.point_cloud import point_cloud, write_ply
from sepi.scenes import render

# %%
# The camera
# ----------
#
# Four numbers: focal length, sensor size, distance between neighbouring
# cameras (the baseline), and the distance at which disparity is zero. Files of
# the HCI 4D benchmark bring them along, and ``sepi depth`` has flags for them;
# we make some up for a built-in scene.

scene = render("pyramids", size=128, views=7)
camera = camera_from(
    focal_length_mm=60,
    sensor_size_mm=24,
    baseline_mm=12,
    focus_distance_m=0.9,
    shape=scene.shape,
)
light_field = replace(scene, camera=camera)
print(
    f"depth in metres = {camera.scale:.2f} / (disparity + {camera.offset:.2f})"
)

# %%
# Depth
# -----
#
# Depth falls with disparity, and not in proportion: an error of 0.01 px / step
# is more millimetres in the distance than close by.

maps = sepi.estimate_depth(light_field)
depth = camera.depth(maps.disparity)
error_mm = 1000 * np.abs(depth - camera.depth(light_field.ground_truth))
print(f"depth from {depth.min():.2f} to {depth.max():.2f} m")
print(f"median error {np.median(error_mm):.2f} mm")

figure, axis = plt.subplots(figsize=(6, 4.6), layout="constrained")
image = axis.imshow(depth, cmap="viridis_r")
axis.set_title("depth")
axis.set_axis_off()
figure.colorbar(image, ax=axis, label="m")
plt.show()

# %%
# The cloud
# ---------
#
# One coloured point per pixel, the origin at the camera: x to the right, y up,
# z towards the viewer. Pixels that are rather wrong than right, as their
# confidence has it, can be left out. Two of the pyramids stand, two are sunk.

cloud = point_cloud(
    light_field.views[light_field.reference_position],
    maps.disparity,
    maps.confidence,
    camera=camera,
    min_confidence=0.5,
)
print(f"{len(cloud.positions)} points, metric: {cloud.metric}")

figure = plt.figure(figsize=(6, 5))
axis = figure.add_axes((0, 0.03, 0.94, 1), projection="3d")
right, up, towards = cloud.positions.T
axis.scatter(right, -towards, up, c=cloud.colours / 255, s=3, linewidths=0)
axis.set(xlabel="x / m", ylabel="distance / m", zlabel="y / m")
axis.set_box_aspect((np.ptp(right), np.ptp(towards), np.ptp(up)), zoom=1.05)
axis.locator_params(nbins=4)
axis.view_init(elev=18, azim=-62)
plt.show()

# %%
# Measure it
# ----------
#
# How far does the tip of the upper left pyramid stand out from the ground
# around it? We compare with the same measurement on the true depth.

tip, ground = np.s_[28:34, 33:39], np.s_[2:8, 55:70]


def height_cm(metres):
    """Distance from the ground to the tip, along the line of sight."""
    return 100 * float(np.median(metres[ground]) - np.median(metres[tip]))


measured, true = (
    height_cm(depth),
    height_cm(camera.depth(light_field.ground_truth)),
)
print(f"measured {measured:.2f} cm, true {true:.2f} cm")

# %%
# ``write_ply`` makes a file that MeshLab, CloudCompare or Blender open. ``sepi
# depth`` writes it as ``points.ply``.

with tempfile.TemporaryDirectory() as folder:
    path = Path(folder) / "pyramids.ply"
    write_ply(path, cloud)
    print(f"{path.name}: {path.stat().st_size / 1e6:.1f} MB")
