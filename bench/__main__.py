"""The command ``python -m bench``."""

from __future__ import annotations

import tempfile
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from tqdm import tqdm

from bench import plot, tables
from bench.cases import GROUPS
from bench.measure import Case, Measurement, Result, measured, read_result
from bench.noisy import DIGITS
from bench.scene import Scene
from sepi.error_bars.cues import FLOORS
from sepi.errors import SepiError
from sepi.io.files import write_whole
from sepi.io.readers.options import AS_GIVEN, ReadOptions
from sepi.process.command import SepiGroup
from sepi.process.machine import this_machine
from sepi.process.threads import available_cores, use_threads
from sepi.reading import read_light_field
from sepi.scenes import SCENES, render
from sepi.scoring.scores import SCORES
from sepi.variants import VARIANTS, needing_files, variant_named
from sepi.workflow.rendered_scenes import NOISE_LEVELS

if TYPE_CHECKING:
    from bench.error_samples import Sample

_PATH = click.Path(path_type=Path)


@click.group(cls=SepiGroup, name="python -m bench", context_settings={"help_option_names": ["-h", "--help"]})
def main() -> None:
    """Measure time, memory and growth of the pipeline."""


@main.command()
@click.option(
    "--scene", default="curved_occluders", show_default=True, help="Built-in scene, or path of a light field."
)
@click.option("--repeats", type=click.IntRange(min=1), default=5, show_default=True, help="Timed calls of each case.")
@click.option("--threads", type=click.IntRange(min=1), help="Threads to use; default: one per core.")
@click.option(
    "--group", "groups", type=click.Choice(list(GROUPS)), multiple=True, help="Measure only this; repeatable."
)
@click.option("--small", is_flag=True, help="A tiny scene, once: shows that everything runs, not how fast.")
@click.option("--output", type=_PATH, default=Path("reports"), show_default=True, help="Folder to write to.")
def run(scene: str, repeats: int, threads: int | None, groups: tuple[str, ...], small: bool, output: Path) -> None:
    """Measure, and write bench.json, bench.md and bench.png."""
    if scene not in SCENES and not Path(scene).exists():
        raise SepiError(f"{scene}: neither a built-in scene ({', '.join(SCENES)}) nor a file or folder")
    if small and "large" in groups:
        raise click.UsageError("--small has no large light field; leave out --small or --group large")
    most = available_cores()
    threads = threads or most
    if threads > most:
        raise SepiError(f"--threads {threads}: this machine runs at most {most} at once")
    use_threads(threads)
    repeats, num_disparities = (1, 21) if small else (repeats, 181)
    with tempfile.TemporaryDirectory(prefix="sepi-bench-") as folder:
        files = Scene(scene, Path(folder), num_disparities, threads, small)
        light_field = files.write_files()
        (T, S), (H, W) = light_field.grid, light_field.shape
        settings: dict[str, Any] = {
            "scene": scene if scene in SCENES else Path(scene).name,
            "num_disparities": num_disparities,
            "threads": threads,
            "repeats": repeats,
            "size": f"{W}x{H}",
            "views": f"{T}x{S}",
            "pixels": f"{light_field.views.dtype} x {light_field.views.shape[4]}",
        }
        # the groups asked for, in the order of the table; default: all
        chosen = [name for name in GROUPS if name in (groups or GROUPS) and not (small and name == "large")]
        found, failed = _all_measured([case for name in chosen for case in GROUPS[name](files)], repeats, threads)
    result = Result(this_machine(), settings, tuple(found))
    for name, text in (("bench.json", result.as_json()), ("bench.md", tables.page(result))):
        write_whole(output / name, text)
    plot.write(result, output / "bench.png")
    click.echo(f"written to {output}/: bench.json bench.md bench.png")
    if failed:
        raise SepiError(f"{failed} of the benchmark's cases failed; the others are written")


@main.command()
@click.argument("before", type=_PATH)
@click.argument("after", type=_PATH)
def compare(before: Path, after: Path) -> None:
    """Print the results BEFORE and AFTER, two files bench.json, side by side."""
    old, new = read_result(before), read_result(after)
    rows = tables.comparison(old, new)
    if not rows:
        raise SepiError(f"{before} and {after}: nothing was measured in both")
    for difference in tables.differences(old, new):
        click.echo(f"sepi: warning: not the same {difference}", err=True)
    click.echo(f"# Before and after\n\nMedian seconds of each case.\n\n{tables.markdown(rows)}")


