"""The cases of each group."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import h5py

from bench import floor, plain
from bench.busy import stages_beside_another_program
from bench.measure import Case, Figures, Prepared, command
from bench.scene import VARIANT, Scene, inputs, sweep_values
from sepi.inspection.disparity_range import estimate_range
from sepi.inspection.view_order import check_order
from sepi.io.hdf5 import read_light_field, read_stage
from sepi.io.result_folder import write_result
from sepi.lightfield import LightField
from sepi.matching.view_subsets import halves_and_quarters
from sepi.pipeline import estimate_depth
from sepi.reading import read_light_field as read_any
from sepi.scoring.scores import score
from sepi.stage import Parameters, StageMaps, no_progress
from sepi.variants import HANDED_ON, STAGES, stage_parameters, variant_named

GROWTH = {"size": (128, 256, 512, 1024), "views": (3, 5, 7, 9, 13, 17), "num_disparities": (46, 91, 181, 362)}
SMALL_GROWTH = {"size": (64, 128), "views": (3,), "num_disparities": (11, 21)}
GROWTH_REPEATS = 3
"""Number of timed calls of the cases of growth."""

LARGE = (1024, 17)
"""Size and views a side of the large light field."""

SNAKEFILE = Path(__file__).parents[1] / "Snakefile"

VARIANTS_BESIDE = ("paper", "best", "fast")

COMPRESSIONS: dict[str, dict[str, Any]] = {
    "none": {},
    "lzf": {"compression": "lzf"},
    "gzip 1": {"compression": "gzip", "compression_opts": 1},
    "gzip 1, shuffled": {"compression": "gzip", "compression_opts": 1, "shuffle": True},
    "gzip 4, shuffled": {"compression": "gzip", "compression_opts": 4, "shuffle": True},
}
"""Name to arguments of h5py; filters that plain h5py cannot read are left out."""


def _stage_cases(scene: Scene) -> Iterator[Case]:
    """The whole command, a job on a tiny scene, the arithmetic floor, and each step from files to maps."""
    sweeps = [
        f"--set={name}.num_disparities={scene.num_disparities}" for name in ("initial.sepi", "occlusion.half_sepi")
    ]
    options = ("--threads", str(scene.threads), "--variant", VARIANT, *sweeps)
    output = str(scene.folder / "depth")
    yield Case(
        "whole",
        "sepi depth, files to maps",
        command,
        ("sepi", "depth", str(scene.source), "--output", output, *options),
    )
    scene.write_grown([(64, 3)])
    tiny, output = str(scene.grown(64, 3)), str(scene.folder / "tiny-initial.h5")
    job = ("sepi.initial", "--choice", "sepi", "--light-field", tiny, "--output", output)
    yield Case("whole", "start of a job", command, job)
    yield Case("whole", "sepi --help", command, ("sepi", "--help"))
    yield Case("whole", "sepi info", command, ("sepi", "info", str(scene.source)))
    for name in floor.KERNELS:
        yield Case("floor", name, floor.prepare, (name, scene.threads))
    yield Case("stages", "read the views", read, (scene.source,))
    yield Case("stages", "check their order", inspect, (scene.path, check_order))
    # for scenes without a range
    if read_light_field(scene.path).require_disparity_range().source == "estimated":
        yield Case("stages", "estimate the range", inspect, (scene.path, estimate_range))
    for name, choice in variant_named(VARIANT).choices.items():
        yield Case("stages", name, stage, (scene.path, name, choice, scene.parameters[name]))
    yield Case("stages", "write the maps", write, (scene.path,))


def _variant_cases(scene: Scene) -> Iterator[Case]:
    """Variants: from files to maps, in one process, on one thread, and by stage."""
    output = str(scene.folder / "variant")
    for variant in VARIANTS_BESIDE:
        words = ("depth", str(scene.source), "--output", output, "--threads", str(scene.threads), "--variant", variant)
        yield Case("variants", f"{variant}: files to maps", command, ("sepi", *words))
        yield Case("variants", f"{variant}: once more in a process", whole_variant, (scene.path, variant))
        if scene.threads > 1:
            yield Case(
                "variants", f"{variant}: the same on one thread", whole_variant, (scene.path, variant), threads=1
            )
    for variant in VARIANTS_BESIDE:
        for name, choice in variant_named(variant).choices.items():
            if choice != HANDED_ON:
                yield Case("variants", f"{variant}: {name}", stage_of_variant, (scene.path, variant, name))


def _busy_cases(scene: Scene) -> Iterator[Case]:
    """Stages beside a program that keeps one core busy."""
    for variant in VARIANTS_BESIDE[: 1 if scene.small else None]:
        yield Case("busy", variant, stages_beside_another_program, (scene.path, variant), most=1)


def _growth_cases(scene: Scene) -> Iterator[Case]:
    """Initial stage and all stages, with one axis growing at a time."""
    axes = SMALL_GROWTH if scene.small else GROWTH
    powers = {2**n for n in range(scene.threads.bit_length())} | {scene.threads}
    start = {
        "size": min(256, max(axes["size"])),
        "views": min(9, max(axes["views"])),
        "num_disparities": scene.num_disparities,
        "threads": scene.threads,
    }
    points = [(axis, start | {axis: value}) for axis, values in axes.items() for value in values]
    # threads help with large pictures
    size = min(512, max(axes["size"]))
    points += [("threads", start | {"size": size, "threads": value}) for value in sorted(powers)]
    scene.write_grown([(at["size"], at["views"]) for _, at in points])
    for axis, at in points:
        settings = scene.parameters["initial"].model_copy(update={"num_disparities": at["num_disparities"]})
        path = scene.grown(at["size"], at["views"])
        for group, prepare, arguments in (
            ("growth, initial", stage, (path, "initial", "sepi", settings)),
            ("growth, all stages", whole, (path, at["num_disparities"])),
        ):
            figures = {key: float(value) for key, value in at.items()}
            yield Case(group, f"{axis} {at[axis]}", prepare, arguments, figures, at["threads"], GROWTH_REPEATS)


def _large_case(scene: Scene) -> Iterator[Case]:
    scene.write_grown([LARGE, (64, 3)])
    # an untimed call loads the kernels for such views
    whole(scene.grown(64, 3), scene.num_disparities).call()
    size, views = LARGE
    path, name = scene.grown(size, views), f"{views}x{views} views of {size}x{size}"
    yield Case("large", f"{VARIANT}: {name}", whole, (path, scene.num_disparities), most=1)
    whole_variant(scene.grown(64, 3), "best").call()
    yield Case("large", f"best: {name}", whole_variant, (path, "best"), most=1)
    # in a new folder, so that all jobs run
    folder = scene.folder / "workflow"
    folder.mkdir()
    words = ("--snakefile", str(SNAKEFILE), "--directory", str(folder), "--cores", str(scene.threads), "--quiet", "all")
    yield Case("whole", "snakemake, built-in scenes", command, ("snakemake", *words, "--", "all"), most=1)


def _plain_cases(scene: Scene) -> Iterator[Case]:
    """The initial stage, then the plain ones, which take long enough to be measured once."""
    known = {"num_disparities": float(scene.num_disparities)}
    yield Case("beside", "sepi", stage, (scene.path, "initial", "sepi", scene.parameters["initial"]), known)
    number = 3 if scene.small else 20
    for name, warp in plain.WARPS.items():
        yield Case(
            "beside", name, plain.prepare, (scene.path, number, warp), {"num_disparities": float(number)}, most=1
        )


def _storage_cases(scene: Scene) -> Iterator[Case]:
    """Writing, then reading, of each content with each of HDF5's own compressions."""
    for content in ("views", "maps", "masks"):
        for option in list(COMPRESSIONS)[: 2 if scene.small else None]:
            for prepare in (store, load):
                yield Case("storage", f"{prepare.__name__} {content}, {option}", prepare, (scene.path, content, option))


