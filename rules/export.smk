# The final maps of a variant, in a folder of its own, as `sepi depth` writes them.


rule export:
    input:
        light_field="results/{dataset}/{scene}/lightfield.h5",
        maps=lambda wildcards: stage_file(wildcards.dataset, wildcards.scene, wildcards.variant, "optimize"),
    output:
        disparity="results/{dataset}/{scene}/{variant}/disparity.pfm",
        result="results/{dataset}/{scene}/{variant}/result.h5",
        disparity_picture="results/{dataset}/{scene}/{variant}/disparity.png",
        confidence_picture="results/{dataset}/{scene}/{variant}/confidence.png",
    log:
        "logs/{dataset}/{scene}/{variant}/export.log",
    benchmark:
        "benchmarks/{dataset}/{scene}/{variant}/export.tsv"
    threads: 1
    resources:
        mem_mb=memory_for(bytes_per_sample=4),
    params:
        folder="results/{dataset}/{scene}/{variant}",
        code=code_digest("sepi.export"),
    message:
        "{wildcards.dataset}/{wildcards.scene}: maps of variant {wildcards.variant}"
    shell:
        "python -m sepi.export --light-field {input.light_field:q} --maps {input.maps:q} "
        "--variant {wildcards.variant:q} --output {params.folder:q} 2> {log:q}"