@main.command()
@click.argument("light_fields", metavar="INPUT[@ORDER]...", nargs=-1, required=True)
def disturb(light_fields: tuple[str, ...]) -> None:
    """Print estimates for light fields and disturbed copies: order of the views, range, row spacing.

    Each INPUT is a built-in scene, or the path of a light field, with '@ORDER' if its views are not in the right order.
    """
    from bench.disturbed import disturbed_verdicts

    total: dict[str, list[int]] = {}
    click.echo(f"{'light field':24} {'disturbance':20} right open wrong   range             rows")
    for given in light_fields:
        path, _, order = given.partition("@")
        if path in SCENES:
            light_field = render(path)
        else:
            light_field = read_light_field(path, options=ReadOptions(order=order or AS_GIVEN), check_order=False)
        for name, found in disturbed_verdicts(light_field):
            counts = [found.orders[word] for word in ("right", "open", "wrong")]
            known = found.range
            limits = "none" if known is None else f"{known.minimum:g} to {known.maximum:g}"
            click.echo(
                f"{light_field.name:24} {name:20} {counts[0]:5} {counts[1]:4} {counts[2]:5}   {limits:17} "
                f"{found.row_spacing:g}"
            )
            total[name] = [a + b for a, b in zip(total.get(name, [0, 0, 0]), counts, strict=True)]
    for name, counts in total.items():
        click.echo(f"{'all':24} {name:20} {counts[0]:5} {counts[1]:4} {counts[2]:5}")


@main.command()
@click.argument("benchmarks", type=_PATH)
def estimates(benchmarks: Path) -> None:
    """Print time and memory of the workflow's jobs beside those requested from a cluster.

    BENCHMARKS is the folder of this name from a run with --benchmark-extended.
    """
    from bench.estimates import jobs_below, rows

    click.echo(tables.markdown(rows(jobs_below(benchmarks))))


@main.command()
@click.option(
    "--scene", type=click.Choice(SCENES), default="curved_occluders", show_default=True, help="Built-in scene."
)
@click.option("--size", type=click.IntRange(min=64), default=128, show_default=True, help="Width and height.")
@click.option("--views", type=click.IntRange(min=3), default=7, show_default=True, help="Views in each direction.")
@click.option("--threads", type=click.IntRange(min=1), multiple=True, default=(1, 2, 4, 8), show_default=True)
@click.option("--variant", "variants", type=click.Choice(list(VARIANTS)), multiple=True, help="Only this; repeatable.")
def digests(scene: str, size: int, views: int, threads: tuple[int, ...], variants: tuple[str, ...]) -> None:
    """Print a digest of each variant's maps, and fail if threads or the processor's kernels change it."""
    from bench.digests import Condition
    from bench.digests import digests as digests_of

    conditions = [*map(Condition, threads), Condition(threads[-1], baseline=True)]
    # the package includes no network
    chosen = variants or tuple(name for name in VARIANTS if name not in needing_files())
    with tqdm(conditions, disable=None, leave=False, bar_format="{n}/{total} {desc} |{bar}|") as bar:
        found = [digests_of(condition, chosen, scene, size, views) for condition in bar]
    rows = []
    for variant in chosen:
        others = [str(c) for c, one in zip(conditions, found, strict=True) if one[variant] != found[0][variant]]
        rows.append({"variant": variant, "sha256": found[0][variant][:16], "other with": "; ".join(others) or "none"})
    click.echo(f"{scene}, {views}x{views} views of {size}x{size}: {'; '.join(map(str, conditions))}\n")
    click.echo(tables.markdown(rows))
    if any(row["other with"] != "none" for row in rows):
        raise SepiError("the maps depend on the threads or on the processor")


