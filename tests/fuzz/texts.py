"""Text that a user writes, as the content of a file: configurations, parameters, names of views, patterns and flags."""

import os
import shutil
from contextlib import suppress
from pathlib import Path

import cv2
import numpy as np
import seed_files as seeds
import yaml
from click.testing import CliRunner

from sepi.cli.depth import _parameters
from sepi.cli.main import main
from sepi.errors import SepiError
from sepi.extensions.benchmark.commands import _runtime
from sepi.extensions.benchmark.hci_submission import _read_seconds
from sepi.external import _sources
from sepi.io.images import write_png
from sepi.io.readers.formats import read
from sepi.io.readers.options import ReadOptions
from sepi.io.readers.view_names import parse_view_numbers
from sepi.process.command import _json_object
from sepi.report.plan import Plan
from sepi.variants import stage_parameters, variant_named
from sepi.workflow.config import load_settings

# more views, flags or settings than these are not made of one text
_MOST_LINES = 24
# bytes of a file's name that every system takes
_LONGEST_NAME = 200


def _lines(path: Path) -> list[str]:
    """The lines of a text; bytes that are no text stay what they are, as in names of files and flags."""
    lines = os.fsdecode(path.read_bytes()).replace("\0", "").split("\n")
    return [line for line in lines if line][:_MOST_LINES]


def map_png_files(folder: Path) -> list[bytes]:
    """A map of grey levels that says what they mean, and one that does not."""
    texts = {"scale": "0.001", "offset": "-1.5", "units": "pixels"}
    levels = np.arange(seeds.H * seeds.W, dtype=np.uint16).reshape(seeds.H, seeds.W)
    write_png(folder / "a.png", levels, texts)
    return [(folder / "a.png").read_bytes(), seeds.encoded(".png", levels)]


def lenslet_files(_: Path) -> list[bytes]:
    """A picture of 3 x 4 lenslets."""
    return [seeds.encoded(".png", np.tile(seeds.VIEW[:, :7], (7, 8, 1)))]


def larger_npy_files(folder: Path) -> list[bytes]:
    """Views in which something can be matched."""
    rng = np.random.default_rng(1)
    texture = cv2.GaussianBlur(rng.uniform(0, 1, (40, 44)).astype(np.float32), (5, 5), 1)
    views = np.stack([np.stack([texture[t : t + 24, s : s + 28] for s in range(3)]) for t in range(3)])
    grey = np.asarray(255 * views / views.max(), np.uint8)[..., None]
    found = []
    for array in (grey, grey.reshape(9, 24, 28, 1)):
        np.save(folder / "a.npy", array)
        found.append((folder / "a.npy").read_bytes())
    return found


def parameter_files(_: Path) -> list[bytes]:
    """What a benchmark folder says of itself."""
    return [seeds.PARAMETERS.encode(), b"[all]\nnum_cams_x: 3\nnum_cams_y: 2\ndisp_min: -1\ndisp_max: 1e3\nscene:\n"]


def read_parent(path: Path) -> None:
    """Read the light field in the folder of a file."""
    read(path.parent, ReadOptions())


def runtime_files(_: Path) -> list[bytes]:
    """Seconds."""
    return [b"12.5\n"]


def read_runtime(path: Path) -> None:
    """Read the seconds in a file, and as a flag has them."""
    _read_seconds(path)


def name_files(_: Path) -> list[bytes]:
    """Names of the pictures in a folder, one a line."""
    grid = [(t, s) for t in range(3) for s in range(3)]
    forms = (
        "view_{t:02}_{s:02}.png",
        "img{n:03}.jpg",
        "out_{t:02}_{s:02}_{y}_{x}.png",
        "2016-05-01 12.{n:02}.33 ({n}).tif",
        "{x}_{y}.png",
        "-{t}+{s}.png",
    )
    places = [{"t": t, "s": s, "n": 3 * t + s, "y": -703.25 + 4.5 * t, "x": 468.125 + 4.5 * s} for t, s in grid]
    return ["\n".join(form.format(**place) for place in places).encode() for form in forms]


def one_picture(folder: Path) -> None:
    """A picture to give names to."""
    (folder / "picture").write_bytes(seeds.encoded(".png"))


def read_names(path: Path) -> None:
    """Read a folder of pictures with these names."""
    folder = path.parent / "views"
    folder.mkdir()
    try:
        for name in _lines(path):
            # what is no name of a file in the folder
            if "/" not in name and name not in (".", "..") and len(os.fsencode(name)) < _LONGEST_NAME:
                with suppress(FileExistsError):
                    os.link(path.parent / "picture", folder / name)
        found = read(folder, ReadOptions(), "images")
        assert all(note.isprintable() for note in found.notes), found.notes
    finally:
        shutil.rmtree(folder)


def pattern_files(_: Path) -> list[bytes]:
    """A pattern, and names below it."""
    return [
        b"view_{row}_{column}.png\nview_1_2.png\nview_2_2.png\nother.png",
        b"*_{number}*.j*\nIMG_001.jpg\nIMG_002b.jpg\nIMG_-3.jpg",
    ]


