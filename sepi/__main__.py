"""``python -m sepi``: the same as the command ``sepi``."""

from sepi.cli.main import run

run()
