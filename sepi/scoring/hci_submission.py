"""A submission to the HCI 4D light field benchmark: a zip archive of disparity maps and run times of its 12 scenes.

The archive's root holds ``disp_maps/SCENE.pfm``, 512 x 512 pixels and one channel, and ``runtimes/SCENE.txt``, the
seconds as a number. The benchmark's own check looks for the files and the size of the maps; this one also finds what
passes there and spoils the scores, such as missing values, and what else the archive holds.

References
----------
.. [1] K. Honauer, O. Johannsen, D. Kondermann, B. Goldluecke, "A dataset and evaluation methodology for depth
       estimation on 4D light fields", ACCV 2016. doi:10.1007/978-3-319-54187-7_2
"""

from __future__ import annotations

import math
import re
import stat
import struct
import tempfile
import zipfile
import zlib
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from sepi.errors import SepiError
from sepi.io.files import atomic_path
from sepi.io.pfm import read_pfm
from sepi.io.result_folder import RUNTIME, read_result
from sepi.validation import require_known

SCENES = (
    *("backgammon", "dots", "pyramids", "stripes"),
    *("boxes", "cotton", "dino", "sideboard"),
    *("bedroom", "bicycle", "herbs", "origami"),
)
"""The benchmark's scenes: stratified, training, test."""

SHAPE = (512, 512)
"""Height and width of their views in pixels."""

MAPS, RUNTIMES = "disp_maps", "runtimes"

_PIXELS = f"{SHAPE[1]}x{SHAPE[0]}"
_NUMBER = re.compile(r"[-+]?(\d+(\.\d*)?|\.\d+)([eE][-+]?\d+)?|[-+]?(nan|inf)", re.IGNORECASE)
# room for a header besides the pixels; for a number and white space around it
_MOST_BYTES = {MAPS: 4 * SHAPE[0] * SHAPE[1] + 256, RUNTIMES: 64}
# of the same kind in a report
_MOST_LINES = 10


def _names_of(scene: str) -> tuple[str, str]:
    return f"{MAPS}/{scene}.pfm", f"{RUNTIMES}/{scene}.txt"


_EXPECTED = frozenset(name for scene in SCENES for name in _names_of(scene))
_PARTS = ([MAPS], [RUNTIMES])
_FOREIGN = "does not belong to a submission"


@dataclass(frozen=True)
class Entry:
    """One scene of a submission.

    Attributes
    ----------
    disparity : Path
        PFM file.
    seconds : float
        Run time.
    """

    disparity: Path
    seconds: float


def entry_of(folder: Path, runtimes: Mapping[str, float]) -> tuple[str, Entry]:
    """The scene of a result, and what it adds to a submission.

    Parameters
    ----------
    folder : Path
        Written by ``sepi depth --timing``: ``disparity.pfm``, ``result.h5`` (which names the scene), ``runtime.txt``.
    runtimes : mapping of str to float
        Seconds by scene, in place of ``runtime.txt``.

    Raises
    ------
    SepiError
        If it is not such a folder, its scene is none of the benchmark's, or its run time is not known.
    """
    if not folder.is_dir():
        raise SepiError(f"{folder}: no such folder; expected one that 'sepi depth --timing' wrote")
    result = read_result(folder)
    scene = result.scene
    if result.from_centre != (0, 0):
        raise SepiError(f"{folder}: depth of another view; the benchmark wants that of the centre view, without --view")
    require_known(f"{folder}: scenes of the benchmark", [scene], SCENES)
    if scene in runtimes:
        return scene, Entry(folder / "disparity.pfm", runtimes[scene])
    path = folder / RUNTIME
    if not path.is_file():
        raise SepiError(f"{path}: no such file; run 'sepi depth --timing', or give --runtime {scene}=SECONDS")
    seconds, problem = _seconds_in(path)
    if problem:
        raise SepiError(f"{path}: {problem}")
    return scene, Entry(folder / "disparity.pfm", seconds)


