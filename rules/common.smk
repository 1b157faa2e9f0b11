# Shared by all rules: the checked configuration, and the names, threads and memory that follow from it.

import hashlib
import json
import os
import re
import sys
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path

from sepi.process.command import WORKFLOW_PROCESS
from sepi.errors import SepiError
from sepi.io.result_files import RESULT_FILES
from sepi.registry import added, extensions
from sepi.variants import HANDED_ON, STAGES, VARIANTS, choice_of, compared_methods
from sepi.report.plan import PARTS, Plan
from sepi.validation import require_known
from sepi.workflow.code_digest import ROOT, code_digest, stage_modules
from sepi.workflow.config import load_settings
from sepi.workflow.needs import stage_needs
from sepi.workflow.result_paths import RESULTS, key_of, scene_files

# the folder of the Snakefile, and whether another workflow uses it as a module
FOLDER = os.path.dirname(str(workflow.current_basedir))
IS_MODULE = os.path.realpath(FOLDER) != os.path.realpath(workflow.basedir)
# puts a module's `prefix` before paths
MODIFIER = workflow.modifier.path_modifier

# Jobs use the Python that runs Snakemake, even if its environment is not activated, and the package that the digests
# describe; jobs of a workflow that uses this one as a module keep theirs. Jobs end with Snakemake, since later writes
# would clash with the next run. For this they replace their shell (`exec`).
PYTHON_PATH = os.pathsep.join([str(ROOT), *filter(None, [os.environ.get("PYTHONPATH")])])
os.environ.update(
    {
        "SEPI_PYTHON": sys.executable,
        "SEPI_PYTHONPATH": PYTHON_PATH,
        WORKFLOW_PROCESS: str(os.getpid()),
        "OPENBLAS_NUM_THREADS": "1",
    }
)


def command(words):
    """Shell command that runs a module of the package, without the slow search for plug-ins."""
    return f'PYTHONPATH="$SEPI_PYTHONPATH" PYDANTIC_DISABLE_PLUGINS=1 exec "$SEPI_PYTHON" -m {words}'


try:
    SETTINGS = load_settings(config)
    # Snakemake would report a wrong name in a dozen lines
    for word in () if IS_MODULE else sys.argv[1:]:
        SETTINGS.require_target(word)
except SepiError as error:
    sys.exit(f"sepi: {error}")
except OSError as error:
    sys.exit(f"sepi: config: {error.filename}: {error.strerror}")


VARIANT_LABELS = {name: variant.labels for name, variant in SETTINGS.variants.items()}
SCENES_BY_DATASET = {name: SETTINGS.scenes_of(name) for name in SETTINGS.datasets}


def placed(path):
    """Path of a file or folder that the rules name, with the prefix of a module."""
    return MODIFIER.replace_prefix(f"{path}/").rstrip("/")


PLAN = Plan(RESULTS, SCENES_BY_DATASET, VARIANT_LABELS, list(SETTINGS.external), bad_thresholds=SETTINGS.bad_thresholds)


def as_far_as_computed(plan):
    """Plan of a report, without scenes that are not computed if the user asks for that."""
    of_scenes = {pair: replace(plan, scenes={pair[0]: [pair[1]]}) for pair in plan.pairs if SETTINGS.report.partial}
    return plan.without(
        [pair for pair, one in of_scenes.items() if not all(map(os.path.exists, map(placed, one.number_inputs())))]
    )


# name of a report to its plan; the main report has no name, the files of others lie in folders of their names
REPORTS = {
    plan.report: as_far_as_computed(plan)
    for plan in (
        PLAN.main(),
        PLAN.comparison(),
        *(dataset.report(PLAN, SETTINGS.scenes_of(name)) for name, dataset in SETTINGS.apart.items()),
    )
}
# the parts of variant best have numbers and tables, and neither a page nor images of their own
PLANS = REPORTS | {PARTS: replace(PLAN.parts_of_best(), scenes=REPORTS[""].scenes, missing=REPORTS[""].missing)}


def own_file(path):
    """Path of a user's file as an input, without the prefix of a module."""
    return str(path) if placed(path) == str(path) else os.path.abspath(path)


def source_file(name):
    """Path of a file of this workflow; for a remote module, of Snakemake's copy, which each run may make anew."""
    path = os.path.normpath(os.path.join(FOLDER, name))
    return path if os.path.isfile(path) else ancient(workflow.source_path(f"../{name}"))


