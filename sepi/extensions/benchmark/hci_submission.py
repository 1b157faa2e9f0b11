"""A submission to the HCI 4D light field benchmark: a zip archive of disparity maps and run times of its 12 scenes.

The archive contains ``disp_maps/SCENE.pfm``, 512 x 512 pixels with one channel, and ``runtimes/SCENE.txt``, the seconds
as a number. The benchmark's own check tests for the files and the size of the maps; this one also finds errors that
pass there but lower the scores, such as missing values, and files that do not belong to a submission.

References
----------
.. [1] K. Honauer, O. Johannsen, D. Kondermann, B. Goldluecke, "A dataset and evaluation methodology for depth
       estimation on 4D light fields", ACCV 2016. doi:10.1007/978-3-319-54187-7_2
"""

import math
import stat
import tempfile
import zipfile
import zlib
from collections import Counter
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

import click
import numpy as np

from sepi.errors import SepiError
from sepi.io.disparity_maps import read_pfm
from sepi.io.files import atomic_path, reading
from sepi.io.result_files import RUNTIME
from sepi.io.result_folder import read_result
from sepi.process.command import PATH, SepiCommand
from sepi.validation import require_known, require_path, require_type, settings_of

SCENES = (
    *("backgammon", "dots", "pyramids", "stripes"),
    *("boxes", "cotton", "dino", "sideboard"),
    *("bedroom", "bicycle", "herbs", "origami"),
)
"""The benchmark's scenes: stratified, training and test."""

SHAPE = (512, 512)
"""Height and width of the scenes' views in pixels."""

MAPS, RUNTIMES = "disp_maps", "runtimes"

_NAMES = {part: [f"{part}/{scene}{end}" for scene in SCENES] for part, end in ((MAPS, ".pfm"), (RUNTIMES, ".txt"))}
_EXPECTED = {name for names in _NAMES.values() for name in names}

_PIXELS = f"{SHAPE[1]}x{SHAPE[0]}"
# size limits: header of a map; run time with white space
_LIMITS = {MAPS: (4 * SHAPE[0] * SHAPE[1] + 256, f"a map of {_PIXELS} pixels"), RUNTIMES: (64, "one number")}
# maximum number of lines about unexpected files
_MOST_LINES = 10


class Entry(NamedTuple):
    """One scene of a submission.

    Attributes
    ----------
    disparity : Path
        PFM file of 512 x 512 pixels.
    seconds : float
        Run time.

    Examples
    --------
    >>> from pathlib import Path
    >>> from sepi.extensions.benchmark.hci_submission import Entry
    >>> Entry(Path("cotton-depth/disparity.pfm"), 7.7).seconds
    7.7
    """

    disparity: Path
    seconds: float


def entry_of(folder: Path, runtimes: Mapping[str, float]) -> tuple[str, Entry]:
    """The scene of a result, and its entry in a submission.

    Parameters
    ----------
    folder : Path
        Written by ``sepi depth --timing``: ``disparity.pfm``, ``result.h5`` (which names the scene), ``runtime.txt``.
    runtimes : mapping of str to float
        Scene to seconds, instead of ``runtime.txt``.

    Raises
    ------
    SepiError
        If it is not such a folder, its scene is not one of the benchmark's, or its run time is unknown.
    """
    if not folder.is_dir():
        raise SepiError(f"{folder}: no such folder; expected one that 'sepi depth --timing' wrote")
    result = read_result(folder)
    scene = result.scene
    if result.from_centre != (0, 0):
        raise SepiError(f"{folder}: depth of another view; expected that of the centre view, made without --view")
    require_known(f"{folder}: scenes of the benchmark", [scene], SCENES)
    disparity, runtime = folder / "disparity.pfm", folder / RUNTIME
    if not disparity.is_file():
        raise SepiError(f"{disparity}: no such file; run 'sepi depth --timing' again")
    if scene not in runtimes and not runtime.is_file():
        raise SepiError(f"{runtime}: no such file; run 'sepi depth --timing', or give --runtime {scene}=SECONDS")
    return scene, Entry(disparity, runtimes[scene] if scene in runtimes else _read_seconds(runtime))


