"""The error that the command line shows as one line with exit code 1, and the warning."""

import warnings


class SepiError(Exception):
    """Something the user can mend; the message names the file or key, what is wrong and what would be right.

    Parameters
    ----------
    message : str
        May contain text of users and files; the error's text is one printable line.

    Examples
    --------
    A program for many light fields catches this error; any other exception is a bug:

    >>> import sepi
    >>> for name in ("cotton", "antinous"):
    ...     try:
    ...         sepi.read_light_field(name)
    ...     except sepi.SepiError as error:
    ...         print("left out:", error)
    left out: cotton: no such file or folder
    left out: antinous: no such file or folder
    """

    def __init__(self, message: str) -> None:
        super().__init__(one_line(message))


class SepiWarning(UserWarning):
    """Something that the user probably did not intend; the message says what would be right.

    Parameters
    ----------
    message : str
        As for :class:`SepiError`.

    Examples
    --------
    A light field whose rows of views run the wrong way is read, with a warning:

    >>> import warnings
    >>> from pathlib import Path
    >>> import sepi
    >>> from sepi.scenes import render, write_hci
    >>> write_hci(render("pyramids", size=96, views=5), Path("scene"))
    >>> with warnings.catch_warnings(record=True) as told:
    ...     warnings.simplefilter("always", sepi.SepiWarning)
    ...     light_field = sepi.read_light_field("scene", options=sepi.ReadOptions(order="flip-rows"))
    >>> [warning.category.__name__ for warning in told]
    ['SepiWarning']

    To get an error instead:

    >>> warnings.simplefilter("error", sepi.SepiWarning)
    """

    def __init__(self, message: str) -> None:
        super().__init__(one_line(message))


def warn(message: str, up: int = 1) -> None:
    """Warn of something that the user probably did not intend, as of the line ``up`` calls above the caller's."""
    warnings.warn(message, SepiWarning, stacklevel=up + 2)


def one_line(text: str) -> str:
    """Text with line ends and control characters escaped; unchanged if it has none."""
    if text.isprintable():
        return text
    return "".join(letter if letter.isprintable() else " " if letter.isspace() else "?" for letter in text)


def printable(text: str) -> str:
    """Any text from a file as one printable line for a message."""
    return " ".join("".join(letter if letter.isprintable() else " " for letter in text).split())