GROUPS: dict[str, Callable[[Scene], Iterator[Case]]] = {
    "stages": _stage_cases,
    "variants": _variant_cases,
    "busy": _busy_cases,
    "growth": _growth_cases,
    "beside": _plain_cases,
    "storage": _storage_cases,
    "large": _large_case,
}
"""Group to the function that writes its files and yields its cases."""


def read(source: Path) -> Prepared:
    """Read the light field from its source, without the check of its order."""
    return Prepared(lambda: read_any(source, check_order=False))


def inspect(path: Path, question: Callable[[LightField], Any]) -> Prepared:
    """Check or estimate something of a light field: the order of its views, its disparity range."""
    light_field = read_light_field(path)
    return Prepared(lambda: question(light_field))


def stage(path: Path, name: str, choice: str, settings: Parameters) -> Prepared:
    """Run one stage on the maps of the one before; figures are scores and operations of its sweep."""
    light_field, before = inputs(path, name)

    def figures(maps: StageMaps) -> Figures:
        return _operations(light_field, choice, settings, maps) | _scores(light_field, maps)

    return Prepared(lambda: STAGES[name][choice].run(light_field, before, settings, no_progress), figures)


def whole(path: Path, num_disparities: int) -> Prepared:
    """All stages of the variant, from a light field in memory to its maps."""
    light_field = read_light_field(path)
    values = sweep_values(num_disparities)
    return Prepared(lambda: estimate_depth(light_field, variant_named(VARIANT), values))