def write_submission(path: str | Path, entries: Mapping[str, Entry], *, partial: bool = False) -> None:
    """Write a submission atomically; equal content gives equal bytes.

    Parameters
    ----------
    path : str or Path
        Zip archive to write.
    entries : mapping of str to Entry
        Scene to entry.
    partial : bool
        Allow missing scenes.

    Raises
    ------
    SepiError
        If :func:`problems_of` finds a problem, or the archive cannot be written.

    Examples
    --------
    >>> from pathlib import Path
    >>> from zipfile import ZipFile
    >>> import numpy as np
    >>> from sepi.io.disparity_maps import write_pfm
    >>> from sepi.extensions.benchmark.hci_submission import Entry, write_submission
    >>> write_pfm(Path("disparity.pfm"), np.zeros((512, 512), np.float32))
    >>> write_submission(Path("submission.zip"), {"cotton": Entry(Path("disparity.pfm"), 7.7)}, partial=True)
    >>> ZipFile("submission.zip").namelist()
    ['disp_maps/cotton.pfm', 'runtimes/cotton.txt']
    """
    path = require_path("submission", path)
    require_type(f"{path}: entries", entries, Mapping, "scenes with their entries")
    files: dict[str, bytes] = {}
    for scene, entry in entries.items():
        files[f"{MAPS}/{scene}.pfm"] = entry.disparity.read_bytes()
        files[f"{RUNTIMES}/{scene}.txt"] = f"{entry.seconds:.10g}\n".encode()
    with atomic_path(path) as temporary:
        with zipfile.ZipFile(temporary, "w") as archive:
            for name, content in sorted(files.items()):
                # reproducible: no dates, and no compression, whose output depends on the library
                info = zipfile.ZipInfo(name)
                info.create_system, info.external_attr = 3, (stat.S_IFREG | 0o644) << 16
                archive.writestr(info, content)
        problems = problems_of(temporary, partial=partial)
        if problems:
            more = f" (and {len(problems) - 1} more)" if len(problems) > 1 else ""
            raise SepiError(f"{path}: not written: {problems[0]}{more}")


def problems_of(path: str | Path, *, partial: bool = False) -> list[str]:
    """Problems of a submission.

    Parameters
    ----------
    path : str or Path
        Zip archive, or a folder with the same content.
    partial : bool
        Allow missing scenes.

    Returns
    -------
    list of str
        One line each, beginning with a name inside the submission or with ``path``; empty without problems.

    Raises
    ------
    SepiError
        If ``path`` does not exist, cannot be read, or is not a zip archive.

    Examples
    --------
    One scene's map is too small, and its run time is missing:

    >>> from pathlib import Path
    >>> import numpy as np
    >>> from sepi.io.disparity_maps import write_pfm
    >>> from sepi.extensions.benchmark.hci_submission import problems_of
    >>> write_pfm(Path("mine/disp_maps/dino.pfm"), np.zeros((384, 512), np.float32))
    >>> for problem in problems_of(Path("mine"), partial=True):
    ...     print(problem)
    disp_maps/dino.pfm: 512x384 pixels; expected 512x512
    runtimes/: no such folder with files of the benchmark's scenes
    """
    path = require_path("submission", path)
    if path.is_dir():
        # files and folders of the first two levels
        inner = {*path.glob("*/*"), *(entry for entry in path.iterdir() if not entry.is_dir())}
        return _problems_in(path, sorted(file.relative_to(path).as_posix() for file in inner), None, partial)
    if not path.is_file():
        raise SepiError(f"{path}: no such file or folder")
    with tempfile.TemporaryDirectory() as folder, reading(path, "zip archive"), zipfile.ZipFile(path) as archive:
        return _problems_in(Path(folder), archive.namelist(), archive, partial)


def _problems_in(folder: Path, names: Sequence[str], archive: zipfile.ZipFile | None, partial: bool) -> list[str]:
    """Problems with a submission: ``names`` of its files, which lie in ``folder``, or are unpacked there."""
    problems = [f"{_shown(name)}: {count} files of this name" for name, count in Counter(names).items() if count > 1]
    # some programs write entries for folders, which are harmless
    others = [_shown(name) for name in names if name not in _EXPECTED and not name.endswith("/")]
    rule = f"does not belong to a submission; expected only {MAPS}/ and {RUNTIMES}/, in no other folder"
    problems += [f"{name}: {rule}" for name in others[:_MOST_LINES]]
    if len(others) > _MOST_LINES:
        problems.append(f"...: {len(others) - _MOST_LINES} more files that do not belong")
    known = _EXPECTED.intersection(names)
    for part, expected in _NAMES.items():
        if known.isdisjoint(expected):
            problems.append(f"{part}/: no such folder with files of the benchmark's scenes")
            continue
        for name, *both in zip(expected, *_NAMES.values(), strict=True):
            if name in known and (problem := _problem_in(folder, name, archive)):
                problems.append(f"{name}: {problem}")
            elif name not in known and not (partial and known.isdisjoint(both)):
                problems.append(f"{name}: missing")
    return problems


