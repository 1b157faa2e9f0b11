"""The commands ``sepi info`` and ``sepi check``."""

from __future__ import annotations

import json
from contextlib import suppress
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from sepi.cli.input_options import Geometry, Reading, camera_flags, reading_flags
from sepi.errors import SepiError
from sepi.process.command import PATH, SepiCommand

# other imports stand in the functions, since `sepi --help` does not need them
if TYPE_CHECKING:
    from sepi.lightfield import DisparityRange, LightField

# share of a range that may lie beyond infinity, as its margin does
_BEYOND = 0.25
_RANGE_SOURCES = {
    "parameters": "from the scene's parameters",
    "given": "as given",
    "estimated": "estimated from the views",
}

_as_json = click.option("--json", "as_json", is_flag=True, help="Print one JSON object (docs/reference/formats.md).")


@click.command(cls=SepiCommand)
@click.argument("light_field_path", metavar="INPUT", type=PATH)
@camera_flags
@reading_flags
@_as_json
def info(light_field_path: Path, geometry: Geometry | None, reading: Reading, as_json: bool) -> None:
    """Show what is known about the light field INPUT, with an estimate of its disparity range.

    INPUT is anything that 'sepi depth' reads, with the same flags. Rows and columns of views are counted from 0.
    """
    from sepi.inspection.disparity_range import estimate_range
    from sepi.io.readers.formats import FORMATS, format_of

    known_format = format_of(light_field_path, reading.file_format)
    light_field = reading.read(light_field_path, geometry)
    try:
        estimated: DisparityRange | str = estimate_range(light_field)
    except SepiError as error:
        estimated = str(error)
    camera = light_field.camera
    missing = [(int(t), int(s)) for t, s in zip(*(~light_field.present).nonzero(), strict=True)]
    t0, s0 = light_field.reference_position
    own = light_field.disparity_range
    if as_json:
        known = {
            **_described(light_field),
            "format": next(word for word, known in FORMATS.items() if known == known_format),
            "missing_views": missing,
            "reference_view": (t0, s0),
            "positions": _positions(light_field),
            "disparity_range": None if own is None else asdict(own),
            "estimated_range": None if isinstance(estimated, str) else asdict(estimated),
            "estimate_failure": estimated if isinstance(estimated, str) else None,
            "camera": None if camera is None else {"scale_m": camera.scale, "offset": camera.offset},
            "ground_truth": light_field.ground_truth is not None,
            "masks": sorted(light_field.masks),
            "notes": light_field.notes,
        }
        click.echo(json.dumps(known, allow_nan=False))
        return
    listed = " ".join(f"{t},{s}" for t, s in missing)
    lines = {
        "name": light_field.name,
        "format": known_format.name,
        "views": size_text(light_field),
        "depth made for": f"view {t0},{s0}",
        "missing views": f"{len(missing)}: {listed}" if missing else "none",
        "pixels": _pixels(light_field),
        "disparity range": "none given; the estimate is used" if own is None else range_text(own),
        "estimated range": estimated if isinstance(estimated, str) else range_text(estimated),
        "metric depth": _depth(light_field, None if isinstance(estimated, str) else estimated),
        "ground truth": "none" if light_field.ground_truth is None else "yes",
        "masks": ", ".join(light_field.masks) or "none",
    }
    if light_field.row_spacing != 1:
        lines["row spacing"] = f"{light_field.row_spacing:g} view steps"
    for key, value in lines.items():
        click.echo(f"{key + ':':17}{value}")
    for note in light_field.notes:
        click.echo(f"{'note:':17}{note}")


