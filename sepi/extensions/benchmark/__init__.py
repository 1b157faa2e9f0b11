"""Submissions to the HCI 4D light field benchmark."""

from sepi.registry import Extension

EXTENSION = Extension(
    commands={
        "check-submission": (f"{__name__}.commands", "Check a submission to the HCI 4D benchmark."),
        "submission": (f"{__name__}.commands", "Pack results as a submission to the HCI 4D benchmark."),
    }
)
