# What all rules share: the checked configuration, and the names, threads and memory that follow from it.

import json
import os
import re
import sys
import time
from pathlib import Path

from sepi.command import WORKFLOW_PROCESS
from sepi.compared.methods import LEARNED, METHODS
from sepi.errors import SepiError
from sepi.io.result_folder import RESULT_FILES
from sepi.pipeline import HANDED_ON, STAGES, VARIANTS, choice_of
from sepi.report.plan import Plan
from sepi.validation import require_known
from sepi.workflow.code_digest import ROOT, code_digest, stage_modules
from sepi.workflow.candidates import candidates_factor, candidates_mb
from sepi.workflow.config import load_settings
from sepi.workflow.result_paths import COMPARISON_ENDING, PARTS_ENDING, RESULTS, key_of, scene_files
from sepi.workflow.run_folder import note_run, say_if_full, say_so, take_over, tidy_up
from sepi.workflow.run_log import show_progress

STARTED = time.time()

# jobs call `python`: the one that runs Snakemake, whether or not its environment is activated, and with the package
# whose code the digests are made of
for name, folder in {"PATH": Path(sys.executable).parent, "PYTHONPATH": ROOT}.items():
    os.environ[name] = os.pathsep.join([str(folder), *filter(None, [os.environ.get(name)])])
# ... and end with it, whatever ends it: what a job that nobody waits for goes on to write would meet the next run's. For
# this they take the place of their shell (`exec`)
os.environ[WORKFLOW_PROCESS] = str(os.getpid())

try:
    SETTINGS = load_settings(config)
except SepiError as error:
    sys.exit(f"sepi: {error}")
except OSError as error:
    sys.exit(f"sepi: config: {error.filename}: {error.strerror}")


VARIANT_LABELS = {name: variant.labels for name, variant in SETTINGS.variants.items()}
SCENES_BY_DATASET = {name: SETTINGS.scenes_of(name) for name in SETTINGS.datasets}
PLAN = Plan(RESULTS, SCENES_BY_DATASET, VARIANT_LABELS, list(SETTINGS.external))
COMPARISON = PLAN.comparison()

# the rules' patterns
SCENE = scene_files("{dataset}", "{scene}")
LABELS = {stage: f"{{{stage}}}" for stage in STAGES}


# a file that says that everything of a scene is made
SCENE_COMPLETE = f"{RESULTS}/{{dataset}}/{{scene}}/complete"
# variants whose final maps everybody gets
LISTED_MAPS = ["best", "paper", *SETTINGS.own_variants]


# a group of jobs that depend on each other is one submission to a cluster: all that is made of a scene. (Several small scenes
# with --group-components; run locally, a group means nothing.)
GROUP = "scene"


wildcard_constraints:
    dataset="[^/]+",
    scene="[^/]+",
    variant="[^/]+",
    which=f"|{PARTS_ENDING}|{COMPARISON_ENDING}",


def stage_output(stage, ending):
    """Pattern of what a stage writes: for every choice but the one that hands maps on, which is no job."""
    known = {name: "|".join(map(re.escape, found)) for name, found in SETTINGS.parameters.items()}
    known[stage] = "|".join(re.escape(label) for label in SETTINGS.parameters[stage] if label != HANDED_ON)
    return SCENE.stage({name: f"{{{name},{labels}}}" for name, labels in known.items()}, stage, ending)


def stage_log(folder, stage, ending):
    """Pattern of a stage's log or benchmark."""
    return f"{folder}/{{dataset}}/{{scene}}/{key_of(LABELS, stage)}/{stage}.{ending}"


def stage_message(stage, title):
    """What is shown when a stage starts: the scene, and the choices that led to it."""
    choices = key_of(LABELS, stage).replace("{", "{wildcards.")
    return f"{{wildcards.dataset}}/{{wildcards.scene}}: {title} ({choices})"


# the command of every stage, after its inputs
STAGE_FLAGS = (
    "--choice {params.choice} --parameters {params.parameters:q} --threads {threads} "
    "--output {output.maps:q} --timing {output.timing:q} 2> {log:q}"
)


def file_before(stage):
    """Function of wildcards: the file with the maps that a stage is given, of the last stage before it that ran."""
    before = list(STAGES)[: list(STAGES).index(stage)]

    def file(wildcards):
        labels = {name: wildcards[name] for name in before}
        return scene_files(wildcards.dataset, wildcards.scene).stage(labels, before[-1])

    return file


def final_file(wildcards):
    """The file with the final maps of a variant."""
    require_known("variant", [wildcards.variant], SETTINGS.variants)
    return PLAN.stage_file(wildcards.dataset, wildcards.scene, wildcards.variant, PLAN.stages[-1])


def result_files(variants, scenes=SETTINGS.scenes):
    """The final maps of scenes for these variants."""
    return [
        str(PLAN.files(dataset, scene).variant(variant) / name)
        for dataset, scene in scenes
        for variant in variants
        for name in RESULT_FILES
    ]


def plan_of(which):
    """The plan of one of the files of numbers or scores, and whether it is that of the parts of variant best."""
    return COMPARISON if which == COMPARISON_ENDING else PLAN, which == PARTS_ENDING


def scored_maps(wildcards):
    """The stage files whose maps go into one of a scene's score files."""
    plan, parts = plan_of(wildcards.which)
    return plan.scored_files(wildcards.dataset, wildcards.scene, parts)


def choice_for(stage):
    """Function of wildcards: the choice of a stage."""
    return lambda wildcards: choice_of(wildcards[stage])


