"""Scenes of the workflow: built-in scenes, scenes found in a folder, and light fields given one by one."""

from __future__ import annotations

import math
import os
import re
from collections import Counter
from collections.abc import Callable, Collection, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from functools import cached_property
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

from sepi.errors import SepiError
from sepi.io.disparity_maps import TruthFile
from sepi.io.images import SUFFIXES
from sepi.io.readers import exported, hci
from sepi.io.readers.formats import FORMATS, Format, format_of, size_of
from sepi.io.readers.options import ReadOptions
from sepi.io.readers.view_files import view_files
from sepi.validation import require_known
from sepi.validation.models import CheckedModel
from sepi.workflow.result_paths import RESULTS

if TYPE_CHECKING:
    from sepi.report.plan import Plan

VIEW_PATTERN = "input_Cam*.png"

LONGEST_NAME = 80
"""Most bytes of the name of a scene, a variant or a method: a file name of at most 255 joins several."""

_FORMAT_OF = {"hci": "hci", "hci_2013": "hci-2013"}
# a scene's name is a folder name below results/ and a word on the command line
_NAME = re.compile(rf"[A-Za-z0-9][A-Za-z0-9_.+-]{{0,{LONGEST_NAME - 1}}}")
_REPLACED = re.compile("<[a-z][a-z0-9_]*>|[{}]+")
# memory of Python and its libraries without data, in MB
_LIBRARIES = 300
# seconds that Python takes to start and import, and how much slower than measured a shared cluster node may be
_START_SECONDS = 20
_SLOWER = 4
# bytes of a pixel of 8-bit colours
_RGB = 3
# levels of folders: root/scene, root/category/scene, and one more
_LEVELS = 3


@dataclass(frozen=True)
class Scene:
    """One light field of the workflow.

    Attributes
    ----------
    dataset, name : str
        Name of the scene's folder, ``results/DATASET/NAME``.
    source : Path
        Folder or file to read; the name of a built-in scene.
    files : tuple of Path
        Files that ingest reads, without ground truth; a change in one of them is a change of the scene.
    views : int
        Number of views.
    height, width : int
        Size of a view in pixels.
    pixel_bytes : int
        Bytes of a decoded pixel of a view.
    disparity_range : tuple of float or None
        Range that the user set, pixels per view step; None: the scene's own or an estimate.
    flags : tuple of str
        Flags for the command line of ingest.
    own_truth : TruthFile or None
        The user's ground truth, instead of the light field's.
    module : str or None
        Module whose ``read_scene(source, **settings)`` and ``read_truth(source, **settings)`` read or render the
        source, with settings from ``--set KEY=VALUE`` among the flags; None: a reader of files.
    """

    dataset: str
    name: str
    source: Path
    files: tuple[Path, ...]
    views: int
    height: int
    width: int
    pixel_bytes: int = _RGB
    disparity_range: tuple[float, float] | None = None
    flags: tuple[str, ...] = ()
    own_truth: TruthFile | None = None
    module: str | None = None

    @property
    def samples(self) -> int:
        """Number of pixels of all views together."""
        return self.views * self.height * self.width

    @property
    def is_made(self) -> bool:
        """Whether a job of the workflow makes the source."""
        return self.source.is_relative_to(RESULTS)

    @property
    def reader(self) -> str:
        """Module that reads the views, or renders them."""
        if self.module is not None:
            return self.module
        # ingest reports an unknown format
        return format_of.__module__ if self._format is None else self._format.matches.__module__

    @property
    def truth(self) -> tuple[Path, ...]:
        """Files with ground truth and masks: a change in one of them makes new scores, but no new maps."""
        return (*([] if self.own_truth is None else [self.own_truth.path]), *self.brought_truth)

    @property
    def brought_truth(self) -> tuple[Path, ...]:
        """Files with ground truth and masks that belong to the light field itself."""
        if self.module is not None:
            return self.files
        return () if self._format is None else tuple(self._format.truth_files(self.source))

    @cached_property
    def _format(self) -> Format | None:
        given = dict(pairwise(self.flags)).get("--format", _FORMAT_OF.get(self.dataset))
        with suppress(SepiError):
            return format_of(self.source, given)
        return None

    def memory_mb(self, bytes_per_sample: float, bytes_per_pixel: float = 0, copies: int = 2) -> int:
        """Memory of a job on this scene in MB.

        Parameters
        ----------
        bytes_per_sample, bytes_per_pixel : float
            Memory of the job for each pixel of all views and for each pixel of one view, for views of 8-bit colours.
        copies : int
            Number of copies of the views in memory, which count if values are wider than 8 bit.
        """
        wider = copies * max(0, self.pixel_bytes - _RGB)
        held = (bytes_per_sample + wider) * self.samples + bytes_per_pixel * self.height * self.width
        return _LIBRARIES + round(held / 2**20)

    def minutes(self, seconds_per_megasample: float, seconds_per_megapixel: float = 0) -> int:
        """Time limit of a job on a cluster in minutes: several times its duration on one core.

        Parameters
        ----------
        seconds_per_megasample, seconds_per_megapixel : float
            Measured duration for a million pixels of all views, and of one view.
        """
        measured = (seconds_per_megasample * self.samples + seconds_per_megapixel * self.height * self.width) / 1e6
        return math.ceil((_START_SECONDS + _SLOWER * measured) / 60)


