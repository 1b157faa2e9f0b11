"""The commands ``sepi convert`` and ``sepi points``, which write a result in other formats."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from sepi.cli.input_options import Geometry, Pair, camera_flags, camera_of
from sepi.errors import SepiError
from sepi.process.command import PATH, SepiCommand

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

    from sepi.io.result_folder import Result
    from sepi.lightfield import FloatMap

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
_EXR, _PFM = ".exr", ".pfm"

_view_of_result = click.option(
    "--view",
    type=Pair("ROW,COLUMN"),
    metavar="ROW,COLUMN",
    help="View to use, after 'sepi depth --all-views'; default: that of the result.",
)


@click.command(cls=SepiCommand)
@click.argument("result_path", metavar="RESULT", type=PATH)
@click.argument("output", metavar="FILE", type=PATH)
@click.option("--map", "name", type=click.Choice(list(_MAPS)), help="Map to write; default in .exr: all maps.")
@click.option("--to", "kind", type=click.Choice(["rgbd"]), help="Colour and depth side by side, for displays.")
@_view_of_result
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
    from sepi.io.codecs import TIFF, write_tiff
    from sepi.io.disparity_maps import write_pfm
    from sepi.io.images import write_png
    from sepi.io.result_folder import read_result

    suffix = output.suffix.lower()
    if kind is not None:
        if suffix != ".png" or name is not None:
            raise SepiError(f"{output}: --to rgbd writes a PNG of view and disparity; expected NAME.png, and no --map")
        result = read_result(result_path, seen["view"])
        write_png(output, _colour_and_depth(result))
        click.echo(f"written: {output} (the view, and its disparity: black is far, white near)")
        return
    if suffix not in (_EXR, *TIFF, _PFM):
        raise SepiError(f"{output}: expected a name that ends with .exr, .tif, .tiff or .pfm, the format of the file")
    maps = _maps(result_path, **seen)
    if name is None and suffix != _EXR:
        name = "disparity"
    if name is not None and name not in maps:
        if name != "depth" and "sigma" not in maps:
            raise SepiError(f"{result_path}: no {name}, since the result has no error bars")
        raise SepiError(f"{result_path}: no {name}, since the camera is unknown; give --focal-length and the others")
    comment = ", ".join(f"{key}: {_MAPS[key]}" for key in (maps if name is None else [name]))
    if name is None:
        _write_exr(output, {_CHANNELS.get(key, key): values for key, values in maps.items()}, comment)
    elif suffix == _EXR:
        _write_exr(output, {_GREY: maps[name]}, comment)
    elif suffix == _PFM:
        write_pfm(output, maps[name])
    else:
        write_tiff(output, maps[name], comment)
    click.echo(f"written: {output} ({comment})")


def _write_exr(path: Path, channels: Mapping[str, FloatMap], comment: str) -> None:
    """Write maps as channels of an OpenEXR file, losslessly compressed; equal content gives equal bytes.

    Parameters
    ----------
    path : Path
    channels : mapping of str to ndarray, shape (H, W), float32
        Name to map, all of one shape; NaN and infinity stay. Programs know the names ``Z`` (depth) and ``Y`` (grey).
    comment : str
        Meaning and unit of the numbers.

    Raises
    ------
    SepiError
        If the package OpenEXR is not installed, or the file cannot be written.
    """
    import numpy as np

    from sepi.io.codecs import open_exr
    from sepi.io.files import atomic_path, naming

    with naming(path):
        exr = open_exr()
    header = {"compression": exr.ZIP_COMPRESSION, "type": exr.scanlineimage, "comments": comment}
    pixels = {name: np.ascontiguousarray(values, np.float32) for name, values in channels.items()}
    with atomic_path(path) as temporary, exr.File(header, pixels) as file:
        file.write(str(temporary))


def _colour_and_depth(result: Result) -> npt.NDArray[np.uint8]:
    """View and disparity side by side, RGB (H, 2 W, 3), as light field displays take it; far is black, near white."""
    import numpy as np

    from sepi.io.map_pictures import levels, spread
    from sepi.lightfield import as_unit_float

    disparity = result.disparity
    colours = np.broadcast_to(levels(as_unit_float(result.picture)), (*disparity.shape, 3))
    depth = levels(spread(disparity, ~result.unknown & np.isfinite(disparity)))
    return np.hstack([colours, np.repeat(depth[:, :, None], 3, axis=2)])


def _maps(path: Path, view: tuple[int, int] | None, geometry: Geometry | None) -> dict[str, FloatMap]:
    """Maps of a result by name, with depth if the camera is known, and error bars if there are any."""
    from sepi.io.result_folder import read_result

    result = read_result(path, view)
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


@click.command(cls=SepiCommand)
@click.argument("result_path", metavar="RESULT", type=PATH)
@click.option("-o", "--output", type=PATH, help="PLY file to write; default: points[_ROW_COLUMN].ply in RESULT.")
@click.option("--min-confidence", type=float, default=0.0, metavar="X", help="Least confidence of points, 0 to 1.")
@click.option("--max-depth", type=float, metavar="M", help="Leave out points farther than this, metres.")
@click.option(
    "--max-sigma",
    type=float,
    metavar="X",
    help="Leave out points of a larger standard deviation: of the depth in metres if the camera is known, else of "
    "the disparity in pixels per view step.",
)
@click.option("--step", type=click.IntRange(min=1), default=1, metavar="N", help="Use every Nth row and column only.")
@click.option("--keep-unknown", is_flag=True, help="Keep unknown pixels, for whose depth no view has evidence.")
@_view_of_result
@camera_flags
def points(
    result_path: Path,
    output: Path | None,
    keep_unknown: bool,
    view: tuple[int, int] | None,
    geometry: Geometry | None,
    **chosen: Any,
) -> None:
    """Write the coloured point cloud of RESULT as a PLY file.

    RESULT is a folder that 'sepi depth' wrote, its result.h5 or its all_views.h5. Points are in metres if the scene's
    files or the flags give the camera; else they are a relief with x and y in pixels. If RESULT has error bars, each
    point has a sigma, in metres or in pixels per view step. docs/depth/metric_depth.md describes both.

    \b
    Examples:
      sepi points cotton-depth --min-confidence 0.5 --max-depth 6
      sepi points cotton-depth --max-sigma 0.02
      sepi points views-depth -o views.ply --focal-length 50 --baseline 10 --focus-distance 2 --sensor-size 36
    """
    from sepi.io.point_cloud import point_cloud, write_ply
    from sepi.io.result_folder import read_result

    result = read_result(result_path, view)
    if chosen["max_sigma"] is not None and result.sigma is None:
        raise SepiError(f"{result_path}: --max-sigma: the result has no error bars, like those of compared methods")
    cloud = point_cloud(
        result.picture,
        result.disparity,
        result.confidence,
        camera=camera_of(result_path, view, result, geometry),
        from_centre=result.from_centre,
        unknown=None if keep_unknown else result.unknown,
        rig=None if geometry is not None else result.rig,
        sigma=result.sigma,
        **chosen,
    )
    if not len(cloud.positions):
        tried = "lower --min-confidence, raise --max-depth or --max-sigma, give --keep-unknown"
        raise SepiError(f"{result_path}: no point is left; {tried}")
    name = "_".join(["points", *map(str, view or ())]) + ".ply"
    path = output or (result_path if result_path.is_dir() else result_path.parent) / name
    if path.suffix.lower() != ".ply":
        raise SepiError(f"{path}: expected a name that ends with .ply, the format of the file")
    write_ply(path, cloud)
    units = cloud.units or "metres" if cloud.metric else "relief, not to scale, since the camera is unknown"
    click.echo(f"written: {path} ({len(cloud.positions)} points, {units})")
