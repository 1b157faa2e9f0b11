"""The one line that a user is told, by a command or by a function."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from click.testing import Result

from sepi.errors import SepiError
from sepi.reading import read_light_field


def error_of(called: Result) -> str:
    """The one line that a failed command prints."""
    assert called.exit_code == 1, called.output
    assert called.stdout == ""
    assert isinstance(called.exception, SystemExit)
    (line,) = called.stderr.splitlines()
    assert line.startswith("sepi: ")
    return line


def reading_error(path: Path, read: Callable[[Path], Any] = read_light_field) -> str:
    """The one line of the error with which a path is not read."""
    with pytest.raises(SepiError) as caught:
        read(path)
    message = str(caught.value)
    assert "\n" not in message
    return message
