# Occluded regions (paper, section IV-B): depth from the views that see a pixel; choice `none` has no job.
use rule initial as occlusion with:
    input:
        **stage_input("occlusion"),
    output:
        **stage_output("occlusion"),
    log:
        stage_log("logs", "occlusion", "log"),
    benchmark:
        stage_log("benchmarks", "occlusion", "tsv")
    resources:
        **stage_resources("occlusion"),
    params:
        **stage_params("occlusion"),
    message:
        stage_message("occlusion", "occlusion")
