"""The exception that the command line turns into a clear line and a non-zero exit code, and the warning it shows."""


class SepiError(Exception):
    """Something the user can mend; the message names the file or key, what is wrong and what would be right.

    Parameters
    ----------
    message : str
        Text of users and files may be in it; the error's own text is one line that a terminal can show.

    Examples
    --------
    What a program that works through many light fields catches: any other exception is a bug.

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
    """Something that is probably not as the user meant it; the message says what would be right.

    Parameters
    ----------
    message : str
        As that of an error.

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

    To end with an error in place of it:

    >>> warnings.simplefilter("error", sepi.SepiWarning)
    """

    def __init__(self, message: str) -> None:
        super().__init__(one_line(message))


def one_line(text: str) -> str:
    """Text without what would end a line or command a terminal; as it is where there is none of that."""
    if text.isprintable():
        return text
    return "".join(letter if letter.isprintable() else " " if letter.isspace() else "?" for letter in text)


def printable(text: str) -> str:
    """Text from a file as one line for a message, whatever is in it."""
    return " ".join("".join(letter if letter.isprintable() else " " for letter in text).split())
