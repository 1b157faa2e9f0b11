# Occluded regions (paper, section IV-B): depth from the views that see a pixel; choice `none` has no job.
rule occlusion:
    input:
        **stage_input("occlusion"),
    output:
        **stage_output("occlusion"),
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
        **stage_params("occlusion"),
    message:
        stage_message("occlusion", "occlusion")
    shell:
        command("sepi.occlusion --light-field {input.light_field:q} --previous {input.previous:q} " + STAGE_FLAGS)
