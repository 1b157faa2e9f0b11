"""The command ``sepi convert``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from sepi.cli.input_options import Geometry, camera_flags, view_of_result
from sepi.cli.scene_argument import camera_of
from sepi.errors import SepiError
from sepi.process.command import SepiCommand

if TYPE_CHECKING:
    from sepi.lightfield import FloatMap

_PATH = click.Path(path_type=Path)
# names of sepi.stage, written out because its import takes longer than the help
_BARS = "sigma", "low", "high"
_STEPS, _METRES = "pixels per view step", "metres"
_MAPS = {
    "disparity": _STEPS,
    "depth": _METRES,
    "confidence": "0 to 1",
    **dict.fromkeys(_BARS, _STEPS),
    "depth_sigma": _METRES,
}
# names by which other programs know depth, and a grey picture
_CHANNELS = {"depth": "Z"}
_GREY = "Y"
_PFM = ".pfm"


@click.command(cls=SepiCommand)
@click.argument("result_path", metavar="RESULT", type=_PATH)
@click.argument("output", metavar="FILE", type=_PATH)
@click.option("--map", "name", type=click.Choice(list(_MAPS)), help="Map to write; default in .exr: all maps.")
@click.option("--to", "kind", type=click.Choice(["rgbd"]), help="Colour and depth side by side, for displays.")
@view_of_result
@camera_flags
def convert(result_path: Path, output: Path, name: str | None, kind: str | None, **seen: Any) -> None:
    """Write maps of RESULT as FILE, a picture of 32-bit floats: OpenEXR (.exr), TIFF (.tif, .tiff) or PFM (.pfm).

    RESULT is a folder that 'sepi depth' wrote, its result.h5 or its all_views.h5. OpenEXR has the channels disparity
    (pixels per view step) and confidence; Z (depth, metres) if the camera is known; sigma, low and high (pixels per
    view step) and depth_sigma (metres) if RESULT has error bars. A single map chosen by --map is the grey channel Y,
    which OpenCV reads. TIFF and PFM have one map, the disparity unless --map names another. OpenEXR needs the package
    of that name: pip install 'sepi[exr]'.

    With --to rgbd, FILE is a PNG for light field displays: the view on the left, its disparity on the right (black is
    far, white near).

    \b
    Examples:
      sepi convert cotton-depth cotton.exr
      sepi convert cotton-depth depth.tiff --map depth
      sepi convert cotton-depth sigma.tiff --map sigma
      sepi convert cotton-depth corner.pfm --view 0,0
      sepi convert cotton-depth cotton.png --to rgbd
    """
    from sepi.io.all_views import read_result_at
    from sepi.io.codecs import EXR, TIFF, write_exr, write_tiff
    from sepi.io.disparity_maps import write_pfm
    from sepi.io.images import write_png
    from sepi.io.map_pictures import colour_and_depth

    suffix = output.suffix.lower()
    if kind is not None:
        if suffix != ".png" or name is not None:
            raise SepiError(f"{output}: --to rgbd writes a PNG of view and disparity; expected NAME.png, and no --map")
        result = read_result_at(result_path, seen["view"])
        write_png(output, colour_and_depth(result.picture, result.disparity, result.unknown))
        click.echo(f"written: {output} (the view, and its disparity: black is far, white near)")
        return
    if suffix not in (*EXR, *TIFF, _PFM):
        raise SepiError(f"{output}: expected a name that ends with .exr, .tif, .tiff or .pfm, the format of the file")
    maps = _maps(result_path, **seen)
    if name is None and suffix not in EXR:
        name = "disparity"
    if name is not None and name not in maps:
        if name != "depth" and "sigma" not in maps:
            raise SepiError(f"{result_path}: no {name}, since the result has no error bars")
        raise SepiError(f"{result_path}: no {name}, since the camera is unknown; give --focal-length and the others")
    written = maps if name is None else {name: maps[name]}
    comment = ", ".join(f"{key}: {_MAPS[key]}" for key in written)
    if name is None:
        write_exr(output, {_CHANNELS.get(key, key): values for key, values in maps.items()}, comment)
    elif suffix in EXR:
        write_exr(output, {_GREY: maps[name]}, comment)
    elif suffix == _PFM:
        write_pfm(output, maps[name])
    else:
        write_tiff(output, maps[name], comment)
    click.echo(f"written: {output} ({comment})")


def _maps(path: Path, view: tuple[int, int] | None, geometry: Geometry | None) -> dict[str, FloatMap]:
    """Maps of a result by name, with depth if the camera is known, and error bars if there are any."""
    from sepi.io.all_views import read_result_at

    result = read_result_at(path, view)
    camera = camera_of(path, view, result, geometry)
    maps = {
        "disparity": result.disparity,
        "depth": None if camera is None else camera.depth(result.disparity),
        "confidence": result.confidence,
        **{name: getattr(result, name) for name in _BARS},
    }
    if camera is not None and result.sigma is not None:
        maps["depth_sigma"] = camera.depth_sigma(result.disparity, result.sigma)
    return {name: values for name, values in maps.items() if values is not None}