def parameters_of(stage):
    """Function of wildcards: the parameters of a stage's choice as JSON, so that a change of them is seen."""
    known = {label: SETTINGS.parameters_json(stage, label) for label in SETTINGS.parameters[stage]}
    return lambda wildcards: known[wildcards[stage]]


def code_of(stage):
    """Function of wildcards: the digest of the code that a stage's choice runs."""
    known = {name: code_digest(*stage_modules(stage, choice)) for name, choice in STAGES[stage].items()}
    return lambda wildcards: known[choice_of(wildcards[stage])]


def files_of(stage):
    """Function of wildcards: files that a stage's choice reads beside the light field, such as a network."""
    return lambda wildcards: list(SETTINGS.parameters[stage][wildcards[stage]].files)


def scene_of(wildcards):
    """The scene that a rule's wildcards name."""
    return SETTINGS.scene(wildcards.dataset, wildcards.scene)


def ingest_source(wildcards):
    """Where a scene comes from, as words for the ingest command."""
    scene = scene_of(wildcards)
    if scene.source is None:
        return ["--builtin", scene.name, "--size", str(scene.height)]
    return [str(scene.source), *scene.flags]


def ingest_range(wildcards):
    """The disparity range that the user set, as flags; none where the scene's own or an estimate serves."""
    given = scene_of(wildcards).disparity_range
    return [] if given is None else ["--disparity-range", *map(str, given)]


def threads_for(wildcards):
    """Threads of a job: one for each 8 million samples, since small scenes gain more from jobs side by side."""
    return min(1 + scene_of(wildcards).samples // 8_000_000, 8)


def stage_memory_for(stage, bytes_per_sample, bytes_per_pixel):
    """Function of wildcards: memory of a stage's job in MB, as usual for the stage or as its choice needs.

    A cost volume of more than the usual number of candidates adds to it.
    """

    def memory(wildcards, attempt):
        scene, parameters = scene_of(wildcards), SETTINGS.parameters[stage][wildcards[stage]]
        usual = scene.memory_mb(bytes_per_sample, bytes_per_pixel)
        own = scene.memory_mb(parameters.needs.bytes_per_sample, parameters.needs.bytes_per_pixel)
        return attempt * (max(usual, own) + candidates_mb(scene, *sweep_of(stage, wildcards)))

    return memory


def stage_minutes_for(stage, seconds_per_megasample):
    """Function of wildcards: time of a stage's job in minutes, as usual for the stage or as its choice needs.

    A job that goes through more than the usual number of candidates takes longer.
    """

    def minutes(wildcards, attempt):
        scene, parameters = scene_of(wildcards), SETTINGS.parameters[stage][wildcards[stage]]
        seconds = max(seconds_per_megasample, parameters.needs.seconds_per_megasample)
        return attempt * scene.minutes(candidates_factor(scene, *sweep_of(stage, wildcards)) * seconds)

    return minutes


def memory_for(*needs, **more):
    """Function of wildcards: memory of a job in MB (:meth:`sepi.workflow.datasets.Scene.memory_mb`).

    A job that is tried again, since a cluster ended it for want of memory, asks for more.
    """

    def memory(wildcards, attempt):
        return attempt * scene_of(wildcards).memory_mb(*needs, **more)

    return memory


def minutes_for(*seconds, **more):
    """Function of wildcards: time of a job in minutes (:meth:`sepi.workflow.datasets.Scene.minutes`)."""

    def minutes(wildcards, attempt):
        return attempt * scene_of(wildcards).minutes(*seconds, **more)

    return minutes


def sweep_of(stage, wildcards):
    """A scene's light field, and the parameters of the choice that a stage makes of it."""
    light_field = scene_files(wildcards.dataset, wildcards.scene).light_field
    return light_field, SETTINGS.parameters[stage][wildcards[stage]]


def is_new(file):
    """Whether this run wrote a file."""
    return Path(file).exists() and Path(file).stat().st_mtime >= STARTED


def print_warnings():
    """Show what the readers of light fields and of external maps warned of in this run, from their logs."""
    missing = {}
    for dataset, scene in SETTINGS.scenes:
        for rule in ("ingest", "external"):
            log = Path(f"logs/{dataset}/{scene}/{rule}.log")
            for line in log.read_text().splitlines() if is_new(log) else ():
                absent = re.match(r"sepi: warning: external (.+), scene .+: no such file$", line)
                if absent:
                    missing.setdefault(absent[1], []).append(f"{dataset}/{scene}")
                elif line.startswith("sepi: warning:"):
                    print(line, flush=True)
    # a method rarely has maps of all scenes: one line for each method
    for method, scenes in missing.items():
        others = f" and {len(scenes) - 3} others" if len(scenes) > 4 else ""
        named = ", ".join(scenes[:3] if others else scenes)
        print(f"sepi: warning: external {method}: no map of {named}{others}", flush=True)


def print_written(tables, maps):
    """Name the tables and the folders of maps that this run wrote."""
    new = [file for file in [*tables, *maps] if is_new(file)]
    groups = {
        "Tables and figures": [file for file in new if file in tables],
        "Maps": list(dict.fromkeys(f"{Path(file).parent}/" for file in new if file in maps)),
    }
    for title, files in groups.items():
        if files:
            print(f"{title} written:", *dict.fromkeys(files), sep="\n  ", flush=True)


# where all that is made is
MADE = [Path(RESULTS), Path("reports")]

# a run that was killed does not stop the next one
if workflow.is_main_process and not workflow.output_settings.dryrun:
    if take_over(Path(workflow.overwrite_workdir or "."), MADE):
        say_so()


# a progress bar, or a line for each job; a dry run is as Snakemake shows it
if workflow.is_main_process and not (workflow.output_settings.dryrun or workflow.output_settings.verbose):
    show_progress(logger)
