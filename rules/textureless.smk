# Textureless regions (paper, section IV-C, Eq. 6-7): filled from their reliable edges; choice `none` has no job.
rule textureless:
    input:
        light_field=SCENE.light_field,
        previous=file_before("textureless"),
    output:
        maps=stage_output("textureless", "h5"),
        timing=stage_output("textureless", "time.json"),
    log:
        stage_log("logs", "textureless", "log"),
    benchmark:
        stage_log("benchmarks", "textureless", "tsv")
    group:
        GROUP
    threads: threads_for
    resources:
        **stage_resources("textureless"),
    params:
        choice=choice_for("textureless"),
        parameters=parameters_of("textureless"),
        code=code_of("textureless"),
    message:
        stage_message("textureless", "textureless regions")
    shell:
        command("sepi.textureless --light-field {input.light_field:q} --previous {input.previous:q} " + STAGE_FLAGS)
