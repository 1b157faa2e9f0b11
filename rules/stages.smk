# The stages of the method (paper, section IV), a rule for each. Only their choices differ; a stage whose choice is
# `none` has no job.

TITLES = {
    # section IV-A, Eq. 1-5: for each pixel the candidate at which the views agree best
    "initial": "initial depth",
    # section IV-B: depth from the views that see a pixel
    "occlusion": "occlusion",
    # section IV-C, Eq. 6-7: filled from their reliable edges
    "textureless": "textureless regions",
    # section IV-D, Eq. 8-12: over the whole map
    "optimize": "global optimisation",
}


def stage_input(stage):
    """Inputs of a stage's rule: light field, the file of the last stage that ran before, and files of the choice."""
    before = list(STAGES)[: list(STAGES).index(stage)]

    def previous(wildcards):
        labels = {name: wildcards[name] for name in before}
        return scene_files(wildcards.dataset, wildcards.scene).stage(labels, before[-1])

    return {"light_field": SCENE.light_field, "files": files_of(stage), **({"previous": previous} if before else {})}


def files_of(stage):
    """Function of wildcards: further files that a stage's choice reads, such as a network."""
    return lambda wildcards: list(map(own_file, SETTINGS.parameters[stage][wildcards[stage]].files))


def stage_output(stage):
    """Outputs of a stage's rule, for every choice except the one that hands maps on and has no job."""
    known = {name: "|".join(map(re.escape, found)) for name, found in SETTINGS.parameters.items()}
    known[stage] = "|".join(re.escape(label) for label in SETTINGS.parameters[stage] if label != HANDED_ON)
    patterns = {name: f"{{{name},{labels}}}" for name, labels in known.items()}
    return {"maps": SCENE.stage(patterns, stage), "timing": SCENE.stage(patterns, stage, "time.json")}


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


def stage_params(stage):
    """Parameters of a stage's rule, as functions of wildcards: a change of one of them runs the job again."""
    known = {label: SETTINGS.parameters_json(stage, label) for label in SETTINGS.parameters[stage]}
    return {
        "stage": stage,
        "previous": lambda wildcards, input: ["--previous", input.previous] if "previous" in input.keys() else [],
        "choice": lambda wildcards: choice_of(wildcards[stage]),
        "parameters": lambda wildcards: known[wildcards[stage]],
        "dates": dates_of(files_of(stage)),
        "code": lambda wildcards: code_digest(*stage_modules(stage, STAGES[stage][choice_of(wildcards[stage])])),
    }


for stage, title in TITLES.items():
    # the choices up to this stage
    choices = key_of({name: f"{{{name}}}" for name in STAGES}, stage)

    rule:
        name:
            stage
        input:
            **stage_input(stage),
        output:
            **stage_output(stage),
        log:
            f"logs/{{dataset}}/{{scene}}/{choices}/{stage}.log",
        benchmark:
            f"benchmarks/{{dataset}}/{{scene}}/{choices}/{stage}.tsv"
        group:
            GROUP
        threads: threads_for
        resources:
            **stage_resources(stage),
        params:
            **stage_params(stage),
        message:
            f"{{wildcards.dataset}}/{{wildcards.scene}}: {title} ({choices.replace('{', '{wildcards.')})"
        shell:
            command(
                # evaluated when a job starts, after the loop
                "sepi.{params.stage} --light-field {input.light_field:q} {params.previous:q} "
                "--choice {params.choice} --parameters {params.parameters:q} --threads {threads} "
                "--output {output.maps:q} --timing {output.timing:q} 2> {log:q}"
            )
