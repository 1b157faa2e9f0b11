# Global optimisation (paper, section IV-D, Eq. 8-12) over the whole map; choice `none` has no job.
use rule initial as optimize with:
    input:
        **stage_input("optimize"),
    output:
        **stage_output("optimize"),
    log:
        stage_log("logs", "optimize", "log"),
    benchmark:
        stage_log("benchmarks", "optimize", "tsv")
    resources:
        **stage_resources("optimize"),
    params:
        **stage_params("optimize"),
    message:
        stage_message("optimize", "global optimisation")