@main.command()
@click.argument("parameter", metavar="STAGE.CHOICE.NAME")
@click.argument("values", metavar="VALUE...", nargs=-1, required=True)
@click.option("--variant", default="best", show_default=True, help="Variant whose parameter it is.")
@click.option(
    "--scene",
    "scenes",
    multiple=True,
    help="Built-in scene, light field or file of a rendered scene; repeatable, at least two. Those of rendered scenes "
    "that are held out are refused.",
)
@click.option("--noise", type=click.Choice(NOISE_LEVELS), default="low", show_default=True, help="Of rendered scenes.")
@click.option("--score", type=click.Choice(list(SCORES)), default="mse100", show_default=True, help="What is compared.")
@click.option("--threads", type=click.IntRange(min=1), help="Threads to use; default: one per core.")
def sweep(
    parameter: str,
    values: tuple[str, ...],
    variant: str,
    scenes: tuple[str, ...],
    noise: str,
    score: str,
    threads: int | None,
) -> None:
    """Print scores of final maps for each VALUE of a parameter, and the best value without each scene in turn.

    \b
    Example:
      python -m bench sweep optimize.second_order.solves 1 2 3 --scene sticks.h5 --scene bust.h5
    """
    from bench.sweep import scene_for_choosing, scores_of, settings_of
    from bench.sweep import tables as tables_of

    use_threads(threads or available_cores())
    chosen = variant_named(variant)
    stage, settings = settings_of(chosen, parameter, values)
    # all scenes are read first, so that a refused one ends the command at once
    light_fields = {found.name: found for found in (scene_for_choosing(scene, noise) for scene in scenes)}
    if len(light_fields) < 2:
        raise click.UsageError("expected at least two scenes, by --scene")
    found = {}
    with tqdm(light_fields.items(), disable=None, leave=False, bar_format="{n}/{total} {desc} |{bar}|") as bar:
        for name, light_field in bar:
            bar.set_description(name)
            found[name] = scores_of(light_field, chosen, stage, settings, score)
    click.echo(f"{variant}, {parameter}, {SCORES[score]} of the whole map\n\n{tables_of(values, found)}")


@main.command()
@click.option("--scene", "scenes", multiple=True, help="Built-in scene or light field with ground truth; repeatable.")
@click.option("--sigma", "sigmas", type=click.FloatRange(0, 128), multiple=True, help="Noise, of 255; repeatable.")
@click.option("--variant", "variants", type=click.Choice(list(VARIANTS)), multiple=True, help="Repeatable.")
@click.option("--score", "scores", type=click.Choice(list(DIGITS)), multiple=True, help="Repeatable; all unless given.")
@click.option("--allowed", is_flag=True, help="Beside them what noise allows: Q25 / BadPix 0.07 %.")
@click.option("--threads", type=click.IntRange(min=1), help="Threads to use; default: one per core.")
def noise(
    scenes: tuple[str, ...],
    sigmas: tuple[float, ...],
    variants: tuple[str, ...],
    scores: tuple[str, ...],
    allowed: bool,
    threads: int | None,
) -> None:
    """Print scores of variants on light fields with noise added: MSE x100 / Q25 x100 / BadPix 0.07 %.

    The scores that noise allows, for a pixel alone and for a window of its surface, follow from the Cramer-Rao bound:
    they are those of normal errors of this standard deviation.

    \b
    Example:
      python -m bench noise --scene HCI/cotton --sigma 0 --sigma 3 --sigma 8
    """
    from bench.noisy import rows
    from bench.sweep import scene_for_choosing

    use_threads(threads or available_cores())
    light_fields = [scene_for_choosing(scene, "off") for scene in scenes or ("dots",)]
    chosen = sigmas or (0.0, 3.0, 8.0), variants or ("best", "fast")
    found = list(rows(light_fields, *chosen, scores or tuple(DIGITS), allowed))
    click.echo(tables.markdown(tables.longer_side_down(found)))


@main.command()
@click.option("--scene", "scenes", multiple=True, help="Built-in scene; repeatable.")
@click.option("--size", type=click.IntRange(min=48), default=128, show_default=True, help="Pixels of the pictures.")
@click.option("--views", type=click.IntRange(min=3), default=5, show_default=True, help="Rows and columns of cameras.")
@click.option("--seeds", type=click.IntRange(min=1), default=3, show_default=True, help="Arrays of each kind.")
@click.option("--variant", type=click.Choice(list(VARIANTS)), default="best", show_default=True)
@click.option("--threads", type=click.IntRange(min=1), help="Threads to use; default: one per core.")
def cameras(scenes: tuple[str, ...], size: int, views: int, seeds: int, variant: str, threads: int | None) -> None:
    """Print scores of scenes with calibrated cameras, relative to perfect cameras in their place.

    \b
    Example:
      python -m bench cameras --scene pyramids --scene curved_occluders
    """
    from bench.calibrated import rows

    use_threads(threads or available_cores())
    click.echo(tables.markdown(list(rows(scenes or ("pyramids",), size, views, range(seeds), variant))))


