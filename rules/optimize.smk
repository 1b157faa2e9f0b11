# Global optimisation (paper, section IV-D, Eq. 8-12) over the whole map; choice `none` has no job.
rule optimize:
    input:
        light_field=SCENE.light_field,
        previous=file_before("optimize"),
    output:
        maps=stage_output("optimize", "h5"),
        timing=stage_output("optimize", "time.json"),
    log:
        stage_log("logs", "optimize", "log"),
    benchmark:
        stage_log("benchmarks", "optimize", "tsv")
    group:
        GROUP
    threads: threads_for
    resources:
        **stage_resources("optimize"),
    params:
        choice=choice_for("optimize"),
        parameters=parameters_of("optimize"),
        code=code_of("optimize"),
    message:
        stage_message("optimize", "global optimisation")
    shell:
        command("sepi.optimize --light-field {input.light_field:q} --previous {input.previous:q} " + STAGE_FLAGS)
