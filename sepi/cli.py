"""The command ``sepi``."""

from __future__ import annotations

import json
import math
import os
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from sepi.command import SepiGroup, progress_bar, use_threads
from sepi.errors import SepiError
from sepi.provenance import package_version, result_attributes, step

# Modules that are slow to import, such as the stages, are imported in the commands that need them.
if TYPE_CHECKING:
    from sepi.io.scores import Scores
    from sepi.lightfield import DisparityRange, FloatMap, LightField
    from sepi.pipeline import Variant

_PATH = click.Path(path_type=Path)
_RANGE_SOURCES = {
    "parameters": "from the scene's parameters",
    "given": "as given",
    "estimated": "estimated from the views",
}


@click.group(cls=SepiGroup, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(package_version(), message="%(prog)s %(version)s")
def main() -> None:
    """Depth from light fields by stitched epipolar plane images.

    A light field is a grid of views of one scene, each taken from a camera position a step to the side of the next.
    Its disparity map says, for each pixel of the centre view, by how many pixels it moves from view to view: the
    more, the nearer.

    \b
    Try it on a built-in scene:
      sepi scenes pyramids -o scenes
      sepi depth scenes/pyramids
      sepi evaluate pyramids-depth scenes/pyramids
    """


@main.command(short_help="Compute the disparity map of the light field INPUT.")
@click.argument("light_field_path", metavar="INPUT", type=_PATH)
@click.option("-o", "--output", type=_PATH, help="Folder to write; ./NAME-depth after INPUT's name unless given.")
@click.option("--variant", default="paper", show_default=True, help="Named choice of stages; see above.")
@click.option(
    "--disparity-range",
    nargs=2,
    type=float,
    metavar="MIN MAX",
    help="Disparities to search, pixels per view step; the scene's own or an estimate unless given.",
)
@click.option("--threads", type=click.IntRange(min=1), help="Threads to use; one per core unless given.")
@click.option(
    "--set",
    "settings",
    multiple=True,
    metavar="KEY=VALUE",
    help="Set a parameter, STAGE.CHOICE.NAME=VALUE; repeatable. config.yaml lists them.",
)
def depth(
    light_field_path: Path,
    output: Path | None,
    variant: str,
    disparity_range: tuple[float, float] | None,
    threads: int | None,
    settings: tuple[str, ...],
) -> None:
    """Compute the disparity map of the light field INPUT.

    INPUT is a folder of the HCI 4D light field benchmark (input_Cam000.png, ...) or an HDF5 file of this package.
    Writes disparity.pfm, result.h5 (disparity, confidence, masks), disparity.png and confidence.png.

    Variants: paper (the whole method), no_sepi, no_occlusion, no_textureless, no_occlusion_no_textureless (parts of
    it switched off), wang (another treatment of occlusion).

    \b
    Examples:
      sepi depth cotton
      sepi depth cotton -o maps --disparity-range -2 2
      sepi depth cotton --variant no_occlusion --set initial.sepi.candidates=91
    """
    from sepi.ingest import settle_range
    from sepi.io import read_light_field
    from sepi.io.export import RESULT_FILES, require_target, write_result
    from sepi.pipeline import estimate_depth, stage_parameters, variant_named

    use_threads(threads or os.cpu_count() or 1)
    chosen = variant_named(variant)
    parameters = _parameters(settings, variant, chosen)
    steps = [
        step(stage, chosen.choices[stage], values) for stage, values in stage_parameters(chosen, parameters).items()
    ]
    whole = light_field_path.resolve()
    folder = output or Path(f"{whole.name if whole.is_dir() else whole.stem}-depth")
    require_target(folder)
    light_field = settle_range(read_light_field(light_field_path), disparity_range)
    with progress_bar(light_field.name) as progress:
        maps = estimate_depth(light_field, chosen, parameters, progress)
    write_result(folder, light_field, maps, result_attributes(light_field, variant, steps))
    click.echo(f"{light_field.name}: {_size(light_field)}")
    click.echo(f"disparity range: {_range(light_field.known_range())}")
    click.echo(f"written to {folder}/: {' '.join(RESULT_FILES)}")


@main.command(short_help="Score a disparity map against ground truth.")
@click.argument("estimate", type=_PATH)
@click.argument("truth", metavar="TRUTH|SCENE", type=_PATH)
@click.option("--border", type=click.IntRange(min=0), help="Score with this many pixels left out on each side only.")
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def evaluate(estimate: Path, truth: Path, border: int | None, as_json: bool) -> None:
    """Score the disparity map ESTIMATE against ground truth.

    ESTIMATE is a PFM, an HDF5 file with a dataset 'disparity', a NumPy file (.npy), or a folder that 'sepi depth'
    wrote. TRUTH is such a file; give the SCENE itself, a light field with ground truth, to have its occluded and
    texture-less regions scored too.

    Both protocols are used: 'paper' scores the whole map, 'benchmark' leaves out 15 pixels on each side.

    \b
    Examples:
      sepi evaluate cotton-depth cotton
      sepi evaluate estimate.pfm gt_disp_lowres.pfm --border 15 --json
    """
    scores = _scores(_read_map(estimate), truth, border)
    if as_json:
        click.echo(json.dumps(_without_nan(scores), indent=2, sort_keys=True))
    else:
        click.echo(_table(scores))


@main.command(short_help="Show what is known about the light field INPUT.")
@click.argument("light_field_path", metavar="INPUT", type=_PATH)
def info(light_field_path: Path) -> None:
    """Show what is known about the light field INPUT, with an estimate of its disparity range."""
    from sepi.disparity_range import estimate_range
    from sepi.io import format_of, read_light_field

    known_format = format_of(light_field_path)
    light_field = read_light_field(light_field_path)
    missing = [f"({t}, {s})" for t in range(light_field.grid[0]) for s in range(light_field.grid[1])]
    missing = [view for view, present in zip(missing, light_field.present.ravel(), strict=True) if not present]
    own = light_field.disparity_range
    try:
        estimated = _range(estimate_range(light_field))
    except SepiError as error:
        estimated = str(error)
    lines = {
        "name": light_field.name,
        "format": known_format.name,
        "views": _size(light_field),
        "pixels": f"{'RGB' if light_field.views.shape[4] == 3 else 'grey'}, {light_field.views.dtype}",
        "missing views": ", ".join(missing) or "none",
        "disparity range": "not given" if own is None else _range(own),
        "estimated range": estimated,
        "ground truth": "none" if light_field.truth is None else "yes",
        "masks": ", ".join(light_field.masks) or "none",
    }
    for key, value in lines.items():
        click.echo(f"{key + ':':17}{value}")


@main.command(short_help="Write built-in scenes with exact ground truth.")
@click.argument("names", metavar="[NAME]...", nargs=-1)
@click.option("-o", "--output", type=_PATH, default=Path("scenes"), show_default=True, help="Folder to write to.")
@click.option("--size", type=click.IntRange(min=1), default=192, show_default=True, help="Pixels a side of a view.")
@click.option("--views", type=click.IntRange(min=2), default=9, show_default=True, help="Views a side of the grid.")
@click.option("--list", "only_list", is_flag=True, help="List the scenes and write nothing.")
def scenes(names: tuple[str, ...], output: Path, size: int, views: int, only_list: bool) -> None:
    """Write built-in scenes, with exact ground truth, as HCI 4D benchmark folders.

    All of them unless NAMEs are given.

    \b
    Examples:
      sepi scenes --list
      sepi scenes pyramids stripes -o scenes --size 256
    """
    from sepi.scenes import SCENES, render, write_hci
    from sepi.validation import require_known

    if only_list:
        width = max(map(len, SCENES))
        for name, description in SCENES.items():
            click.echo(f"{name.ljust(width)}  {description}")
        return
    require_known("built-in scenes", names, SCENES)
    chosen = dict.fromkeys(names or SCENES)
    for name in chosen:
        if (output / name).exists():
            raise SepiError(f"{output / name}: exists already; remove it or choose another folder with -o")
    for name in chosen:
        write_hci(render(name, size=size, views=views), output / name)
        click.echo(f"written: {output / name}/")


def _size(light_field: LightField) -> str:
    (rows, columns), (height, width) = light_field.grid, light_field.shape
    return f"{columns}x{rows} views of {width}x{height} pixels"


def _range(known: DisparityRange) -> str:
    return f"{known.minimum:g} to {known.maximum:g} pixels per view step ({_RANGE_SOURCES[known.source]})"


def _parameters(settings: tuple[str, ...], name: str, variant: Variant) -> dict[str, dict[str, Any]]:
    """Stage to field to value from ``STAGE.CHOICE.NAME=VALUE`` of the command line."""
    parameters: dict[str, dict[str, Any]] = {}
    for setting in settings:
        match = re.fullmatch(r"(\w+)\.(\w+)\.(\w+)=(.*)", setting)
        if match is None:
            raise SepiError(f"--set {setting}: expected STAGE.CHOICE.NAME=VALUE, such as initial.sepi.candidates=91")
        stage, choice, field, text = match.groups()
        if variant.choices.get(stage) != choice:
            used = ", ".join(f"{stage}.{choice}" for stage, choice in variant.choices.items())
            raise SepiError(f"--set {setting}: variant {name} does not use {stage}.{choice}; it uses {used}")
        try:
            value = json.loads(text)
        except ValueError:
            value = text
        parameters.setdefault(stage, {})[field] = value
    return parameters


def _read_map(path: Path) -> FloatMap:
    """A disparity map from a PFM, HDF5 or NumPy file, or from the folder of a result."""
    import numpy as np

    from sepi.io.hdf5 import read_map
    from sepi.io.pfm import read_pfm

    if path.is_dir():
        path = path / "disparity.pfm"
    if not path.is_file():
        raise SepiError(f"{path}: no such file")
    if path.suffix == ".pfm":
        return read_pfm(path)
    if path.suffix in (".h5", ".hdf5"):
        return read_map(path, "disparity")
    if path.suffix != ".npy":
        raise SepiError(f"{path}: expected a disparity map as .pfm, .h5 or .npy")
    try:
        with path.open("rb") as file:
            # np.load also takes archives and pickles
            values = np.lib.format.read_array(file, allow_pickle=False)
    except (OSError, ValueError, EOFError) as error:
        raise SepiError(f"{path}: not a readable NumPy file ({' '.join(str(error).split())})") from error
    if values.ndim != 2 or values.dtype.kind not in "fiu":
        raise SepiError(f"{path}: expected an array of numbers of shape (H, W)")
    return np.asarray(values, np.float32)


def _scores(disparity: FloatMap, truth: Path, border: int | None) -> dict[str, dict[str, Scores]]:
    """Protocol to region to scores; the regions only where ``truth`` is a light field."""
    from sepi.evaluate import PROTOCOLS, REGIONS, WHOLE_MAP, region_masks, score
    from sepi.io import FORMATS, read_light_field

    masks = {}
    if any(known.matches(truth) for known in FORMATS):
        light_field = read_light_field(truth)
        if light_field.truth is None:
            raise SepiError(f"{truth}: this light field has no ground truth")
        values = light_field.truth
        masks = region_masks(light_field)
    else:
        values = _read_map(truth)
    if values.shape != disparity.shape:
        raise SepiError(f"{truth}: ground truth is {values.shape}, the estimate {disparity.shape} (height, width)")
    protocols = PROTOCOLS if border is None else {f"border {border}": border}
    regions = REGIONS if masks else (WHOLE_MAP,)
    return {
        protocol: {region: score(disparity, values, left_out, masks.get(region)) for region in regions}
        for protocol, left_out in protocols.items()
    }


def _table(scores: dict[str, dict[str, Scores]]) -> str:
    """Scores as aligned columns."""
    heads = {
        "mse100": "MSE x100",
        "q25": "Q25 x100",
        "badpix007": "BadPix 0.07 %",
        "badpix003": "BadPix 0.03 %",
        "badpix001": "BadPix 0.01 %",
        "non_finite": "non-finite",
        "pixels": "pixels",
    }
    rows = [["protocol", "region", *heads.values()]]
    for protocol, regions in scores.items():
        for region, values in regions.items():
            rows.append([protocol, region, *(_cell(values[key]) for key in heads)])
    widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))]
    return "\n".join(
        "  ".join(
            text.ljust(width) if column < 2 else text.rjust(width)
            for column, (text, width) in enumerate(zip(row, widths, strict=True))
        )
        for row in rows
    )


def _cell(value: float) -> str:
    """A count as it is, a score with three decimals, a score over no pixels as a dash."""
    if isinstance(value, int):
        return f"{value}"
    return "-" if math.isnan(value) else f"{value:.3f}"


def _without_nan(value: Any) -> Any:
    """NaN, which JSON does not have, as null."""
    if isinstance(value, dict):
        return {key: _without_nan(inner) for key, inner in value.items()}
    return None if isinstance(value, float) and math.isnan(value) else value
