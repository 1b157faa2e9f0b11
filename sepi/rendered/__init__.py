"""Path-traced light fields with exact ground truth of every view, by Mitsuba 3 (extra ``[render]``)."""

from sepi.rendered.catalogue import NOISE_LEVELS, RENDERED

__all__ = ["NOISE_LEVELS", "RENDERED"]
