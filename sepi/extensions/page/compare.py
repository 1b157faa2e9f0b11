"""The command ``sepi compare``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from sepi.cli.input_options import Reading, reading_flags, truth_flags
from sepi.cli.scene_argument import read_ground_truth, require_one_view
from sepi.errors import SepiError
from sepi.process.command import SepiCommand

if TYPE_CHECKING:
    from sepi.io.disparity_maps import TruthFile

_PATH = click.Path(path_type=Path)


@click.command(cls=SepiCommand)
@click.argument("a", metavar="A", type=_PATH)
@click.argument("b", metavar="B", type=_PATH)
@click.argument("ground_truth", metavar="[GROUND_TRUTH|SCENE]", type=_PATH, required=False)
@click.option("-o", "--output", type=_PATH, default=Path("compare.html"), show_default=True, help="Page to write.")
@truth_flags
@reading_flags
def compare(a: Path, b: Path, ground_truth: Path | None, output: Path, own: TruthFile | None, reading: Reading) -> None:
    """Show the disparity maps A and B side by side on a page.

    A and B are maps of any program: PFM, HDF5 with a dataset 'disparity', NumPy (.npy), TIFF of floats,
    'disparity_16bit.png', or a folder that 'sepi depth' wrote. GROUND_TRUTH is such a map, too. With a SCENE, a light
    field, the page also shows its view and scores regions; --truth FILE gives ground truth to a scene without any. The
    page is one file and needs no network. A slider wipes between two maps, differences or errors; values and close-ups
    follow the cursor; a point cloud can be turned.

    \b
    Examples:
      sepi compare cotton-depth spo.pfm cotton
      sepi compare before.pfm after.pfm gt_disp_lowres.pfm -o page.html
    """
    from sepi.cli.evaluate import score_table
    from sepi.extensions.page.comparison_page import Comparison, comparison_page
    from sepi.io.all_views import read_disparity_at, read_error_bars_at
    from sepi.io.files import atomic_path

    view = reading.options.view
    maps = read_disparity_at(a, view), read_disparity_at(b, view)
    require_one_view(a, b, reading)
    values, light_field = read_ground_truth(ground_truth, a, reading, own, maps[0].shape)
    for path, other in ((b, maps[1]), (own.path if own else ground_truth, values), (ground_truth, light_field)):
        if other is not None and other.shape != maps[0].shape:
            raise SepiError(f"{path}: is {other.shape}, but {a} is {maps[0].shape} (height, width)")
    bars = read_error_bars_at(a, view), read_error_bars_at(b, view)
    step = 0.0 if own is None else own.step
    found = Comparison(_names(a, b), maps, values, light_field, bars, step)
    with atomic_path(output) as temporary:
        temporary.write_text(comparison_page(found), encoding="utf-8")
    for name, scores in found.scores.items():
        click.echo(f"{name}\n{score_table(scores, truth_step=step)}\n")
    click.echo(f"written: {output}")


def _names(a: Path, b: Path) -> tuple[str, str]:
    """The shortest different ends of two paths."""
    parts = [path.resolve().parts for path in (a, b)]
    for count in range(1, max(map(len, parts)) + 1):
        one, other = ("/".join(names[-count:]) for names in parts)
        if one != other:
            return one, other
    return f"{parts[0][-1]} (A)", f"{parts[1][-1]} (B)"
