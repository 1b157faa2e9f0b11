"""The report's interactive page, the same viewer for two maps, and a look into single pixels."""

from sepi.registry import Extension

EXTENSION = Extension(
    commands={"compare": (f"{__name__}.compare", "Show two disparity maps side by side on a page.")},
    scenes={"page": f"{__name__}.scene"},
    rules=[__name__],
)