def write_submission(path: Path, entries: Mapping[str, Entry], *, partial: bool = False) -> None:
    """Write a submission, whole or not at all; equal content gives equal bytes.

    Parameters
    ----------
    path : Path
        Zip archive to write.
    entries : mapping of str to Entry
        By scene.
    partial : bool
        Take fewer than all scenes.

    Raises
    ------
    SepiError
        If the submission has a problem, as :func:`problems_of` finds it, or cannot be written.
    """
    with tempfile.TemporaryDirectory(prefix="sepi-") as name:
        files: dict[str, Path] = {}
        for scene, entry in entries.items():
            disparity, runtime = _names_of(scene)
            files |= {disparity: entry.disparity, runtime: Path(name) / f"{scene}.txt"}
            files[runtime].write_text(f"{entry.seconds:.10g}\n", encoding="ascii")
        problems = _strangers(files) + _problems_in(files, {}, partial)
        if problems:
            more = f" (and {len(problems) - 1} more)" if len(problems) > 1 else ""
            raise SepiError(f"{path}: not written: {problems[0]}{more}")
        try:
            with atomic_path(path) as temporary, zipfile.ZipFile(temporary, "w") as archive:
                for inner, file in sorted(files.items()):
                    # neither dates nor compression, which differ from run to run and from library to library
                    info = zipfile.ZipInfo(inner)
                    info.create_system, info.external_attr = 3, (stat.S_IFREG | 0o644) << 16
                    archive.writestr(info, file.read_bytes())
        except OSError as error:
            raise SepiError(f"{path}: cannot be written ({error.strerror or error})") from error


def problems_of(path: Path, *, partial: bool = False) -> list[str]:
    """What is wrong with a submission.

    Parameters
    ----------
    path : Path
        Zip archive, or a folder with the same content.
    partial : bool
        Take fewer than all scenes.

    Returns
    -------
    list of str
        One line each, which begins with a name inside the submission, or with ``path``; empty if nothing is wrong.

    Raises
    ------
    SepiError
        If there is nothing at ``path``, or it cannot be read.
    """
    try:
        if path.is_dir():
            names = _names_in(path)
            return _strangers(names) + _problems_in({name: path / name for name in names}, {}, partial)
        if path.is_file():
            return _problems_of_archive(path, partial)
    except OSError as error:
        raise SepiError(f"{path}: cannot be read ({error.strerror or error})") from error
    raise SepiError(f"{path}: no such file or folder")


def _problems_of_archive(path: Path, partial: bool) -> list[str]:
    try:
        archive = zipfile.ZipFile(path)
    except (zipfile.BadZipFile, ValueError, OverflowError, struct.error, NotImplementedError) as error:
        return [f"{path}: not a readable zip archive ({error})"]
    with archive, tempfile.TemporaryDirectory(prefix="sepi-") as folder:
        names = [info.filename for info in archive.infolist()]
        twice = [f"{_shown(name)}: {count} files of this name" for name, count in Counter(names).items() if count > 1]
        files, damaged = _unpacked(archive, Path(folder))
        return _first(twice, "names given more than once") + _strangers(names) + _problems_in(files, damaged, partial)


def _unpacked(archive: zipfile.ZipFile, folder: Path) -> tuple[dict[str, Path], dict[str, str]]:
    """Unpack the files of a submission, no other: those that could be, and what is wrong with those that could not."""
    files: dict[str, Path] = {}
    damaged: dict[str, str] = {}
    for number, info in enumerate(archive.infolist()):
        if info.filename not in _EXPECTED:
            continue
        # under a name that the archive has no say in
        target = folder / f"{number}"
        if problem := _unpacking_problem(info):
            damaged[info.filename] = problem
            continue
        try:
            target.write_bytes(archive.read(info))
            files[info.filename] = target
        except (zipfile.BadZipFile, zlib.error, EOFError, RuntimeError, ValueError, OSError) as error:
            damaged[info.filename] = f"cannot be unpacked ({error})"
    return files, damaged


def _unpacking_problem(info: zipfile.ZipInfo) -> str | None:
    if stat.S_ISLNK(info.external_attr >> 16):
        return "a link; expected a file"
    if info.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
        return f"compressed by method {info.compress_type}; expected 'deflated' or none"
    # zipfile unpacks no more than the file claims
    return _size_problem(info.filename, info.file_size)


