"""Names that a shell, a template or a page could take for something else."""

from sepi.errors import SepiError
from sepi.workflow.config import load_settings

HOSTILE = (
    *("a b", "it's", 'say "so"', "$(touch hacked)", "a;touch hacked", "a|b", "a>hacked", "*", "~", "%s", "\\"),
    *("{scene}", "{{a}}", "<script>hacked()</script>", "&amp;", "a\nb", "a\0b", "\x1b[31m", "\u202eabc", "\ud800"),
    *("..", "", "-rf", "a/b", "/etc/passwd", "a" * 300),
)
FOLDER = 'it\'s $(touch hacked); `id` %s "so" & <B>'
"""Of light fields, maps and the run: whatever the system allows."""


def accepted(name: str) -> bool:
    """Whether a method may have this name."""
    try:
        return bool(load_settings({"external": {name: "/maps"}}).external)
    except SepiError:
        return False
