# The stages of a variant, in order; choice `none` of a stage has no job.
TITLES = {
    # paper, section IV-A, Eq. 1-5: for each pixel the candidate at which the views agree best
    "initial": "initial depth",
    # section IV-B: depth from the views that see a pixel
    "occlusion": "occlusion",
    # section IV-C, Eq. 6-7: regions filled from their reliable edges
    "textureless": "textureless regions",
    # section IV-D, Eq. 8-12: the whole map
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
            # not in the command, which is formatted when a job runs: after the loop
            module=f"sepi.{stage}",
            choice=choice_for(stage),
            previous=lambda wildcards, input: ["--previous", input.previous] if input.previous else [],
            parameters=parameters_of(stage),
            dates=dates_of(files_of(stage)),
            code=code_of(stage),
        message:
            stage_message(stage, title)
        shell:
            command(
                "{params.module} --light-field {input.light_field:q} {params.previous:q} "
                "--choice {params.choice} --parameters {params.parameters:q} --threads {threads} "
                "--output {output.maps:q} --timing {output.timing:q} 2> {log:q}"
            )
