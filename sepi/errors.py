"""The exception that the command line turns into a clear line and a non-zero exit code, and the warning it shows."""


class SepiError(Exception):
    """Something the user can mend; the message names the file or key, what is wrong and what would be right.

    Parameters
    ----------
    message : str
        Text of users and files may be in it; the error's own text is one line that a terminal can show.
    """

    def __init__(self, message: str) -> None:
        super().__init__(one_line(message))


class SepiWarning(UserWarning):
    """Something that is probably not as the user meant it; the message says what would be right.

    Parameters
    ----------
    message : str
        As that of an error.
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
