# Textureless regions (paper, section IV-C, Eq. 6-7): filled from their reliable edges; choice `none` has no job.
rule textureless:
    input:
        **stage_input("textureless"),
    output:
        **stage_output("textureless"),
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
        **stage_params("textureless"),
    message:
        stage_message("textureless", "textureless regions")
    shell:
        command("sepi.textureless --light-field {input.light_field:q} --previous {input.previous:q} " + STAGE_FLAGS)
