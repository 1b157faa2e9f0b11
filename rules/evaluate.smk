# Scores of a scene's disparity maps, after every stage of every variant (paper, section V): both protocols, all
# regions. One job for a scene: regions take longer than scores, and are found once for all maps. A scene without
# ground truth gets a score file that says so. The parts of variant best have a file of their own, as in the report.
rule evaluate:
    input:
        light_field=SCENE.light_field,
        truth=SCENE.truth,
        maps=lambda wildcards: plan_of(wildcards).scored_files(wildcards.dataset, wildcards.scene),
    output:
        scores=SCENE.scores("{which}"),
    log:
        "logs/{dataset}/{scene}/scores{which}.log",
    benchmark:
        "benchmarks/{dataset}/{scene}/scores{which}.tsv"
    group:
        GROUP
    resources:
        mem_mb=lambda wildcards, input, attempt: memory_for(4, 200 + 50 * len(input.maps))(wildcards, attempt),
        runtime=lambda wildcards, input, attempt: minutes_for(0.05, 0.15 * len(input.maps))(wildcards, attempt),
    params:
        stages=str(PLACED_SCENE.stages),
        bad=BAD_THRESHOLDS,
        code=lambda wildcards: code_digest("sepi.evaluate"),
    message:
        "{wildcards.dataset}/{wildcards.scene}: scores"
    shell:
        command(
            "sepi.evaluate --light-field {input.light_field:q} --truth {input.truth:q} --stages {params.stages:q} "
            "{params.bad:q} --output {output.scores:q} {input.maps:q} 2> {log:q}"
        )
