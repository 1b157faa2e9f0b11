"""Stage textureless (preliminary)."""

from __future__ import annotations

from sepi.command import stage_command
from sepi.lightfield import LightField
from sepi.stage import Choice, NoParameters, Parameters, Progress, StageMaps


def none(light_field: LightField, previous: StageMaps | None, parameters: Parameters, progress: Progress) -> StageMaps:
    """Preliminary."""
    assert previous is not None
    return previous


CHOICES = {"lti": Choice(NoParameters, none), "none": Choice(NoParameters, none)}

if __name__ == "__main__":
    stage_command("textureless", CHOICES)()