@main.command()
@click.option(
    "--scene", "scenes", multiple=True, help="Built-in scene, street:SEED, light field or render; repeatable."
)
@click.option(
    "--rounded",
    nargs=2,
    type=(str, float),
    multiple=True,
    metavar="SCENE STEP",
    help="Light field whose ground truth is rounded to STEP pixels per view step; repeatable.",
)
@click.option("--judge", multiple=True, help="File of a render that nothing is fitted to; repeatable.")
@click.option("--sigma", "sigmas", type=click.FloatRange(0, 128), multiple=True, help="Noise, of 255; repeatable.")
@click.option(
    "--grid", "grids", nargs=2, type=click.IntRange(1), multiple=True, help="Rows and columns of few views; repeatable."
)
@click.option(
    "--variant", "variants", type=click.Choice(list(VARIANTS)), multiple=True, help="Repeatable; best and fast."
)
@click.option("--only", type=click.Choice(list(FLOORS)), multiple=True, help="Cue to fit, others stay; repeatable.")
@click.option("--leave-out", is_flag=True, help="Judge each scene by a fit to all others.")
@click.option("--kept", type=_PATH, help="Folder where pixels are kept for the next time.")
@click.option("--threads", type=click.IntRange(min=1), help="Threads to use; default: one per core.")
def errors(
    scenes: tuple[str, ...],
    rounded: tuple[tuple[str, float], ...],
    judge: tuple[str, ...],
    sigmas: tuple[float, ...],
    grids: tuple[tuple[int, int], ...],
    variants: tuple[str, ...],
    only: tuple[str, ...],
    leave_out: bool,
    kept: Path | None,
    threads: int | None,
) -> None:
    """Fit the constants of the error bars (sepi/error_bars/calibration.py), and print them with their scores.

    Scores are the coverage of the interval of 90 %, and for the first variant its median width (pixels per view step,
    with the farthest view four steps away) and the area under the sparsification error curve by sigma and by
    smoothness.

    \b
    Example:
      python -m bench errors --scene rack --scene pencils --sigma 0 --sigma 8 --leave-out
    """
    from bench.error_model import as_code, fitted, judgements, left_out, pooled
    from bench.error_samples import CALIBRATIONS, light_fields, sample

    use_threads(threads or available_cores())
    variants = variants or ("best", "fast")
    choices = {variant_named(variant).choices["optimize"] for variant in variants}
    if len(choices) != 1 or not choices <= CALIBRATIONS.keys():
        raise click.UsageError(f"expected variants that end alike, in one of: {', '.join(CALIBRATIONS)}")
    (choice,) = choices
    steps = dict(rounded)

    def sampled(some: Iterable[str], levels: Sequence[float], held_out: bool = False) -> list[Sample]:
        found = []
        with tqdm(some, disable=None, leave=False, bar_format="{n}/{total} {desc} |{bar}|") as bar:
            for scene in bar:
                bar.set_description(scene)
                for name, light_field in light_fields([scene], levels, held_out, grids):
                    found += [sample(light_field, name, one, steps.get(scene, 0.0), kept) for one in variants]
        return found

    levels = sigmas or (0.0, 3.0, 8.0)
    samples = sampled(scenes or ("rack", "pencils"), levels) + sampled(steps, (0.0,))
    calibration = fitted(samples, CALIBRATIONS[choice], only)
    click.echo(as_code(choice.upper(), calibration))
    held_out = sampled(judge, levels, held_out=True)
    click.echo(tables.markdown(judgements(samples + held_out, {}, calibration)))
    if leave_out:
        click.echo("\nFitted to all other scenes:\n")
        click.echo(tables.markdown(judgements(samples, left_out(samples, CALIBRATIONS[choice], only), calibration)))
    names = ", ".join(f"`{variant}`" for variant in variants)
    parts = {"of the fit": samples, "held out": held_out}
    rows = [{"maps": f"{names}: {len(some)} {of}", **pooled(some, calibration)} for of, some in parts.items() if some]
    click.echo(f"\n{tables.markdown(rows)}")


def _all_measured(cases: list[Case], repeats: int, threads: int) -> tuple[list[Measurement], int]:
    """Measurements, and the number of failed cases; each gives a warning."""
    found = []
    with tqdm(cases, disable=None, leave=False, bar_format="{n}/{total} {desc} |{bar}|") as bar:
        for case in bar:
            bar.set_description(f"{case.group}: {case.name}"[:50].ljust(50))
            try:
                found.append(measured(case, repeats, threads))
            except SepiError as error:
                click.echo(f"sepi: warning: {error}", err=True)
    return found, len(cases) - len(found)


if __name__ == "__main__":
    main()
