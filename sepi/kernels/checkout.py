"""The kernels of a checkout: if their sources are not those that they were built from, they are built when imported.

`python sepi/kernels/checkout.py` prints the digest of the sources; with `build` it builds what changed.
"""

from __future__ import annotations

import fcntl
import hashlib
import os
import subprocess
import sys
from pathlib import Path

_ROOT = Path(__file__).parents[2]
_RECIPE = _ROOT / "CMakeLists.txt"
_BUILT_FROM = Path(__file__).with_name("built_from")


def source_digest() -> str:
    """SHA-256 of the sources of all kernels and of CMakeLists.txt, in hexadecimal digits."""
    digest = hashlib.sha256(_RECIPE.read_bytes())
    places = ("sepi", "sepi/*", "sepi/extensions/*")
    for source in sorted(path for place in places for path in _ROOT.glob(f"{place}/kernels/*.?pp")):
        digest.update(source.read_bytes())
    return digest.hexdigest()


def is_current() -> bool:
    """Whether this is no checkout, or its kernels were built from the sources that it has."""
    if not _RECIPE.is_file():
        return True
    return _BUILT_FROM.is_file() and _BUILT_FROM.read_text() == source_digest()


def build(*, only_if_changed: bool = False) -> None:
    """Build the kernels in place, one process at a time. Raises `ImportError` if that fails, and prints why."""
    folder = _ROOT / "build" / "kernels"
    search = os.pathsep.join([str(Path(sys.executable).parent), os.environ.get("PATH", os.defpath)])
    settings = ["-DCMAKE_BUILD_TYPE=Release", f"-DPython_EXECUTABLE={sys.executable}"]
    configure = ["-G", "Ninja", "-S", _ROOT, "-B", folder, *settings]
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with (folder / "lock").open("w") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            if only_if_changed and is_current():
                # another process built them meanwhile
                return
            # CMake would leave one be that is younger than a second
            _BUILT_FROM.unlink(missing_ok=True)
            for words in (configure, ["--build", folder], ["--install", folder, "--prefix", _ROOT]):
                done = subprocess.run(
                    ["cmake", *words], env=os.environ | {"PATH": search}, capture_output=True, text=True, check=False
                )
                if done.returncode:
                    print(done.stdout, done.stderr, sep="\n", file=sys.stderr)
                    raise ImportError("sepi: building its kernels failed; the output of cmake above has the reason")
    except OSError:
        raise ImportError("sepi: its kernels were built from other sources; run `make` to build them") from None


if __name__ == "__main__":
    if sys.argv[1:] == ["build"]:
        build()
    else:
        print(source_digest(), end="")
