"""Whether the views are in the right order."""

from __future__ import annotations

from sepi.lightfield import LightField


def order_warning(light_field: LightField) -> str | None:
    """Placeholder."""
    return None
