# Scores of the disparity after any stage of any variant (paper, section V): both protocols, all regions.
# A scene without ground truth gets a score file that says so.
rule evaluate:
    input:
        light_field="results/{dataset}/{scene}/lightfield.h5",
        maps="results/{dataset}/{scene}/stages/{path}/{stage}.h5",
    output:
        scores="results/{dataset}/{scene}/stages/{path}/{stage}.scores.h5",
    log:
        "logs/{dataset}/{scene}/{path}/{stage}.scores.log",
    benchmark:
        "benchmarks/{dataset}/{scene}/{path}/{stage}.scores.tsv"
    wildcard_constraints:
        stage="|".join(STAGES),
    threads: 1
    resources:
        mem_mb=memory_for(bytes_per_sample=4, bytes_per_pixel=200),
    params:
        code=lambda wildcards: code_digest("sepi.evaluate"),
    message:
        "{wildcards.dataset}/{wildcards.scene}: scores after {wildcards.stage} ({wildcards.path})"
    shell:
        "python -m sepi.evaluate --light-field {input.light_field:q} --stage {input.maps:q} --output {output.scores:q} "
        "2> {log:q}"