def read_pattern(path: Path) -> None:
    """Read names by a pattern."""
    pattern, *names = _lines(path) or [""]
    parse_view_numbers("folder", names, pattern)


CONFIG = """builtin: {scenes: [dots, pyramids], size: 96}
hci_root: hci
hci_2013_root: archive
light_fields:
  lego: {path: own.npy, grid: [2, 3], axes: TSHWC, order: flip-rows, exclude: ["0,0"], row_spacing: 1.5, white: 1e3}
external: {SPO: 'maps', OTHER: {path: 'maps/{scene}.pfm', scale: -1, offset: 0.5}}
disparity_range: {builtin/dots: [-1.5, 1e-1]}
report: {pixels: {builtin/dots: [[1, 2]]}, parts_of_best: true}
variants: {mine: {base: best, occlusion: {choice: visibility, use_mixture: false}}, other: {base: mine}}
stages:
  shared: {}
  initial: {sepi: {num_disparities: 91}}
"""


def config_files(_: Path) -> list[bytes]:
    """A configuration with every key, and its parts."""
    parts = CONFIG.split("\nlight_fields")
    return [
        CONFIG.encode(),
        parts[0].encode(),
        b"light_fields" + parts[1].encode(),
        b"stages: &a {initial: {sepi: null, x: *a}}",
    ]


def config_folder(folder: Path) -> None:
    """What the configuration names."""
    (folder / "hci" / "toy").mkdir(parents=True)
    seeds.hci_pictures(folder / "hci" / "toy")
    (folder / "archive").mkdir()
    (folder / "archive" / "lf1.h5").write_bytes(seeds.hci_2013_files(folder)[0])
    np.save(folder / "own.npy", seeds.VIEWS)
    (folder / "maps").mkdir()


def read_config(path: Path) -> None:
    """Check a configuration, whose text Snakemake reads as YAML."""
    text = path.read_text(encoding="utf-8", errors="replace")
    # places outside the folder are not looked into
    if any(word in text for word in ("..", "~", ": /", "'/", '"/')):
        return
    try:
        values = yaml.safe_load(text)
    except (yaml.YAMLError, ValueError, RecursionError, TypeError, AttributeError, KeyError):
        # Snakemake's to tell
        return
    if isinstance(values, dict):
        load_settings(values)


def flag_files(_: Path) -> list[bytes]:
    """Flags of the commands that read a light field, one a line."""
    sets = (
        ["pictures", "--pattern=view_{row}_{column}.png", "--grid=2x3", "--exclude=0,0", "--order=transpose"],
        ["pictures", "--grid=2x3", "--view=1,1", "--exclude=view_0_0.png", "--row-spacing=1.5"],
        ["own.npz", "--variable=LF", "--axes=TSHWC", "--format=numpy", "--view=0,2", "--json"],
        ["own.npz", "--focal-length=50", "--baseline=10", "--focus-distance=inf", "--sensor-size=36", "--variable=LF"],
    )
    return ["\n".join(flags).encode() for flags in sets]


def flag_folder(folder: Path) -> None:
    """What the flags are given with."""
    (folder / "pictures").mkdir()
    for t, s in np.ndindex(2, 3):
        (folder / "pictures" / f"view_{t}_{s}.png").write_bytes(seeds.encoded(".png", seeds.VIEWS[t, s]))
    np.savez(folder / "own.npz", LF=seeds.VIEWS, other=seeds.VIEWS[..., 0])


def read_flags(path: Path) -> None:
    """Call ``sepi info``, which writes nothing, with these arguments."""
    lines = _lines(path)
    # places outside the folder are not looked into
    if any(line.startswith(("/", "..")) for line in lines):
        return
    called = CliRunner().invoke(main, ["info", *lines], catch_exceptions=False)
    assert called.exit_code in (0, 1, 2), called.output
    if called.exit_code == 2:
        # click's own words
        return
    assert all(line.isprintable() for line in called.output.splitlines()), called.output
    if called.exit_code == 1:
        *warned, line = called.stderr.splitlines()
        assert line.startswith("sepi: "), called.stderr
        assert all(text.startswith("sepi: warning: ") for text in warned), called.stderr
        raise SepiError(line)


def setting_files(_: Path) -> list[bytes]:
    """Values of ``--variant``, ``--set`` and ``--runtime``."""
    return [
        b"paper\ninitial.sepi.num_disparities=91\noptimize.wls.rtol=1e-3",
        b"cotton=12.5\noptimize.second_order.x=null",
    ]


def read_settings(path: Path) -> None:
    """Understand these values as the commands do."""
    variant, *settings = _lines(path) or [""]
    with suppress(SepiError):
        _runtime(variant)
    chosen = variant_named(variant)
    stage_parameters(chosen, _parameters(tuple(settings), variant, chosen))


def read_json_flags(path: Path) -> None:
    """Understand JSON as the workflow's commands are given it."""
    text = path.read_text(encoding="utf-8", errors="replace")
    refused = []
    for understand in (lambda text: Plan.from_json(path.parent, text), _sources, _json_object):
        try:
            understand(text)
        except SepiError as error:
            refused.append(error)
    if refused:
        raise refused[0]
