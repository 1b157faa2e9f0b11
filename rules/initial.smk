# Initial depth (paper, section IV-A, Eq. 1-5): the plane sweep over SEPIs, or a structure tensor.
rule initial:
    input:
        light_field="results/{dataset}/{scene}/lightfield.h5",
    output:
        maps="results/{dataset}/{scene}/stages/{initial}/initial.h5",
        timing="results/{dataset}/{scene}/stages/{initial}/initial.time.json",
    log:
        "logs/{dataset}/{scene}/{initial}/initial.log",
    benchmark:
        "benchmarks/{dataset}/{scene}/{initial}/initial.tsv"
    threads: threads_for
    resources:
        mem_mb=memory_for(bytes_per_sample=13, bytes_per_pixel=1300),
    params:
        parameters=parameters_of("initial"),
        code=code_digest(*stage_modules("initial")),
    message:
        "{wildcards.dataset}/{wildcards.scene}: initial depth ({wildcards.initial})"
    shell:
        "python -m sepi.initial --light-field {input.light_field:q} "
        "--choice {wildcards.initial} --parameters {params.parameters:q} --threads {threads} "
        "--output {output.maps:q} --timing {output.timing:q} 2> {log:q}"
