"""Cases of the pipeline: the command as a whole, and each of its steps."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

from bench.measure import Case, Figures, Measurement, Prepared, measured_command
from bench.scene import VARIANT, Scene, maps_before
from sepi.evaluate import score
from sepi.inspection import view_order
from sepi.inspection.disparity_range import estimate_range
from sepi.io.hdf5 import read_light_field, read_stage
from sepi.io.result_folder import write_result
from sepi.lightfield import LightField
from sepi.matching.view_subsets import halves_and_quarters
from sepi.pipeline import STAGES, Variant, estimate_depth
from sepi.reading import read_light_field as read_any
from sepi.stage import Parameters, StageMaps, no_progress

WINDOW_OPERATIONS = "window_operations"
"""Figure of a sweep: multiply-adds of its windows, beside its ``samples``."""


def read(scene: Scene) -> Prepared:
    """Read the light field as the user has it, without the check of its order."""
    return Prepared(lambda: read_any(scene.source, check_order=False))


def check_order(scene: Scene) -> Prepared:
    """Look whether the views are in the right order."""
    light_field = read_light_field(scene.light_field)
    return Prepared(lambda: view_order.check_order(light_field).warning())


def find_range(scene: Scene) -> Prepared:
    """Estimate the disparity range from the views."""
    light_field = read_light_field(scene.light_field)
    return Prepared(lambda: estimate_range(light_field))


def stage(scene: Scene, name: str, choice: str, settings: Parameters) -> Prepared:
    """Run one stage on the maps of the one before."""
    light_field = read_light_field(scene.light_field)
    before = maps_before(scene, name)

    def figures(maps: StageMaps) -> Figures:
        return {**_scores(light_field, maps), **_operations(light_field, name, choice, settings, maps)}

    return Prepared(lambda: STAGES[name][choice].run(light_field, before, settings, no_progress), figures)


def write(scene: Scene) -> Prepared:
    """Write all that ``sepi depth`` writes."""
    light_field = read_light_field(scene.light_field)
    maps = read_stage(scene.maps("optimize"))

    def call() -> None:
        with tempfile.TemporaryDirectory(dir=scene.folder) as folder:
            write_result(Path(folder) / "result", light_field, maps)

    return Prepared(call)


def whole(path: Path, variant: Variant, values: dict[str, dict[str, Any]]) -> Prepared:
    """All stages of a variant, from a light field in memory to its maps."""
    light_field = read_light_field(path)
    return Prepared(lambda: estimate_depth(light_field, variant, values))


def initial(path: Path, settings: Parameters) -> Prepared:
    """The initial stage alone."""
    light_field = read_light_field(path)
    return Prepared(lambda: STAGES["initial"]["sepi"].run(light_field, None, settings, no_progress))


def cases(
    scene: Scene, variant: Variant, settings: dict[str, Parameters], threads: int, range_unknown: bool
) -> list[Case]:
    """Each step from files to maps, in order; the range is estimated where the scene does not give it."""
    steps: list[tuple[str, Any, tuple[Any, ...]]] = [
        ("read the views", read, (scene,)),
        ("check their order", check_order, (scene,)),
        *([("estimate the range", find_range, (scene,))] if range_unknown else []),
        *((name, stage, (scene, name, choice, settings[name])) for name, choice in variant.choices.items()),
        ("write the maps", write, (scene,)),
    ]
    return [Case("stages", name, prepare, arguments, threads=threads) for name, prepare, arguments in steps]


def command(scene: Scene, threads: int, repeats: int, num_disparities: int) -> Measurement:
    """The command ``sepi depth``, from its start to its end: files to maps."""
    output = scene.folder / "depth"
    arguments = ["-m", "sepi", "depth", str(scene.source), "--output", str(output), "--threads", str(threads)]
    arguments += ["--variant", VARIANT]
    arguments += [f"--set={name}.num_disparities={num_disparities}" for name in ("initial.sepi", "occlusion.half_sepi")]
    return measured_command("whole", "sepi depth, files to maps", arguments, repeats)


def job(tiny: Path, output: Path, repeats: int) -> Measurement:
    """A job of the workflow on next to nothing: what start, imports and loading of the compiled kernels take."""
    arguments = ["-m", "sepi.initial", "--choice", "sepi", "--light-field", str(tiny), "--output", str(output)]
    return measured_command("whole", "start of a job", arguments, repeats)


def _scores(light_field: LightField, maps: StageMaps) -> Figures:
    """Scores of the whole map where there is ground truth: a stage made faster must not be made worse."""
    if light_field.ground_truth is None:
        return {}
    scores = score(maps.disparity, light_field.ground_truth)
    return {key: float(scores[key]) for key in ("mse100", "q25", "badpix007")}


def _operations(light_field: LightField, name: str, choice: str, settings: Any, maps: StageMaps) -> Figures:
    """Samples that a stage's sweep compares, and multiply-adds of its windows; nothing for other stages."""
    H, W = light_field.shape
    if (name, choice) == ("initial", "sepi"):
        pixels, groups = float(H * W), 1
    elif (name, choice) == ("occlusion", "half_sepi"):
        pixels = float(maps.extra["occlusion_candidates"].sum())
        numbers = halves_and_quarters(light_field.grid, light_field.reference_position).groups
        # the reference view's own group is empty
        groups = len(set(numbers.ravel().tolist()) - {int(numbers[light_field.reference_position])})
    else:
        return {}
    samples = pixels * (light_field.present.sum() - 1) * settings.num_disparities
    window = (2 * settings.window_radius + 1) ** 2
    return {
        "samples": float(samples),
        "channels": float(light_field.views.shape[-1]),
        WINDOW_OPERATIONS: pixels * settings.num_disparities * groups * window,
    }
