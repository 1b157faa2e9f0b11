"""Pictures in a folder of views that are none of them, told by their size."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path

from sepi.errors import SepiError
from sepi.io.images import picture_header

# part of the pictures, or one, that may be odd where all others agree
_ODD = 0.1


def odd_pictures(folder: Path, names: Iterable[str]) -> dict[str, str]:
    """The few pictures of another size than all others, and what is odd about them; none where no size prevails.

    Pictures that cannot be read, and links, are left to those that read them.
    """
    sizes: dict[str, tuple[int, int]] = {}
    for name in names:
        with suppress(SepiError):
            if not (folder / name).is_symlink():
                header = picture_header(folder / name)
                sizes[name] = header.width, header.height
    if not sizes:
        return {}
    usual, count = Counter(sizes.values()).most_common(1)[0]
    if count < 2 or len(sizes) - count > max(1, _ODD * len(sizes)):
        return {}
    return {
        name: f"{size[0]}x{size[1]} pixels, but all other views have {usual[0]}x{usual[1]}"
        for name, size in sizes.items()
        if size != usual
    }