def whole_variant(path: Path, variant: str) -> Prepared:
    """All stages of a variant, from a light field in memory to its maps; figures are scores."""
    light_field = read_light_field(path)
    return Prepared(lambda: estimate_depth(light_field, variant), lambda maps: _scores(light_field, maps))


def stage_of_variant(path: Path, variant: str, name: str) -> Prepared:
    """One stage of a variant, on the maps of the stages before it."""
    light_field = read_light_field(path)
    chosen = variant_named(variant)
    settings = stage_parameters(chosen)
    maps: StageMaps | None = None
    for before, choice in chosen.choices.items():
        if before == name:
            break
        maps = STAGES[before][choice].run(light_field, maps, settings[before], no_progress)
    run = STAGES[name][chosen.choices[name]].run
    return Prepared(
        lambda: run(light_field, maps, settings[name], no_progress), lambda found: _scores(light_field, found)
    )


def write(path: Path) -> Prepared:
    """Write all that ``sepi depth`` writes."""
    light_field = read_light_field(path)
    maps = read_stage(path.with_name("optimize.h5"))

    def call() -> None:
        with tempfile.TemporaryDirectory(dir=path.parent) as folder:
            write_result(Path(folder) / "result", light_field, maps)

    return Prepared(call)


def store(path: Path, content: str, option: str) -> Prepared:
    """Write all views, or the last stage's maps of 32 bits or masks of 8; the figure is the file's size."""
    if content == "views":
        arrays: dict[str, Any] = {"views": read_light_field(path).views}
    else:
        maps = read_stage(path.with_name("optimize.h5")).all()
        arrays = {name: one for name, one in maps.items() if (one.dtype.itemsize >= 4) == (content == "maps")}
    target = path.with_name(f"{content} {option}.h5")

    def call() -> None:
        with h5py.File(target, "w") as file:
            for name, values in arrays.items():
                file.create_dataset(name, data=values, **COMPRESSIONS[option])

    return Prepared(call, lambda _: {"megabytes": target.stat().st_size / 1e6})


def load(path: Path, content: str, option: str) -> Prepared:
    """Read the file that :func:`store` wrote."""

    def call() -> None:
        with h5py.File(path.with_name(f"{content} {option}.h5")) as file:
            for name in file:
                file[name][...]

    return Prepared(call)


def _scores(light_field: LightField, maps: StageMaps) -> Figures:
    """Scores of the maps; empty without ground truth."""
    if light_field.ground_truth is None:
        return {}
    scores = score(maps.disparity, light_field.ground_truth)
    return {key: float(scores[key]) for key in ("mse100", "q25", "badpix007")}


def _operations(light_field: LightField, choice: str, settings: Any, maps: StageMaps) -> Figures:
    """Number of samples of a stage's sweep, and of multiply-adds of its windows; empty for other stages."""
    H, W = light_field.shape
    if choice == "sepi":
        pixels, groups = H * W, 1
    elif choice == "half_sepi":
        pixels = int(maps.extra["occlusion_candidates"].sum())
        numbers = halves_and_quarters(light_field).groups
        # the reference view's own group is empty
        groups = len(set(numbers.ravel().tolist()) - {int(numbers[light_field.reference_position])})
    else:
        return {}
    window = (2 * settings.window_radius + 1) ** 2
    return {
        "samples": float(pixels * (light_field.present.sum() - 1) * settings.num_disparities),
        "channels": float(light_field.views.shape[-1]),
        floor.WINDOW_OPERATIONS: float(pixels * settings.num_disparities * groups * window),
    }
