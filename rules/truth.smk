# Ground truth and masks of a scene. Only scores use them, so a change makes no map anew. A scene without ground truth
# gets a file without data.
rule truth:
    input:
        files=source_files("truth"),
        light_field=own_truth_size,
    output:
        truth=SCENE.truth,
    log:
        "logs/{dataset}/{scene}/truth.log",
    benchmark:
        "benchmarks/{dataset}/{scene}/truth.tsv"
    group:
        GROUP
    resources:
        mem_mb=memory_for(bytes_per_sample=8, bytes_per_pixel=300),
        runtime=minutes_for(0.05),
    params:
        source=truth_source,
        own=own_truth,
        dates=dates_of(source_files("truth")),
        code=lambda wildcards: code_digest("sepi.truth", scene_of(wildcards).reader),
    message:
        "{wildcards.dataset}/{wildcards.scene}: ground truth"
    shell:
        command("sepi.truth {params.source:q} {params.own:q} --output {output.truth:q} 2> {log:q}")
