# Initial depth (paper, section IV-A, Eq. 1-5): for each pixel the candidate at which the views agree best.
rule initial:
    input:
        light_field=SCENE.light_field,
        files=files_of("initial"),
    output:
        maps=stage_output("initial", "h5"),
        timing=stage_output("initial", "time.json"),
    log:
        stage_log("logs", "initial", "log"),
    benchmark:
        stage_log("benchmarks", "initial", "tsv")
    group:
        GROUP
    threads: threads_for
    resources:
        **stage_resources("initial"),
    params:
        choice=choice_for("initial"),
        parameters=parameters_of("initial"),
        dates=dates_of(files_of("initial")),
        code=code_of("initial"),
    message:
        stage_message("initial", "initial depth")
    shell:
        command("sepi.initial --light-field {input.light_field:q} " + STAGE_FLAGS)
