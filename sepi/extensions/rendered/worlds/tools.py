"""Tools of a workshop, put together from round and square bars; blades are cut out."""

from __future__ import annotations

import numpy as np

from sepi.extensions.rendered import shapes
from sepi.extensions.rendered.world import Material, Mesh, Thing, Vector
from sepi.extensions.rendered.worlds import ware

STEEL = Material(kind="mirror", metal="Cr", roughness=0.3)
IRON = Material((0.16, 0.16, 0.17), "glossy", 0.2)
_HANDLE = [(0.0005, 0.1), (0.008, 0.099), (0.014, 0.09), (0.015, 0.07), (0.0105, 0.045), (0.014, 0.015), (0.01, 0.0)]


def chisels(at: Vector, wood: Material) -> list[Thing]:
    """In a rack, blades down, each narrower than the one before."""
    handles, blades = [], []
    for number, x in enumerate(at[0] + np.linspace(-0.27, 0.27, 8)):
        handles.append(shapes.turned_body(ware.profile(_HANDLE, 40), (float(x), at[1] - 0.025, at[2]), 24))
        blades.append(shapes.box((float(x), at[1] + 0.06, at[2]), (0.026 - 0.002 * number, 0.17, 0.004)))
    return [Thing(shapes.joined(handles), wood), Thing(shapes.joined(blades), STEEL)]


def saw(at: Vector, wood: Material) -> list[Thing]:
    """Hung by its grip: a tapered blade with teeth."""
    teeth = np.linspace(0, 0.42, 85)
    edge = np.stack([teeth, 0.05 + 0.003 * (np.arange(85) % 2)], 1)
    outline = np.concatenate([[[0, -0.06]], [[0.42, -0.01]], edge[::-1]])
    grip = [_bar((-0.01, -0.055, 0), (-0.07, -0.045, 0), 0.013), _bar((-0.07, -0.045, 0), (-0.08, 0.035, 0), 0.014)]
    grip += [_bar((-0.08, 0.035, 0), (0.0, 0.04, 0), 0.013), shapes.box((0.005, -0.005, 0), (0.03, 0.1, 0.018))]
    lean = (0, 0, 0.12)
    return [Thing(_set([shapes.plate(outline, 0.0015)], at, lean), STEEL), Thing(_set(grip, at, lean), wood)]


def hammer(at: Vector, turn: Vector, wood: Material) -> list[Thing]:
    face = shapes.turned_body(np.array([[0.0005, 0.0], [0.015, 0.0], [0.015, -0.035]]), (0, 0, 0), 24)
    head = [
        shapes.box((0.01, -0.13, 0), (0.06, 0.026, 0.026)),
        shapes.box((-0.035, -0.127, 0), (0.05, 0.012, 0.026), (0, 0, 0.15)),
        shapes.moved(face, (0, 0, np.pi / 2), (0.065, -0.13, 0)),
    ]
    handle = shapes.tube(
        np.array([[0, -0.15, 0], [0, -0.05, 0], [0, 0.06, 0], [0, 0.14, 0]]), np.array([0.009, 0.01, 0.012, 0.014])
    )
    return [Thing(_set(head, at, turn), IRON), Thing(_set([handle], at, turn), wood)]


def spanner(length: float, at: Vector, lean: float) -> Mesh:
    angle = np.linspace(0.5, 2 * np.pi - 0.5, 30)
    jaw = 0.12 * length * np.stack([np.sin(angle), -np.cos(angle)], 1)
    ends = [
        shapes.moved(
            shapes.plate(np.concatenate([jaw, [[0, 0.0]]]), 0.007), (0, 0, np.pi * side), (0, length * (0.5 - side), 0)
        )
        for side in (0, 1)
    ]
    return _set([*ends, shapes.box((0, 0, 0), (0.09 * length, 0.85 * length, 0.005))], at, (0, 0, lean))


def vice(at: Vector, paint: Material) -> list[Thing]:
    """Jaws, a bed, a screw with its cross bar, towards the right."""
    body = [shapes.box((0, -0.02, 0), (0.16, 0.04, 0.13)), shapes.box((-0.03, -0.075, 0), (0.06, 0.09, 0.1))]
    body += [shapes.box((-0.025, -0.13, 0), (0.045, 0.04, 0.13)), shapes.box((0.075, -0.125, 0), (0.04, 0.05, 0.13))]
    body += [shapes.box((0.06, -0.075, 0), (0.12, 0.05, 0.06)), shapes.box((0.075, -0.09, 0), (0.035, 0.06, 0.09))]
    bright = [
        _bar((0.1, -0.075, 0), (0.2, -0.075, 0), 0.012),
        _bar((0.185, -0.075, 0.09), (0.185, -0.075, -0.09), 0.006),
    ]
    bright += [shapes.ball((0.185, -0.075, z), 0.01, None, 16) for z in (-0.09, 0.09)]
    turn = (0, 0.35, 0)
    return [Thing(_set(body, at, turn), paint), Thing(_set(bright, at, turn), STEEL)]


def plane(at: Vector, wood: Material) -> list[Thing]:
    """A block with a slanting iron, a wedge, a knob before and a grip behind."""
    block = [
        shapes.box((0, -0.032, 0), (0.24, 0.064, 0.065)),
        shapes.box((0.035, -0.085, 0), (0.012, 0.09, 0.045), (0, 0, 0.75)),
    ]
    block += [shapes.ball((-0.085, -0.085, 0), 0.02, None, 32), _bar((-0.085, -0.06, 0), (-0.085, -0.08, 0), 0.01)]
    block += [_bar((0.09, -0.06, 0), (0.105, -0.13, 0), 0.014)]
    iron = shapes.box((0.022, -0.09, 0), (0.005, 0.13, 0.05), (0, 0, 0.75))
    return [Thing(_set(block, at, (0, -0.5, 0)), wood), Thing(_set([iron], at, (0, -0.5, 0)), STEEL)]


def _bar(start: Vector, end: Vector, radius: float) -> Mesh:
    return shapes.tube(np.array([start, end]), radius, 16)


def _set(meshes: list[Mesh], at: Vector, turn: Vector = (0, 0, 0)) -> Mesh:
    return shapes.moved(shapes.joined(meshes), turn, at)