# rules of extensions
ADDED_RULES = [
    str(Path(find_spec(name).origin).with_name("rules.smk")) for one in extensions().values() for name in one.rules
]


# patterns of a scene's files in rules
SCENE = scene_files("{dataset}", "{scene}")
# the same for commands that find files by themselves
PLACED_SCENE = scene_files("{dataset}", "{scene}", Path(placed(RESULTS)))
LABELS = {stage: f"{{{stage}}}" for stage in STAGES}

if not REPORTS[""].pairs:
    sys.exit("sepi: config.report.partial: no scene is computed yet")


# marker file: all outputs of a scene are made
SCENE_COMPLETE = f"{RESULTS}/{{dataset}}/{{scene}}/complete"
# variants whose final maps `all` makes
LISTED_MAPS = ["best", "paper", *SETTINGS.own_variants]


# On a cluster, a group of dependent jobs is one submission: all jobs of a scene, or of several small scenes with
# --group-components. Locally, a group has no effect.
GROUP = "scene"


wildcard_constraints:
    dataset="[^/]+",
    scene="[^/]+",
    variant="[^/]+",
    which="|".join(plan.ending for plan in PLANS.values()),
    report="|".join(name and f"{name}/" for name in REPORTS),


def stage_input(stage):
    """Inputs of a stage's rule: light field, the file of the last stage that ran before, and files of the choice."""
    before = list(STAGES)[: list(STAGES).index(stage)]

    def previous(wildcards):
        labels = {name: wildcards[name] for name in before}
        return scene_files(wildcards.dataset, wildcards.scene).stage(labels, before[-1])

    return {"light_field": SCENE.light_field, "files": files_of(stage), **({"previous": previous} if before else {})}


def stage_output(stage):
    """Outputs of a stage's rule, for every choice except the one that hands maps on and has no job."""
    known = {name: "|".join(map(re.escape, found)) for name, found in SETTINGS.parameters.items()}
    known[stage] = "|".join(re.escape(label) for label in SETTINGS.parameters[stage] if label != HANDED_ON)
    patterns = {name: f"{{{name},{labels}}}" for name, labels in known.items()}
    return {"maps": SCENE.stage(patterns, stage), "timing": SCENE.stage(patterns, stage, "time.json")}


def stage_params(stage):
    """Parameters of a stage's rule, as functions of wildcards: a change of one of them runs the job again."""
    known = {label: SETTINGS.parameters_json(stage, label) for label in SETTINGS.parameters[stage]}
    return {
        "stage": stage,
        "choice": lambda wildcards: choice_of(wildcards[stage]),
        "previous": lambda wildcards, input: [f"--previous={input.previous}"] if "previous" in input.keys() else [],
        "parameters": lambda wildcards: known[wildcards[stage]],
        "dates": dates_of(files_of(stage)),
        "code": lambda wildcards: code_digest(*stage_modules(stage, STAGES[stage][choice_of(wildcards[stage])])),
    }


def stage_log(folder, stage, ending):
    """Pattern of a stage's log or benchmark."""
    return f"{folder}/{{dataset}}/{{scene}}/{key_of(LABELS, stage)}/{stage}.{ending}"


def stage_message(stage, title):
    """Message when a stage starts: the scene, and the choices up to this stage."""
    choices = key_of(LABELS, stage).replace("{", "{wildcards.")
    return f"{{wildcards.dataset}}/{{wildcards.scene}}: {title} ({choices})"


def final_file(wildcards):
    """Stage file with the final maps of a variant."""
    require_known("variant", [wildcards.variant], SETTINGS.variants)
    return PLAN.stage_file(wildcards.dataset, wildcards.scene, wildcards.variant, PLAN.stages[-1])


def result_files(variants, scenes=REPORTS[""].pairs):
    """Files of the final maps of scenes for these variants."""
    return [
        str(PLAN.files(dataset, scene).variant(variant) / name)
        for dataset, scene in scenes
        for variant in variants
        for name in RESULT_FILES
    ]


def plan_of(wildcards):
    """Plan of the report that the wildcards name, by the ending of a file or by a folder."""
    return PLANS[(wildcards.get("which") or wildcards.get("report", "")).strip("_/")]


