"""``python -m sepi``: the same as the command ``sepi``."""

from sepi.cli import main

main(prog_name="sepi")
