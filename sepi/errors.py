"""The exception that the command line turns into a clear line and a non-zero exit code, and the warning it shows."""


class SepiError(Exception):
    """Something the user can mend; the message names the file or key, what is wrong and what would be right."""


class SepiWarning(UserWarning):
    """Something that is probably not as the user meant it; the message says what would be right."""


def printable(text: str) -> str:
    """Text from a file as one line for a message, whatever is in it."""
    return " ".join("".join(letter if letter.isprintable() else " " for letter in text).split())