class Dataset(CheckedModel):
    """Keys of a dataset that an extension adds to the configuration."""

    description: ClassVar[str]
    """Text of its key in ``config.yaml``."""

    apart: ClassVar[bool] = False
    """Whether ``snakemake all`` leaves its scenes out, for rules and a report of its own."""

    def found(self, where: str, variants: Collection[str]) -> list[Scene]:
        """Its scenes.

        Raises
        ------
        SepiError
            If a value is wrong, such as a variant that is none of these; ``where`` is the key in the message.
        """
        raise NotImplementedError

    def report(self, plan: Plan, scenes: Sequence[str]) -> Plan:
        """The plan of the report of its scenes, of that of the main report; asked if they stand apart."""
        raise NotImplementedError


def require_plain_path(path: str, where: str) -> None:
    """Raise if Snakemake would replace a part of a path.

    Raises
    ------
    SepiError
        If the path has a word in angle brackets or a brace.
    """
    found = _REPLACED.search(path)
    if found:
        raise SepiError(f"{where}: Snakemake would replace '{found[0]}' in '{path}'; rename it, or link to it")


def scenes_in(
    root: Path, dataset: str, where: str, include: Sequence[str] = (), exclude: Sequence[str] = ()
) -> list[Scene]:
    """Scenes of a dataset below a folder, sorted by name.

    A scene of ``hci`` is a folder with ``input_Cam*.png``; ``root`` may be one itself, or hold scenes or categories of
    scenes. A scene of ``hci_2013`` is an HDF5 file with a dataset ``LF``; it has the name of the file, or of its folder
    if the file is ``lf.h5``.

    Parameters
    ----------
    root : Path
        Folder to search, or such a file.
    dataset : str
        ``"hci"`` or ``"hci_2013"``.
    where : str
        Configuration key of ``root``, for messages.
    include, exclude : sequence of str
        Patterns (:mod:`fnmatch`) of names to take (default: all) and to leave out.

    Raises
    ------
    SepiError
        If the folder does not exist or has no scene, a pattern matches none, none is left, two scenes have one name, or
        a name is not valid.
    """
    is_archive = dataset == "hci_2013"
    # os.path: a name that is too long is no error there
    if not (os.path.isdir(root) or (os.path.isfile(root) and is_archive)):
        raise SepiError(f"{where}: no folder '{root}'")
    if is_archive:
        require_known(f"{where}: format", [_FORMAT_OF[dataset]], FORMATS)
        expected, is_file = "HDF5 files with a dataset LF", FORMATS[_FORMAT_OF[dataset]].matches
        scenes = [_archive_scene(dataset, path) for path in _places(root.resolve(), is_file, _LEVELS + 1)]
    else:
        expected = f"folders with {VIEW_PATTERN}"
        folders = _places(root.resolve(), lambda path: any(path.glob(VIEW_PATTERN)), _LEVELS)
        scenes = [_benchmark_scene(dataset, folder.name, folder) for folder in folders]
    if not scenes:
        raise SepiError(f"{where}: no scene in '{root}' (expected {expected})")
    for key, patterns in (("include", include), ("exclude", exclude)):
        for pattern in patterns:
            if not any(_matches(scene, [pattern]) for scene in scenes):
                raise SepiError(f"{where}.{key}: no scene in '{root}' is called '{pattern}'")
    scenes = [scene for scene in scenes if _matches(scene, include or ["*"]) and not _matches(scene, exclude)]
    if not scenes:
        raise SepiError(f"{where}: include and exclude leave no scene of '{root}'")
    for name, count in Counter(scene.name for scene in scenes).items():
        _require_plain(name, where)
        if count > 1:
            both = " and ".join(str(scene.source) for scene in scenes if scene.name == name)
            raise SepiError(f"{where}: two scenes are called '{name}': {both}")
    return sorted(scenes, key=lambda scene: scene.name)