def files_of(stage):
    """Function of wildcards: further files that a stage's choice reads, such as a network."""
    return lambda wildcards: list(map(own_file, SETTINGS.parameters[stage][wildcards[stage]].files))


def scene_of(wildcards):
    """Scene that a rule's wildcards name."""
    return SETTINGS.scene(wildcards.dataset, wildcards.scene)


def source_files(kind):
    """Function of wildcards: files of a scene's views (``files``) or ground truth (``truth``), as inputs."""

    def files(wildcards):
        scene = scene_of(wildcards)
        return list(map(str if scene.is_made else own_file, getattr(scene, kind)))

    return files


def dates_of(files):
    """Function of wildcards: a digest of sizes and dates of files that no job makes.

    Snakemake only notices newer files, and files from unzip, rsync -a, cp -p or tar keep an old date.
    """

    def digest(wildcards):
        found = [os.stat(file) for file in files(wildcards) if not file.startswith(f"{RESULTS}/")]
        return hashlib.sha256(repr([(file.st_size, file.st_mtime_ns) for file in found]).encode()).hexdigest()

    return digest


def ingest_source(wildcards):
    """Source of a scene, as arguments of the ingest command."""
    scene = scene_of(wildcards)
    reader = [] if scene.module is None else ["--module", scene.module]
    return [placed(scene.source) if scene.is_made else str(scene.source), *reader, *scene.flags]


def truth_source(wildcards):
    """Source of a scene's ground truth, as arguments of its command; empty without ground truth."""
    scene = scene_of(wildcards)
    return ingest_source(wildcards) if scene.module or scene.brought_truth else []


def own_truth_size(wildcards):
    """Light field whose size the user's own ground truth must have; empty without own ground truth."""
    return scene_files(wildcards.dataset, wildcards.scene).light_field if scene_of(wildcards).own_truth else []


def own_truth(wildcards):
    """The user's own ground truth as flags; as a function of the input, Snakemake would not notice a change."""
    own = scene_of(wildcards).own_truth
    if own is None:
        return []
    scale = [] if own.scale is None else ["--truth-scale", str(own.scale)]
    return ["--truth", str(own.path), *scale, "--light-field", placed(own_truth_size(wildcards))]


# thresholds of BadPix that the user asked for
BAD_THRESHOLDS = [word for threshold in SETTINGS.bad_thresholds for word in ("--bad", str(threshold))]


def ingest_range(wildcards):
    """Disparity range that the user set, as flags; empty for the scene's own or an estimate."""
    given = scene_of(wildcards).disparity_range
    return [] if given is None else ["--disparity-range", *map(str, given)]


def threads_for(wildcards):
    """Threads of a job: one for each 8 million samples, since small scenes gain more from parallel jobs."""
    return min(1 + scene_of(wildcards).samples // 8_000_000, 8)


def stage_resources(stage):
    """Resources of a stage's rule: memory in MB and minutes of a job, as functions of wildcards."""

    def asked(wildcards):
        scene, parameters = scene_of(wildcards), SETTINGS.parameters[stage][wildcards[stage]]
        light_field = scene_files(wildcards.dataset, wildcards.scene, Path(placed(RESULTS))).light_field
        return stage_needs(scene, light_field, stage, parameters, threads_for(wildcards))

    return {
        "mem_mb": lambda wildcards, attempt: attempt * asked(wildcards)[0],
        "runtime": lambda wildcards, attempt: attempt * asked(wildcards)[1],
    }


def memory_for(*needs, **more):
    """Function of wildcards: memory of a job in MB (:meth:`sepi.workflow.datasets.Scene.memory_mb`).

    A job that a cluster ended for lack of memory asks for more at the next attempt.
    """
    return lambda wildcards, attempt: attempt * scene_of(wildcards).memory_mb(*needs, **more)


def minutes_for(*seconds, **more):
    """Function of wildcards: time of a job in minutes (:meth:`sepi.workflow.datasets.Scene.minutes`)."""
    return lambda wildcards, attempt: attempt * scene_of(wildcards).minutes(*seconds, **more)


def of_source(read, of_module):
    """Function of wildcards: ``of_module`` for scenes that a module reads or renders, else ``read``."""
    return lambda wildcards, attempt: (of_module if scene_of(wildcards).module else read)(wildcards, attempt)
