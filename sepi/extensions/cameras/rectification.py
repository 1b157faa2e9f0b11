"""Rectifies calibrated cameras to a light field: views of parallel cameras in one plane.

The steps are in ``frame``: the plane through the cameras and a grid for them, the picture of the reference view, and
the views themselves.
"""

from dataclasses import replace

import numpy as np

from sepi.camera import Camera
from sepi.camera.rig import Rig
from sepi.errors import SepiError
from sepi.extensions.cameras.frame import Plane, Seeing, completed, frame_of, grid_of, rectified_view
from sepi.extensions.cameras.model import CameraModel
from sepi.io.files import name_of
from sepi.lightfield import DisparityRange, LightField
from sepi.matching.exposure import equally_bright

# disparity errors from which a note mentions them, and from which a view is left out, pixels per view step
_TOLD, _TOO_MUCH = 0.1, 0.5
# least number of views that may remain
_FEWEST = 3
# share of the points beyond each end of the range, margin relative to the range, and least margin, pixels
_BEYOND, _MARGIN, _LEAST_MARGIN = 0.005, 0.06, 0.1
# least parallax between the farthest and the nearest point for depth, pixels in the farthest view
_NOTHING = 0.05


class Rectification:
    """Plane, orientation, pinhole and frame of calibrated cameras, before any picture is read.

    Parameters
    ----------
    model : CameraModel
    reference : str, optional
        Name of the picture whose depth is estimated; default: the most central one.
    inverse_depths : (float, float), optional
        Inverse depth of the farthest and the nearest surface from the reference camera; default: by the model's points.

    Attributes
    ----------
    seeing : Seeing
    frame : Frame
    notes : tuple of str

    Raises
    ------
    SepiError
        If the cameras do not suit a light field.
    """

    def __init__(
        self, model: CameraModel, reference: str | None = None, inverse_depths: tuple[float, float] | None = None
    ) -> None:
        model.require_sound()
        notes = list(model.notes)
        while True:
            chosen = None if reference is None else model.named(reference)[0]
            plane = Plane(model, chosen)
            known = inverse_depths or _of_points(model, plane)
            seeing = Seeing(model, plane, known)
            # the error of a camera off the plane depends on the frame, and the frame on the remaining cameras
            frame, kept = frame_of(seeing)
            errors = seeing.errors(frame)
            worst = int(errors.argmax())
            if len(kept) < len(model.shots):
                left = [shot.name for n, shot in enumerate(model.shots) if n not in kept]
                notes.append(f"left out, since they look elsewhere: {', '.join(left)}")
                reference = model.shots[plane.reference].name
                model = model.of(kept)
            elif errors[worst] > _TOO_MUCH:
                name, ahead = model.shots[worst].name, plane.places[worst, 2] / plane.step
                if len(model.shots) <= _FEWEST:
                    far = f"{name} is so far off that the disparity error is {errors[worst]:.2g} pixels"
                    told = f"the cameras do not stand in a plane: {far}; expected at most {_TOO_MUCH:g}"
                    raise SepiError(f"{model.path}: {told}")
                where = f"{abs(ahead):.2g} steps {'before' if ahead > 0 else 'behind'} the others"
                notes.append(f"left out, since it stands {where}: {name} (disparity error {errors[worst]:.2g} pixels)")
                model = model.of([n for n in range(len(model.shots)) if n != worst])
            else:
                break
            if len(model.shots) < 2:
                raise SepiError(f"{model.path}: expected at least two cameras, too few are left: {'; '.join(notes)}")
        places = plane.places[:, 2] - plane.places[:, 2].mean()
        flat = f"the cameras stand within {float(np.abs(places).max()) / plane.step:.2g} view steps of a plane"
        if known is not None:
            off = "; mind this if hundredths of a pixel matter" if errors.max() > _TOLD else ""
            flat += f", so disparity errors over the scene's depth are at most {errors.max():.2g} pixels{off}"
        self.seeing, self.frame, self.notes = seeing, frame, (*notes, flat)


def _of_points(model: CameraModel, plane: Plane) -> tuple[float, float] | None:
    """Inverse depths of the farthest and the nearest point (of nearly all) in front of the reference camera."""
    if not len(model.points):
        return None
    shot = model.shots[plane.reference]
    seen = (model.points - shot.centre) @ plane.rotation.T
    shown = np.isfinite(shot.lens.project((model.points - shot.centre) @ shot.rotation.T)[:, 0])
    depth = seen[shown & (seen[:, 2] > 0), 2]
    if not len(depth):
        return None
    low, high = (float(value) for value in np.quantile(1 / depth, (_BEYOND, 1 - _BEYOND)))
    moved = (high - low) * float(np.abs(plane.baselines).max()) * plane.step * max(shot.lens.focal)
    if len(depth) > 1 and moved < _NOTHING:
        close = f"too close together for the scene: its points move by {moved:.2g} pixels at most"
        expected = "expected a longer baseline (are positions and points in the same unit?)"
        raise SepiError(f"{model.path}: the cameras stand {close}; {expected}")
    return low, high


def light_field_of(found: Rectification) -> LightField:
    """The rectified views as a light field of equal brightness, with the pictures read and resampled."""
    seeing, frame = found.seeing, found.frame
    model, plane, depths = seeing.model, seeing.plane, seeing.inverse_depths
    pictures, absent = zip(*(rectified_view(seeing, frame, n) for n in range(len(model.shots))), strict=True)
    channels = max(picture.shape[2] for picture in pictures)
    at = grid_of(plane.baselines)
    rows, columns = (at.max(axis=0) + 1).tolist()
    grid = np.zeros((rows, columns, *frame.shape, channels), np.float32)
    present, positions = np.zeros((rows, columns), bool), np.zeros((rows, columns, 2))
    missing, views = np.zeros(grid.shape[:4], bool), {}
    for n, (t, s) in enumerate(at.tolist()):
        # grey becomes colour beside colour
        grid[t, s], missing[t, s] = completed(pictures[n], absent[n]), absent[n]
        # a mask may leave no pixels
        present[t, s], positions[t, s] = not absent[n].all(), plane.baselines[n]
        views[t, s] = replace(model.shots[n], zoom=float(seeing.zoom[n]))
    scale, view = plane.step * seeing.focal, (int(at[plane.reference, 0]), int(at[plane.reference, 1]))
    limits = None
    if depths is not None:
        low, high = (scale * inverse - seeing.offset for inverse in depths)
        margin = max(_MARGIN * (high - low), _LEAST_MARGIN)
        limits = DisparityRange(round(low - margin, 3), round(high + margin, 3), "parameters")
    light_field = LightField(
        grid,
        name_of(model.path).name,
        source=str(model.path),
        present=present,
        view=None if view == (rows // 2, columns // 2) else view,
        positions=positions,
        disparity_range=limits,
        settled=True,
        notes=found.notes,
        missing=missing if missing.any() else None,
        rig=Rig(plane.rotation, model.shots[plane.reference].centre, plane.step, model.units, views),
    )
    down, across = light_field.from_centre
    (x, y), (height, width) = frame.principal, frame.shape
    # the camera's principal point is that of the grid's centre view
    right = float(x - (width - 1) / 2 - across * seeing.offset)
    below = float(y - (height - 1) / 2 - down * seeing.offset)
    return equally_bright(replace(light_field, camera=Camera(scale, seeing.offset, seeing.focal, right, below)))
