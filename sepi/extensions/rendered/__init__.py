"""Path-traced light fields with exact ground truth of every view, by Mitsuba 3 (extra ``[render]``)."""

from sepi.registry import Extension

EXTENSION = Extension(
    flags={"scenes --rendered": f"{__name__}.commands"},
    datasets={"rendered": f"{__name__}.dataset"},
    rules=[__name__],
)