def _problem_in(folder: Path, name: str, archive: zipfile.ZipFile | None) -> str | None:
    path = folder / name
    try:
        info = archive.getinfo(name) if archive else None
        _require_size(path, name, info.file_size if info else path.stat().st_size)
        if archive and info:
            if info.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
                return f"compressed by method {info.compress_type}; expected 'deflated' or none"
            # no more than the size that it tells
            archive.extract(info, folder)
        if name.startswith(RUNTIMES):
            _read_seconds(path)
            return None
        disparity = read_pfm(path)
    except SepiError as error:
        return str(error).removeprefix(f"{path}: ")
    except (zipfile.BadZipFile, zlib.error, EOFError, RuntimeError, ValueError, OSError) as error:
        return f"cannot be {'unpacked' if archive else 'read'} ({error})"
    if disparity.shape != SHAPE:
        return f"{disparity.shape[1]}x{disparity.shape[0]} pixels; expected {_PIXELS}"
    unknown = np.count_nonzero(~np.isfinite(disparity))
    return f"{unknown} of {disparity.size} values are not finite" if unknown else None


def _read_seconds(path: Path) -> float:
    _require_size(path, RUNTIMES, path.stat().st_size)
    return _seconds(path.read_bytes().decode("ascii", "replace").strip(), path)


def _seconds(text: str, where: object) -> float:
    with suppress(ValueError):
        if 0 < (seconds := float(text)) < math.inf:
            return seconds
    raise SepiError(f"{where}: expected the run time in seconds as a number, got {text!r}; it must be positive")


def _require_size(path: Path, name: str, size: int) -> None:
    most, what = _LIMITS[name.partition("/")[0]]
    if size > most:
        raise SepiError(f"{path}: {size} bytes are too many for {what}")


def _shown(name: str) -> str:
    return name if name.isprintable() else ascii(name)


_PARTIAL = click.option("--partial", is_flag=True, help="Accept fewer than the benchmark's 12 scenes.")


@click.command(cls=SepiCommand)
@click.argument("results", metavar="RESULT...", nargs=-1, required=True, type=PATH)
@click.option("-o", "--output", type=PATH, default=Path("submission.zip"), show_default=True, help="Zip to write.")
@click.option(
    "--runtime", "runtimes", multiple=True, metavar="SCENE=SECONDS", help="Run time, unless in runtime.txt; repeatable."
)
@_PARTIAL
def submission(results: tuple[Path, ...], output: Path, runtimes: tuple[str, ...], partial: bool) -> None:
    """Pack RESULTs as a submission to the HCI 4D light field benchmark.

    Each RESULT is a folder that 'sepi depth --timing' wrote for one of the benchmark's 12 scenes. A submission with
    problems is not written.

    \b
    Example:
      for scene in stratified/* training/* test/*; do sepi depth "$scene" --timing; done
      sepi submission *-depth -o submission.zip
    """
    given = settings_of(runtimes, "cotton=12.5", "SCENE=SECONDS", "--runtime")
    seconds = {scene: _seconds(str(value), f"--runtime {scene}={value}") for scene, value in given.items()}
    entries: dict[str, Entry] = {}
    for folder in results:
        scene, entry = entry_of(folder, seconds)
        if scene in entries:
            raise SepiError(f"{folder}: scene {scene} is given twice, also as {entries[scene].disparity.parent}")
        entries[scene] = entry
    for scene in seconds.keys() - entries.keys():
        raise SepiError(f"--runtime {scene}: no result of this scene is given")
    write_submission(output, entries, partial=partial)
    click.echo(f"written: {output} ({len(entries)} scenes)")


@click.command("check-submission", cls=SepiCommand)
@click.argument("path", metavar="ZIP|FOLDER", type=PATH)
@_PARTIAL
@click.pass_context
def check_submission(context: click.Context, path: Path, partial: bool) -> None:
    """Check a submission to the HCI 4D light field benchmark.

    The command prints a line for each problem; the exit code is 1 if there is any. It checks more than the benchmark's
    upload: values that are not finite, run times that are not positive, files that do not belong.
    """
    problems = problems_of(path, partial=partial)
    for problem in problems:
        click.echo(problem)
    if problems:
        context.exit(1)
    click.echo(f"{path}: no problems")
