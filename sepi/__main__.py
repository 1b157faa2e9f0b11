"""``python -m sepi``: the same as the command ``sepi``."""

from sepi.cli.main import main

main(prog_name="sepi")
