"""Calibrated cameras: their models and pictures, rectified to a light field; finding them; poses for other programs."""

from sepi.registry import Extension

EXTENSION = Extension(
    readers={"cameras": f"{__name__}.reader"},
    commands={
        "calibrate": (f"{__name__}.commands", "Find the cameras of pictures without poses, with COLMAP."),
        "poses": (f"{__name__}.commands", "Write camera poses and depth for COLMAP or nerfstudio."),
    },
    names={"read_cameras": f"{__name__}.reader"},
)
