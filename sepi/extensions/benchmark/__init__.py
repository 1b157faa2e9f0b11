"""Submissions to the HCI 4D light field benchmark."""

from sepi.registry import Extension

EXTENSION = Extension(
    commands={
        "check-submission": (f"{__name__}.hci_submission", "Check a submission to the HCI 4D benchmark."),
        "submission": (f"{__name__}.hci_submission", "Pack results as a submission to the HCI 4D benchmark."),
    }
)
