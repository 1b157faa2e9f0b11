# Textureless regions (paper, section IV-C, Eq. 6-7): filled from their reliable edges; choice `none` has no job.
use rule initial as textureless with:
    input:
        **stage_input("textureless"),
    output:
        **stage_output("textureless"),
    log:
        stage_log("logs", "textureless", "log"),
    benchmark:
        stage_log("benchmarks", "textureless", "tsv")
    resources:
        **stage_resources("textureless"),
    params:
        **stage_params("textureless"),
    message:
        stage_message("textureless", "textureless regions")
