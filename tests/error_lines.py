"""Commands as a user calls them, and the one line that is told of an error, by a command or by a function."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import click
import pytest
from click.testing import CliRunner, Result

from sepi.cli.main import main
from sepi.errors import SepiError
from sepi.io.readers.formats import read
from sepi.io.readers.options import ReadOptions
from sepi.reading import read_light_field


def call(*words: object, of: click.Command = main) -> Result:
    """``sepi``, or another command, with these words."""
    return CliRunner().invoke(of, list(map(str, words)))


def done(*words: object, of: click.Command = main) -> Result:
    """The same, which must end well."""
    called = call(*words, of=of)
    assert called.exit_code == 0, (called.output, called.exception)
    return called


def everything_in(folder: Path | str) -> dict[str, bytes]:
    """Path below a folder to what the file holds."""
    return {str(path.relative_to(folder)): path.read_bytes() for path in Path(folder).rglob("*") if path.is_file()}


def error_of(called: Result) -> str:
    """The one line that a failed command prints."""
    assert called.exit_code == 1, called.output
    assert called.stdout == ""
    assert isinstance(called.exception, SystemExit)
    (line,) = called.stderr.splitlines()
    assert line.startswith("sepi: ")
    return line


def refused(path: Path, file_format: str | None = None, **options: Any) -> str:
    """The one line, which names it, of the error with which a light field is not read with these options."""
    message = reading_error(path, lambda path: read(path, ReadOptions(**options), file_format))
    assert str(path) in message
    return message


def reading_error(path: Path, read: Callable[[Path], Any] = read_light_field) -> str:
    """The one line of the error with which a path is not read."""
    with pytest.raises(SepiError) as caught:
        read(path)
    message = str(caught.value)
    assert "\n" not in message
    return message
