# Occluded regions (paper, section IV-B): depth from the views that see a pixel; choice `none` has no job.
rule occlusion:
    input:
        light_field=SCENE.light_field,
        previous=file_before("occlusion"),
    output:
        maps=stage_output("occlusion", "h5"),
        timing=stage_output("occlusion", "time.json"),
    log:
        stage_log("logs", "occlusion", "log"),
    benchmark:
        stage_log("benchmarks", "occlusion", "tsv")
    group:
        GROUP
    threads: threads_for
    resources:
        **stage_resources("occlusion"),
    params:
        choice=choice_for("occlusion"),
        parameters=parameters_of("occlusion"),
        code=code_of("occlusion"),
    message:
        stage_message("occlusion", "occlusion")
    shell:
        command("sepi.occlusion --light-field {input.light_field:q} --previous {input.previous:q} " + STAGE_FLAGS)
