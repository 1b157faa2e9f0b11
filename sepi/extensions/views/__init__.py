"""Uses of a finished map that need all views: a map for every view, and refocused pictures."""

from sepi.registry import Extension

EXTENSION = Extension(
    commands={"refocus": (f"{__name__}.refocus", "Refocus the light field INPUT.")},
    flags={"depth --all-views": f"{__name__}.depth_flags"},
    names={
        **dict.fromkeys(("AllViews", "estimate_all_views"), f"{__name__}.all_views"),
        **dict.fromkeys(("all_in_focus", "refocus"), f"{__name__}.refocusing"),
    },
)
