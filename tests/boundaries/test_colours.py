"""What the colours of the reference view say of single pixels at depth steps."""

import numpy as np
import pytest

from sepi.boundaries.colour_mixture import mixture_evidence
from sepi.boundaries.parameters import BoundaryParameters
from sepi.boundaries.rim import surroundings
from sepi.lightfield import FloatMap

pytestmark = pytest.mark.slow


def evidence(disparity: FloatMap, guide: FloatMap) -> FloatMap:
    """That pixels are background, without noise."""
    return mixture_evidence(disparity, surroundings(disparity), guide, 0.0, BoundaryParameters())


def test_mixed_pixels_are_known_by_their_colour() -> None:
    """A depth map that is one pixel too wide at an edge: the pixel there is mostly background."""
    near, far = np.array([0.8, 0.6, 0.5], np.float32), np.array([0.2, 0.3, 0.4], np.float32)
    guide = np.broadcast_to(far, (20, 20, 3)).copy()
    guide[:, 10:] = near
    guide[:, 9] = 0.2 * near + 0.8 * far
    wide = np.zeros((20, 20), np.float32)
    wide[:, 9:] = 1
    found = evidence(wide, guide)
    assert (found[:, 9] > 0.9).all()
    assert not np.delete(found, 9, axis=1).any()
    # in a grey picture every colour lies between two others
    grey = np.repeat(guide.mean(axis=2, keepdims=True), 3, axis=2)
    assert 0.1 < evidence(wide, grey)[:, 9].max() < 0.3
    # mostly foreground, or no contrast to tell by
    guide[:, 9] = 0.8 * near + 0.2 * far
    assert not evidence(wide, guide).any()
    assert evidence(wide, np.full_like(guide, 0.5)).max() < 1e-6


def test_a_colour_beside_all_mixtures_is_none() -> None:
    """The dark edge of a bright surface before a wall of another colour belongs to the surface."""
    guide = np.full((20, 20, 3), (0.2, 0.4, 0.4), np.float32)
    guide[:, 9:] = 0.8
    guide[:, 9] = (0.3, 0.2, 0.1)
    disparity = np.zeros((20, 20), np.float32)
    disparity[:, 9:] = 1
    assert evidence(disparity, guide).max() < 1e-3
