"""Other methods' disparity maps in the configuration: the keys below ``external``, and where the maps lie."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict, Field

from sepi.errors import SepiError
from sepi.io.disparity_maps import SUFFIXES, map_file
from sepi.pipeline import VARIANTS
from sepi.validation import require_known, validated

# a file name holds 255 bytes, and pictures of a method are folders of its name
_LONGEST_NAME = 80


class ExternalMaps(BaseModel):
    """Keys of one of the ``external`` methods: where its disparity maps are, and what their values mean."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    path: str = Field(min_length=1)
    scale: float | None = None
    offset: float = 0.0

    def file(self, dataset: str, scene: str) -> Path:
        """The map of a scene: the file that is there, or else the one that was expected."""
        place = Path(os.path.expanduser(self.path.replace("{dataset}", dataset).replace("{scene}", scene)))
        if "{scene}" in self.path:
            # os.path: a folder that may not be entered has no maps, and is no error here
            return map_file(place) if os.path.isdir(place) else place
        try:
            names = sorted(os.listdir(place))
        except OSError:
            names = []
        wanted = [f"{scene}{suffix}" for suffix in SUFFIXES]
        exact = [name for name in wanted if name in names]
        alike = [other for name in wanted for other in names if other.casefold() == name.casefold()]
        files = (place / name for name in (*exact, *alike))
        return next(filter(os.path.isfile, files), place / wanted[0])


def external_maps(name: str, entry: Mapping[str, Any], variants: Mapping[str, object]) -> ExternalMaps:
    """A method's checked entry under ``external``.

    Parameters
    ----------
    name : str
        Of the method.
    entry : mapping
        Its keys.
    variants : mapping
        By the names that the user gave to variants, which no method may have.

    Raises
    ------
    SepiError
        One line that names the key that is wrong, and what would be right.
    """
    where = f"config.external.{name}"
    maps = validated(ExternalMaps, entry, where)
    if name in VARIANTS or name in variants:
        raise SepiError(f"{where}: a variant has this name; give the method another")
    if not name.strip() or name != name.strip() or "/" in name or name.startswith(".") or not name.isprintable():
        raise SepiError(f"{where}: a method's name must be printable text without '/', not beginning with '.'")
    if len(name.encode()) > _LONGEST_NAME:
        raise SepiError(f"config.external.{name[:20]}...: a method's name must have at most {_LONGEST_NAME} bytes")
    require_known(f"{where}.path", re.findall(r"\{[^{}]*\}", maps.path), ("{dataset}", "{scene}"))
    place = Path(os.path.expanduser(maps.path))
    if "{scene}" not in maps.path and (place.is_file() or (place.suffix.lower() in SUFFIXES and not place.is_dir())):
        # one file would be taken for the map of every scene
        raise SepiError(
            f"{where}.path: '{maps.path}' is one file; write {{scene}} for the scene's name, or give the folder"
        )
    if maps.scale == 0:
        raise SepiError(f"{where}.scale: must not be 0, or every disparity would be the offset")
    return maps
