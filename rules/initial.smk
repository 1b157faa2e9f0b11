# Initial depth (paper, section IV-A, Eq. 1-5): for each pixel the candidate at which the views agree best. The rules of
# the other stages follow this one.
rule initial:
    input:
        **stage_input("initial"),
    output:
        **stage_output("initial"),
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
        **stage_params("initial"),
    message:
        stage_message("initial", "initial depth")
    shell:
        command(
            "sepi.{params.stage} --light-field {input.light_field:q} {params.previous:q} --choice {params.choice} "
            "--parameters {params.parameters:q} --threads {threads} --output {output.maps:q} "
            "--timing {output.timing:q} 2> {log:q}"
        )
