"""An extension of sepi: a method, a reader, a command and a dataset."""

from sepi.registry import Extension

EXTENSION = Extension(
    choices={"optimize.median": f"{__name__}.method"},
    variants={"median": {"base": "fast", "optimize": "median"}},
    readers={"raw-views": f"{__name__}.reader"},
    commands={"brightness": (f"{__name__}.command", "Print the mean of a light field.")},
    datasets={"shots": f"{__name__}.dataset"},
)
