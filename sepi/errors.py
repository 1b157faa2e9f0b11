"""The one exception that the command line turns into a clear line and a non-zero exit code."""


class SepiError(Exception):
    """Something the user can mend; the message names the file or key, what is wrong and what would be right."""
