"""The check of an external method's entry in the configuration."""

from __future__ import annotations

import os
import re
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

from sepi.errors import SepiError
from sepi.io.disparity_maps import SUFFIXES
from sepi.io.external_maps import ExternalSource
from sepi.validation import require_known, validated

# a file name holds 255 bytes, and pictures of a method are folders of its name
_LONGEST_NAME = 80


def external_source(name: str, entry: Mapping[str, Any], variants: Collection[str]) -> ExternalSource:
    """A method's checked entry under ``external``.

    Parameters
    ----------
    name : str
        Of the method.
    entry : mapping
        Its keys.
    variants : collection of str
        Names of variants, which no method may have.

    Raises
    ------
    SepiError
        One line that names the key that is wrong, and what would be right.
    """
    where = f"config.external.{name}"
    source = validated(ExternalSource, entry, where)
    if name in variants:
        raise SepiError(f"{where}: a variant has this name; give the method another")
    if not name.strip() or name != name.strip() or "/" in name or name.startswith(".") or not name.isprintable():
        raise SepiError(f"{where}: a method's name must be printable text without '/', not beginning with '.'")
    if len(name.encode()) > _LONGEST_NAME:
        raise SepiError(f"config.external.{name[:20]}...: a method's name must have at most {_LONGEST_NAME} bytes")
    require_known(f"{where}.path", re.findall(r"\{[^{}]*\}", source.path), ("{dataset}", "{scene}"))
    path = Path(os.path.expanduser(source.path))
    if "{scene}" not in source.path and (path.is_file() or (path.suffix.lower() in SUFFIXES and not path.is_dir())):
        # one file would be taken for the map of every scene
        raise SepiError(
            f"{where}.path: '{source.path}' is one file; write {{scene}} for the scene's name, or give the folder"
        )
    if source.scale == 0:
        raise SepiError(f"{where}.scale: must not be 0, or every disparity would be the offset")
    return source
