# The stages of the method (paper, section IV): for each a rule, which runs `python -m sepi.STAGE` on the light field and
# on the maps of the stage before. A stage that hands its maps on is no job: the next one takes what was there before it.

# bytes of a job for each sample (pixel of any view) and for each pixel
STAGE_MEMORY = {"initial": (13, 1300), "occlusion": (18, 1400), "textureless": (17, 500), "optimize": (30, 1500)}

for stage in STAGES:
    path = key_of(LABELS, stage)

    rule:
        name:
            stage
        input:
            light_field=SCENE.light_field,
            previous=file_before(stage),
        output:
            maps=stage_output(stage, "h5"),
            timing=stage_output(stage, "time.json"),
        log:
            f"logs/{{dataset}}/{{scene}}/{path}/{stage}.log",
        benchmark:
            f"benchmarks/{{dataset}}/{{scene}}/{path}/{stage}.tsv"
        threads: threads_for
        resources:
            mem_mb=memory_for(*STAGE_MEMORY[stage]),
        params:
            previous=lambda wildcards, input: ["--previous", input.previous] if input.previous else [],
            choice=choice_for(stage),
            parameters=parameters_of(stage),
            code=code_digest(*stage_modules(stage)),
        message:
            "{wildcards.dataset}/{wildcards.scene}: {rule} (" + path.replace("{", "{wildcards.") + ")"
        shell:
            "python -m sepi.{rule} --light-field {input.light_field:q} {params.previous:q} "
            "--choice {params.choice} --parameters {params.parameters:q} --threads {threads} "
            "--output {output.maps:q} --timing {output.timing:q} 2> {log:q}"