def _matches(scene: Scene, patterns: Sequence[str]) -> bool:
    return any(fnmatchcase(scene.name, pattern) for pattern in patterns)


def own_scene(name: str, source: Path, flags: tuple[str, ...], where: str, truth: TruthFile | None = None) -> Scene:
    """A light field of any format as a scene of dataset ``own``.

    Raises
    ------
    SepiError
        If the light field or its ``truth`` does not exist, or ``name`` is not valid.
    """
    _require_plain(name, where)
    if not os.path.exists(source):
        raise SepiError(f"{where}: no file or folder '{source}'")
    source = source.resolve()
    if truth is not None:
        if not os.path.isfile(truth.path):
            raise SepiError(f"{where}.truth: no file '{truth.path}'")
        truth = replace(truth, path=truth.path.resolve())
    word = dict(pairwise(flags)).get("--format")
    if hci.matches(source) and (word == "hci" or (word is None and not exported.matches(source))):
        return replace(_benchmark_scene("own", name, source, flags), own_truth=truth)
    known = None
    # ingest reports an unknown format
    with suppress(SepiError):
        known = format_of(source, word)
    if known is not None and known.files_of is not None:
        given = dict(pairwise(flags))
        options = ReadOptions(images=given.get("--images"), crop_of=given.get("--crop-of"))
        read, pictures = known.files_of(source, options)
        return Scene("own", name, source, tuple(read), *size_of(pictures), flags=flags, own_truth=truth)
    inside = [path for path in view_files(source) if path.is_file()] if source.is_dir() else [source]
    files = tuple(path for path in inside if not path.name.startswith("."))
    if truth is not None:
        files = tuple(path for path in files if path.resolve() != truth.path)
    # other files beside the images are no part of the light field
    if exported.matches(source):
        manifest, *others = exported.truth_files(source)
        files = (*(path for path in files if path not in (manifest, *others)), manifest)
    read = tuple(path for path in files if path.suffix.lower() in SUFFIXES or path.name == exported.MANIFEST)
    files = read if source.is_dir() and read else files
    return Scene("own", name, source, files, *size_of(files), flags=flags, own_truth=truth)


def _require_plain(name: str, where: str) -> None:
    if not _NAME.fullmatch(name):
        raise SepiError(f"{where}: a scene is named with letters, digits and _ . + -, at most {LONGEST_NAME}: '{name}'")


def _benchmark_scene(dataset: str, name: str, folder: Path, flags: tuple[str, ...] = ()) -> Scene:
    views = sorted(folder.glob(VIEW_PATTERN))
    return Scene(dataset, name, folder, (*views, *folder.glob(hci.PARAMETERS)), *size_of(views), flags=flags)


def _archive_scene(dataset: str, path: Path) -> Scene:
    name = path.parent.name if path.stem.lower() == "lf" else path.stem
    return Scene(dataset, name, path, (path,), *size_of((path,)))


def _places(path: Path, is_scene: Callable[[Path], bool], levels: int) -> Iterator[Path]:
    """Scenes below a folder, or the path itself if it is one."""
    if is_scene(path):
        yield path
    elif path.is_dir() and levels:
        for inner in sorted(path.iterdir()):
            if not inner.name.startswith("."):
                yield from _places(inner, is_scene, levels - 1)
