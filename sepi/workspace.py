"""What stages make of a light field's views and use again, and how much memory they may take for it.

A workspace goes with its light field from stage to stage (:attr:`sepi.lightfield.LightField.workspace`). Without one,
or where the views are others, everything is made anew: results are the same.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    from sepi.lightfield import LightField

USUAL_BAND_BYTES = 2**29
"""What bands of rows (:mod:`sepi.matching.row_bands`) may take unless somebody says otherwise."""


@dataclass
class OfViews:
    """What is kept of some views, seen from a reference view; what a kind adds is empty at first."""

    views: npt.NDArray[np.generic]
    reference: tuple[int, int]


_Kept = TypeVar("_Kept", bound=OfViews)


@dataclass
class Workspace:
    """What is kept for one light field.

    Attributes
    ----------
    band_bytes : int
        What bands of rows take at a time, about, or as little as they can.
    detail_bytes : int
        What the detail of all views may take beside bands that need it again and again.
    kept : mapping of type to object
        One of a kind: what is kept of other views goes.
    """

    band_bytes: int = USUAL_BAND_BYTES
    detail_bytes: int = 0
    kept: dict[type, Any] = field(default_factory=dict)


def kept_of(light_field: LightField, kind: type[_Kept]) -> _Kept:
    """What the light field's workspace keeps of a kind, empty at first; without one something that nobody keeps."""
    views, reference, workspace = light_field.views, light_field.reference_position, light_field.workspace
    known: _Kept | None = None if workspace is None else workspace.kept.get(kind)
    # stages may be given the same views as another light field
    if known is None or known.views is not views or known.reference != reference:
        known = kind(views, reference)
        if workspace is not None:
            workspace.kept[kind] = known
    return known


def band_bytes_of(light_field: LightField) -> int:
    """What bands of the light field's rows may take at a time."""
    return USUAL_BAND_BYTES if light_field.workspace is None else light_field.workspace.band_bytes
