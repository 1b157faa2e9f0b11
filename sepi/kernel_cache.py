"""Where compiled code is kept, if neither the package's folder nor the user's cache can be written."""

from __future__ import annotations

import os
import stat
import sys
import warnings
from pathlib import Path

from sepi.errors import SepiWarning

VARIABLE = "NUMBA_CACHE_DIR"
_PACKAGE = Path(__file__).parent

_untold: list[str] = []


def provide_kernel_cache() -> None:
    """Give numba a temporary folder where it would find none: it then refuses every compiled function.

    Before numba is used, hence when the package is imported. Processes started from here use the same one.
    """
    caches = "~/Library/Caches" if sys.platform == "darwin" else os.environ.get("XDG_CACHE_HOME", "~/.cache")
    own = Path(caches).expanduser() / "numba"
    given = os.environ.get(VARIABLE)
    if any(map(_writable, [*([Path(given)] if given else []), _PACKAGE / "__pycache__", own])):
        return
    try:
        folder = _temporary_folder()
    except OSError:
        # numba says it where it matters
        return
    os.environ[VARIABLE] = folder
    if "numba" in sys.modules:
        import numba

        numba.config.CACHE_DIR = folder  # type: ignore[attr-defined]
    _untold.append(
        f"neither {_PACKAGE} nor {own} can be written: compiled code is kept in {folder}; set {VARIABLE} to a folder "
        "that lasts"
    )


def tell_kernel_cache() -> None:
    """Warn once, before the first kernels are loaded, that what is compiled now may have to be compiled again."""
    while _untold:
        warnings.warn(_untold.pop(), SepiWarning, stacklevel=3)


def _writable(folder: Path) -> bool:
    """Whether a folder can be written, or made."""
    folder = next(place for place in (folder.absolute(), *folder.absolute().parents) if os.path.lexists(place))
    return folder.is_dir() and os.access(folder, os.W_OK | os.X_OK)


def _temporary_folder() -> str:
    """A folder that nobody else can write, since what is in it is run: the user's one, as long as it is theirs."""
    # here, since hardly any start needs it
    import tempfile

    if not hasattr(os, "getuid"):
        return tempfile.mkdtemp(prefix="sepi-kernels-")
    folder = Path(tempfile.gettempdir(), f"sepi-kernels-{os.getuid()}")
    try:
        folder.mkdir(mode=0o700)
    except FileExistsError:
        found = folder.lstat()
        if not stat.S_ISDIR(found.st_mode) or found.st_uid != os.getuid() or found.st_mode & 0o077:
            return tempfile.mkdtemp(prefix="sepi-kernels-")
    return str(folder)
