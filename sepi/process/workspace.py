"""Intermediate results of a light field's views that stages share, and the memory for them.

A workspace goes with its light field from stage to stage (:attr:`sepi.lightfield.LightField.workspace`). Without one,
or for other views, stages compute them again, with the same results.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    from sepi.lightfield import LightField

USUAL_BAND_BYTES = 2**29
"""Default memory for bands of rows (:mod:`sepi.matching.row_bands`), bytes."""


@dataclass
class OfViews:
    """Kept results for some views and a reference view; fields of subclasses are empty at first."""

    views: npt.NDArray[np.generic]
    reference: tuple[int, int]


_Kept = TypeVar("_Kept", bound=OfViews)


@dataclass
class Workspace:
    """Kept results of one light field, and limits of memory.

    Attributes
    ----------
    band_bytes : int
        Approximate memory for a band of rows, bytes; a band takes more if it cannot take less.
    detail_bytes : int
        Memory for the detail of all views, which bands use repeatedly, bytes.
    kept : mapping of type to object
        Class to its only object; results of other views replace it.
    """

    band_bytes: int = USUAL_BAND_BYTES
    detail_bytes: int = 0
    kept: dict[type, Any] = field(default_factory=dict)


def kept_of(light_field: LightField, kind: type[_Kept]) -> _Kept:
    """The object of this class in the light field's workspace, empty at first; without a workspace a new one."""
    views, reference, workspace = light_field.views, light_field.reference_position, light_field.workspace
    known: _Kept | None = None if workspace is None else workspace.kept.get(kind)
    # the same workspace may come with other views
    if known is None or known.views is not views or known.reference != reference:
        known = kind(views, reference)
        if workspace is not None:
            workspace.kept[kind] = known
    return known


def band_bytes_of(light_field: LightField) -> int:
    """Memory for a band of the light field's rows, bytes."""
    return USUAL_BAND_BYTES if light_field.workspace is None else light_field.workspace.band_bytes
