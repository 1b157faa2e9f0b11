"""The command ``sepi compare``: the report's viewer for two disparity maps, with scores if truth is known."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import click
import numpy as np
import pandas as pd

from sepi.cli.evaluate import score_table
from sepi.cli.input_options import Reading, read_ground_truth, reading_flags, require_one_view, truth_flags
from sepi.errors import SepiError
from sepi.extensions.page.page import SCRIPTS, colour_scales, embedded_scenes, environment
from sepi.extensions.page.viewer import viewer_json
from sepi.io.all_views import read_disparity_at, read_error_bars_at
from sepi.io.disparity_maps import TruthFile
from sepi.io.files import write_whole
from sepi.io.scores import AllScores
from sepi.lightfield import FloatMap, LightField
from sepi.process.command import PATH, SepiCommand
from sepi.report.panels import Panel
from sepi.report.table import BEST, Head, Kind, Section, section, shown
from sepi.scoring.error_bars import ERROR_BAR_SCORES, ErrorBars
from sepi.scoring.scores import COUNTS, EDGE_SCORES, SCORES, region_masks, score_regions
from sepi.stage import StageMaps

# share of the pixels beyond each end of the colour scale, so that a few wrong ones do not widen it
_BEYOND = 0.005

_SHOWN = ["mse100", "q25", "badpix007", "fattening", "thinning", "non_finite"]
# scores without a best value: intervals should be neither wide nor narrow
_WITH_BARS = ["coverage", "width"]


@dataclass(frozen=True)
class Comparison:
    """Two maps of one view, with its light field and ground truth if known.

    Attributes
    ----------
    names : (str, str)
    maps : (ndarray, ndarray), shape (H, W), float32
        Pixels per view step.
    ground_truth : ndarray, shape (H, W), float32, or None
    light_field : LightField or None
        For the reference view and the regions.
    bars : (StageMaps or None, StageMaps or None)
        The maps with error bars and confidence, if they have any.
    truth_step : float
        Rounding step of the ground truth, pixels per view step; 0: not rounded.
    """

    names: tuple[str, str]
    maps: tuple[FloatMap, FloatMap]
    ground_truth: FloatMap | None = None
    light_field: LightField | None = None
    bars: tuple[StageMaps | None, StageMaps | None] = (None, None)
    truth_step: float = 0.0

    @cached_property
    def scores(self) -> dict[str, AllScores]:
        """Scores of each map by its name; empty without ground truth."""
        if self.ground_truth is None:
            return {}
        field = self.light_field
        masks, reach = (None, None) if field is None else (region_masks(field), field.reach)
        scores = {}
        for name, values, maps in zip(self.names, self.maps, self.bars, strict=True):
            bars = None if maps is None else ErrorBars.of(maps, reach, self.truth_step)
            scores[name] = score_regions(values, self.ground_truth, masks, bars=bars)
        return scores


def comparison_page(found: Comparison) -> str:
    """The page as HTML."""
    scene = {
        "dataset": found.names[0],
        "scene": found.names[1],
        "grid": [1, 1],
        "first": {"a": "a", "b": "b"},
        **viewer_json(list(_panels(found)), _limits(found), found.light_field),
        "probes": [],
    }
    template = environment().get_template("compare.html.j2")
    return template.render(
        title=f"{found.names[0]} beside {found.names[1]}",
        names=found.names,
        section=_score_section(found),
        scenes=embedded_scenes([scene]),
        first=scene,
        scales=colour_scales(),
        scripts=[name for name in SCRIPTS if name != "pixel.js"],
    )


def _panels(found: Comparison) -> Iterator[Panel]:
    (a, b), maps, ground_truth = found.names, found.maps, found.ground_truth
    if found.light_field is not None:
        yield Panel("reference_view", "reference view", "Scene", "picture")
    if ground_truth is not None:
        yield Panel("ground_truth", "ground truth", "Scene", "disparity", ground_truth, precise=True)
    for key, name, values, bars in zip("ab", found.names, maps, found.bars, strict=True):
        confidence = None if bars is None else bars.confidence
        yield Panel(key, name, "Maps", "disparity", values, confidence=confidence, bars=bars, precise=True)
    yield Panel("difference", f"{a} minus {b}", "Maps", "error", maps[0], minus=maps[1])
    for key, name, bars in zip("ab", found.names, found.bars, strict=True):
        if bars is not None:
            yield Panel(f"{key}/sigma", f"{name}: standard deviation", "Error bars", "sigma", bars.sigma)
    if ground_truth is not None:
        for key, name, values in zip("ab", found.names, maps, strict=True):
            yield Panel(f"{key}/error", f"{name}: error", "Errors", "error", values, minus=ground_truth)
        title, ends = f"{a} beside {b}: which is more accurate", ("less accurate", "more accurate")
        yield Panel("change", title, "Errors", "change", maps[1], minus=maps[0], ground_truth=ground_truth, ends=ends)


def _limits(found: Comparison) -> tuple[float, float]:
    """Ends of the scale of disparity: those of the ground truth, else of nearly all pixels of both maps."""
    shown = found.maps if found.ground_truth is None else (found.ground_truth,)
    known = np.concatenate([values[np.isfinite(values)] for values in shown])
    if known.size == 0:
        return 0.0, 1.0
    low, high = (float(end) for end in np.quantile(known, (_BEYOND, 1 - _BEYOND)))
    return (low, high) if low < high else (low - 0.5, high + 0.5)


def _score_section(found: Comparison) -> Section | None:
    """A table for the page: for each protocol and region, the scores of both maps, with the better one marked."""
    if not found.scores:
        return None
    titles = SCORES | EDGE_SCORES | ERROR_BAR_SCORES | COUNTS
    scores = [*_SHOWN, *(_WITH_BARS if any(bars is not None for bars in found.bars) else ())]
    heads = {"protocol": Head("protocol", Kind.TEXT), "region": Head("region", Kind.TEXT)}
    heads |= {
        f"{score} {name}": Head(f"{titles[score]}, {name}", Kind.OURS) for score in scores for name in found.names
    }
    of_maps = []
    for known in found.scores.values():
        rows = {(protocol, region): of for protocol, regions in known.items() for region, of in regions.items()}
        of_maps.append(pd.DataFrame.from_dict(rows, orient="index").reindex(columns=scores, fill_value="no interval"))
    texts, marks = [], []
    for name, one, other in zip(found.names, of_maps, reversed(of_maps), strict=True):
        texts.append(shown(one, 3, "n/a").add_suffix(f" {name}"))
        better = one[_SHOWN].astype(float).lt(other[_SHOWN].astype(float))
        marks.append(better.map({True: BEST, False: ""}.get).add_suffix(f" {name}"))
    cells = pd.concat(texts, axis=1).rename_axis(["protocol", "region"]).reset_index()
    return section("", heads, cells, pd.concat(marks, axis=1).reset_index(drop=True))


@click.command(cls=SepiCommand)
@click.argument("a", metavar="A", type=PATH)
@click.argument("b", metavar="B", type=PATH)
@click.argument("ground_truth", metavar="[GROUND_TRUTH|SCENE]", type=PATH, required=False)
@click.option("-o", "--output", type=PATH, default=Path("compare.html"), show_default=True, help="Page to write.")
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
    write_whole(output, comparison_page(found))
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
