"""Intermediate results of a light field's views that stages share, and the memory for them.

A workspace goes with its light field from stage to stage (:attr:`sepi.lightfield.LightField.workspace`). Without one,
or for other views, stages compute them again, with the same results.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, TypeVar

if TYPE_CHECKING:
    from sepi.lightfield import LightField

USUAL_BAND_BYTES = 2**29
"""Default memory for bands of rows (:mod:`sepi.matching.row_bands`), bytes."""


_T = TypeVar("_T")


@dataclass
class Workspace:
    """Kept results of one light field, and limits of memory.

    Attributes
    ----------
    band_bytes : int
        Approximate memory for a band of rows, bytes; a band takes more if it cannot take less.
    detail_bytes : int
        Memory for the detail of all views, which bands use repeatedly, bytes.
    kept : mapping of str to tuple
        Name to views, reference view and settings, and the result of these; that of others replaces it.
    """

    band_bytes: int = USUAL_BAND_BYTES
    detail_bytes: int = 0
    kept: dict[str, tuple[Any, Any, Any]] = field(default_factory=dict)


def kept(light_field: LightField, what: str, make: Callable[[], _T], settings: object = None) -> _T:
    """What was made of the light field's views with these settings: from its workspace, or made now."""
    workspace = light_field.workspace
    if workspace is None:
        return make()
    # the same workspace may come with other views
    made_with = light_field.reference_position, settings
    known = workspace.kept.get(what)
    if known is None or known[0] is not light_field.views or known[1] != made_with:
        # free its memory first
        known = workspace.kept[what] = None, None, None
        known = workspace.kept[what] = light_field.views, made_with, make()
    found: _T = known[2]
    return found


def forget(light_field: LightField, what: str) -> None:
    """Free what is kept; it is made again on demand."""
    if light_field.workspace is not None:
        light_field.workspace.kept.pop(what, None)


def band_bytes_of(light_field: LightField) -> int:
    """Memory for a band of the light field's rows, bytes."""
    return USUAL_BAND_BYTES if light_field.workspace is None else light_field.workspace.band_bytes