@click.command(cls=SepiCommand)
@click.argument("light_field_path", metavar="INPUT", type=PATH)
@reading_flags
@_as_json
@click.pass_context
def check(context: click.Context, light_field_path: Path, reading: Reading, as_json: bool) -> None:
    """Check whether the views of the light field INPUT are in the right order.

    Programs differ in the direction of rows and columns of views, and in which of them comes first. In a wrong order,
    depth is inside out or meaningless. The command compares the views in all eight orders, and names the flag for the
    right one. It also names views that match none of the others, tells how much of the texture is too sharp to be
    interpolated, and warns if a part of the scene lies outside the disparity range. The exit code is 1 if another order
    fits clearly better, the views fit in no order, or some match none of the others; 2 if INPUT cannot be read.
    """
    from sepi.inspection.arrangement import settle_row_spacing
    from sepi.inspection.coded_views import comparable
    from sepi.inspection.disparity_range import settle_range
    from sepi.inspection.view_order import check_order, odd_views
    from sepi.matching.softening import LEAST_SHARE, share_too_sharp

    try:
        light_field = reading.read(light_field_path, check_order=False)
        if reading.options.row_spacing is None:
            light_field = settle_row_spacing(light_field)
    except SepiError as error:
        click.echo(f"sepi: {error}", err=True)
        context.exit(2)
    found, odd, sharp = check_order(light_field, reading.options.order), odd_views(light_field), None
    if not odd and found.warning() is None:
        # views without texture have no range; this is no failure here
        with suppress(SepiError):
            sharp = share_too_sharp(comparable(settle_range(light_field)))
    if as_json:
        facts = asdict(found)
        known = {
            **_described(light_field),
            "costs": facts.pop("fits"),
            **facts,
            "verdict": found.verdict(),
            "warning": found.warning(),
            "odd_views": odd,
            "too_sharp": sharp,
        }
        click.echo(json.dumps(known, allow_nan=False))
    else:
        click.echo(f"{light_field.name}: {size_text(light_field)}")
        click.echo("order, and how well the views match in it (matching cost, 0 to 1; less is better):")
        for order, cost in found.fits.items():
            click.echo(f"  {order:24}{cost:8.4f}{'  best' if order == found.best and found.clear else ''}")
        if sharp is not None and sharp >= LEAST_SHARE:
            click.echo(
                f"{100 * sharp:.0f} % of the picture has texture above 0.3 cycles a pixel, as downscaling without "
                "smoothing leaves it; depth compares slightly blurred views there"
            )
        for line in (*odd, found.verdict()):
            click.echo(line)
    if odd or found.warning() is not None:
        context.exit(1)


def size_text(light_field: LightField) -> str:
    """Text on the grid of views and their size."""
    (rows, columns), (height, width) = light_field.grid, light_field.shape
    present = int(light_field.present.sum())
    number = "" if present == rows * columns else f", {present} of {rows * columns}"
    return f"{rows}x{columns} views (rows x columns{number}) of {width}x{height} pixels"


def range_text(known: DisparityRange) -> str:
    """Text on a disparity range and its source."""
    return f"{known.minimum:g} to {known.maximum:g} pixels per view step ({_RANGE_SOURCES[known.source]})"


def _depth(light_field: LightField, estimated: DisparityRange | None) -> str:
    """Text on the conversion of disparity to depth."""
    from sepi.camera.rig import METRES

    camera, rig = light_field.camera, light_field.rig
    if camera is None:
        return "unknown camera"
    units = "m" if rig is None or rig.units == METRES else rig.units
    told = f"{camera.scale:g} {units} / (disparity + {camera.offset:g})"
    if estimated is None or estimated.minimum + _BEYOND * (estimated.maximum - estimated.minimum) > -camera.offset:
        return told
    return f"{told}; much of the range lies beyond infinity: check --baseline (mm) and --focus-distance (m)"


def _pixels(light_field: LightField) -> str:
    kind = light_field.views.dtype
    bits = f"{8 * kind.itemsize} bit{' float' if kind.kind == 'f' else ''}"
    shown = _shown(light_field)
    told = f"{'RGB' if light_field.views.shape[4] == 3 else 'grey'}, {bits}; values as stored, no gamma applied"
    if shown is None:
        return told
    mean, least = 100 * sum(shown) / len(shown), 100 * min(shown)
    return f"{told}; a view shows {mean:.0f} % of the picture, at least {least:.0f} %"


def _shown(light_field: LightField) -> list[float] | None:
    """Share of the picture that each view shows; None if no pixels are missing."""
    if light_field.missing is None:
        return None
    return [1 - float(view.mean()) for view in light_field.missing[light_field.present]]


def _described(light_field: LightField) -> dict[str, Any]:
    """Facts about a light field for JSON."""
    return {
        "name": light_field.name,
        "source": light_field.source,
        "grid": light_field.grid,
        "views": int(light_field.present.sum()),
        "height": light_field.shape[0],
        "width": light_field.shape[1],
        "channels": light_field.views.shape[4],
        "dtype": light_field.views.dtype.name,
        "row_spacing": light_field.row_spacing,
        "shown": _shown(light_field),
    }


def _positions(light_field: LightField) -> list[list[list[float] | None]] | None:
    """Position of each view, None for a missing one; None for views on the grid."""
    if light_field.positions is None:
        return None
    rows = zip(light_field.positions.tolist(), light_field.present.tolist(), strict=True)
    return [[at if there else None for at, there in zip(*row, strict=True)] for row in rows]
