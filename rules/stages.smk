# The stages, one after the other, for each choice that a variant names; a stage's choice `none` has no job.
TITLES = {
    # paper, section IV-A, Eq. 1-5: for each pixel the candidate at which the views agree best
    "initial": "initial depth",
    # section IV-B: depth from the views that see a pixel
    "occlusion": "occlusion",
    # section IV-C, Eq. 6-7: filled from their reliable edges
    "textureless": "textureless regions",
    # section IV-D, Eq. 8-12: over the whole map
    "optimize": "global optimisation",
}

for stage, title in TITLES.items():

    rule:
        name:
            stage
        input:
            light_field=SCENE.light_field,
            previous=file_before(stage),
            files=files_of(stage),
        output:
            maps=stage_output(stage, "h5"),
            timing=stage_output(stage, "time.json"),
        log:
            stage_log("logs", stage, "log"),
        benchmark:
            stage_log("benchmarks", stage, "tsv")
        group:
            GROUP
        threads: threads_for
        resources:
            **stage_resources(stage),
        params:
            # not in the command: when a job runs, `stage` is the last one
            module=f"sepi.{stage}",
            previous=lambda wildcards, input: ["--previous", input.previous] if input.previous else [],
            choice=choice_for(stage),
            parameters=parameters_of(stage),
            dates=dates_of(files_of(stage)),
            code=code_of(stage),
        message:
            stage_message(stage, title)
        shell:
            command(
                "{params.module} --light-field {input.light_field:q} {params.previous:q} --choice {params.choice} "
                "--parameters {params.parameters:q} --threads {threads} "
                "--output {output.maps:q} --timing {output.timing:q} 2> {log:q}"
            )
