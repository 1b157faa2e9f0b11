"""Accuracy and time of the maps of all views: ``python -m bench.all_views``.

The table compares them with separate estimates of a few views, which take one estimate each, and with the reference
view's map moved pixel by pixel, with gaps filled by the nearest value.
"""

from __future__ import annotations

import time
from typing import NamedTuple

import click
import numpy as np
import numpy.typing as npt
from tqdm import tqdm

from bench import tables
from sepi.extensions.views.all_views import EDGE_VIEWS, estimate_all_views
from sepi.lightfield import FloatMap, LightField
from sepi.matching.carried_map import carried_map
from sepi.pipeline import estimate_depth
from sepi.process.command import SepiCommand
from sepi.process.threads import use_threads
from sepi.scenes import SCENES, render, true_disparity
from sepi.variants import VARIANTS
from sepi.variants.built_in import DEFAULT_VARIANT

BAD = 0.07
"""Error above which a pixel is bad, pixels per view step."""

# of 9x9 views: inside the grid and at its border, one of them a corner
_BY_THEMSELVES = ((0, 0), (1, 6), (4, 2), (6, 3), (8, 5))


class Scores(NamedTuple):
    """MSE x100 and percentage of bad pixels of each view, shape (views,), and the time in seconds."""

    mse: npt.NDArray[np.float64]
    bad: npt.NDArray[np.float64]
    seconds: float


def scores(disparity: FloatMap, truth: FloatMap, seconds: float) -> Scores:
    """Scores of maps ``(views, H, W)``."""
    error = np.abs(disparity - truth).reshape(len(truth), -1).astype(np.float64)
    return Scores(100 * (error**2).mean(axis=1), 100 * (error > BAD).mean(axis=1), seconds)


def moved_pixels(disparity: FloatMap, baseline: npt.NDArray[np.float64]) -> FloatMap:
    """A map moved to another view pixel by pixel; the nearest surface wins, gaps take the closest pixel's value."""
    from scipy import ndimage

    H, W = disparity.shape
    at = np.rint(np.indices((H, W)) - disparity * baseline[:, None, None]).astype(np.int64)
    inside = ((at >= 0) & (at < np.array([H, W])[:, None, None])).all(axis=0)
    moved = np.full((H, W), -np.inf, np.float32)
    np.maximum.at(moved, tuple(at[:, inside]), disparity[inside])
    nearest = ndimage.distance_transform_edt(np.isinf(moved), return_distances=False, return_indices=True)
    return np.asarray(moved[tuple(nearest)], np.float32)


def disagreement(disparity: FloatMap, baselines: npt.NDArray[np.float64]) -> tuple[float, float]:
    """Differences between the maps of neighbouring views, each warped to the next view of its row.

    Parameters
    ----------
    disparity : ndarray, shape (T, S, H, W), float32
    baselines : ndarray, shape (T, S, 2), float64

    Returns
    -------
    mean, bad : float
        Mean absolute difference, pixels per view step, and percentage of pixels that differ by more than ``BAD``.
    """
    differences = []
    for t, s in np.ndindex(disparity.shape[0], disparity.shape[1] - 1):
        down, across = baselines[t, s + 1] - baselines[t, s]
        difference = np.abs(carried_map(disparity[t, s], (down, across)) - disparity[t, s + 1])
        differences.append(difference[np.isfinite(difference)])
    of_all = np.concatenate(differences)
    return float(of_all.mean()), 100 * float((of_all > BAD).mean())


def measured(light_field: LightField, variant: str) -> dict[str, str]:
    """A row of the table."""
    shape = (*light_field.grid, *light_field.shape)
    size, baselines = light_field.shape[0], light_field.baselines
    each = baselines.reshape(-1, 2)
    truth = np.stack([true_disparity(light_field.name, size=size, baseline=(v, u)) for v, u in each])
    started = time.perf_counter()
    maps = estimate_depth(light_field, variant)
    once = time.perf_counter() - started
    moved = np.stack([moved_pixels(maps.disparity, baseline) for baseline in each])
    row = {"scene": light_field.name, **_columns("moved pixels", scores(moved, truth, 0))}
    for name, edge_views in (("carried", 0), ("edges", EDGE_VIEWS)):
        started = time.perf_counter()
        ours = estimate_all_views(light_field, maps, variant, edge_views=edge_views).disparity
        found = scores(ours.reshape(-1, *shape[2:]), truth, once + time.perf_counter() - started)
        row |= _columns(name, found) | {f"{name}: time": f"{found.seconds / once:.1f}"}
    few = [t * shape[1] + s for t, s in _BY_THEMSELVES if t < shape[0] and s < shape[1]]
    alone = [estimate_depth(light_field.seen_from((n // shape[1], n % shape[1])), variant).disparity for n in few]
    own = scores(np.stack(alone), truth[few], 0)
    row["few by themselves"] = f"{own.mse.mean():.2f} / {own.bad.mean():.2f}"
    row["few, edges"] = f"{found.mse[few].mean():.2f} / {found.bad[few].mean():.2f}"
    mean, bad = disagreement(ours, baselines)
    row["disagreement"] = f"{mean:.4f} / {bad:.2f}"
    return row


def _columns(name: str, found: Scores) -> dict[str, str]:
    return {
        f"{name}: mean": f"{found.mse.mean():.2f} / {found.bad.mean():.2f}",
        f"{name}: worst": f"{found.mse.max():.2f} / {found.bad.max():.2f}",
    }


@click.command(name="python -m bench.all_views", cls=SepiCommand)
@click.argument("names", metavar="[SCENE]...", nargs=-1, type=click.Choice(list(SCENES)))
@click.option("--size", type=click.IntRange(min=64), default=192, show_default=True, help="Width and height.")
@click.option("--views", type=click.IntRange(min=3), default=9, show_default=True, help="Views in each direction.")
@click.option("--variant", type=click.Choice(list(VARIANTS)), default=DEFAULT_VARIANT, show_default=True)
@click.option("--threads", type=click.IntRange(min=1), default=1, show_default=True)
def main(names: tuple[str, ...], size: int, views: int, variant: str, threads: int) -> None:
    """Print MSE x100 / BadPix 0.07 of all views of built-in scenes, and times in units of one estimate."""
    use_threads(threads)
    # first, so that no time includes loading
    measured(render("pyramids", size=64, views=3), variant)
    rows = []
    with tqdm(names or tuple(SCENES), disable=None, leave=False, bar_format="{n}/{total} {desc} |{bar}|") as bar:
        for name in bar:
            bar.set_description(name)
            rows.append(measured(render(name, size=size, views=views), variant))
    click.echo(tables.markdown(rows))


if __name__ == "__main__":
    main()