def _size_problem(name: str, size: int) -> str | None:
    if size <= _MOST_BYTES[name.partition("/")[0]]:
        return None
    what = f"a map of {_PIXELS} pixels" if name.startswith(MAPS) else "one number"
    return f"{size} bytes are too many for {what}"


def _names_in(folder: Path) -> list[str]:
    """Files and folders down to the second level."""
    names = []
    for entry in sorted(folder.iterdir()):
        inner = sorted(entry.iterdir()) if entry.is_dir() else [entry]
        names += [file.relative_to(folder).as_posix() for file in inner]
    return names


def _strangers(names: Iterable[str]) -> list[str]:
    """Problems with names that do not belong to a submission."""
    # entries for folders, which some programs write, do no harm
    strange = {name: _strangeness(name) for name in names if name not in _EXPECTED and not name.endswith("/")}
    # disp_maps/ and runtimes/ a level too low
    wrapping = {_root(name) for name, why in strange.items() if why == _FOREIGN and name.split("/")[1:2] in _PARTS}
    lines = [f"{folder}/: {MAPS}/ and {RUNTIMES}/ must lie at the root, not in this folder" for folder in wrapping]
    others = [f"{_shown(name)}: {why}" for name, why in strange.items() if _root(name) not in wrapping]
    return sorted(lines) + _first(others, "files that do not belong")


def _root(name: str) -> str:
    return name.partition("/")[0]


def _strangeness(name: str) -> str:
    parts = name.split("/")
    if {"", "..", "."} & set(parts) or "\\" in name or ":" in name or not name.isprintable():
        return "unsafe name; expected plain names with '/' between folder and file"
    if "__MACOSX" in parts or parts[-1] in (".DS_Store", "Thumbs.db", "desktop.ini"):
        return "added by the operating system; leave it out"
    return _FOREIGN


def _problems_in(files: Mapping[str, Path], damaged: Mapping[str, str], partial: bool) -> list[str]:
    """Problems with what a submission must hold: ``files`` by name, ``damaged`` those that cannot be read, and why."""
    known = {*damaged, *files}
    absent = [part for part in (MAPS, RUNTIMES) if not any(_root(name) == part for name in known & _EXPECTED)]
    problems = [f"{part}/: no such folder with files of the benchmark's scenes" for part in absent]
    for names in zip(*map(_names_of, SCENES), strict=True):
        for scene, name in zip(SCENES, names, strict=True):
            part = _root(name)
            problem = None
            if name in damaged:
                problem = damaged[name]
            elif name in files:
                problem = _map_problem(files[name]) if part == MAPS else _seconds_in(files[name])[1]
            elif part not in absent and not (partial and known.isdisjoint(_names_of(scene))):
                problem = "missing"
            problems += [f"{name}: {problem}"] if problem else []
    return problems


def _map_problem(path: Path) -> str | None:
    problem = _size_problem(MAPS, path.stat().st_size) if path.is_file() else "no such file"
    if problem:
        return problem
    try:
        disparity = read_pfm(path)
    except SepiError as error:
        return str(error).removeprefix(f"{path}: ")
    if disparity.shape != SHAPE:
        return f"{disparity.shape[1]}x{disparity.shape[0]} pixels; expected {_PIXELS}"
    unknown = disparity.size - int(np.isfinite(disparity).sum())
    return f"{unknown} of {disparity.size} values are not finite" if unknown else None


def _seconds_in(path: Path) -> tuple[float, str | None]:
    """Seconds that a file holds, and what is wrong with it."""
    problem = _size_problem(RUNTIMES, path.stat().st_size) if path.is_file() else "no such file"
    if problem:
        return math.nan, problem
    text = path.read_bytes().decode("ascii", "replace").strip()
    if not _NUMBER.fullmatch(text):
        return math.nan, f"expected the run time in seconds as a number, got {text!r}"
    seconds = float(text)
    return seconds, None if 0 < seconds < math.inf else f"expected a positive number of seconds, got {text}"


def _first(lines: list[str], what: str) -> list[str]:
    more = len(lines) - _MOST_LINES
    return lines if more <= 0 else [*lines[:_MOST_LINES], f"...: {more} more {what}"]


def _shown(name: str) -> str:
    return name if name.isprintable() else ascii(name)
