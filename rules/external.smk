# Disparity maps of a scene by external methods (config key `external`), scored like ours. A missing or wrong file
# does not stop the run: its problem is in the output and in the log.


rule external:
    input:
        light_field=SCENE.light_field,
        truth=SCENE.truth,
        maps=external_inputs,
    output:
        maps=SCENE.external,
    log:
        "logs/{dataset}/{scene}/external.log",
    benchmark:
        "benchmarks/{dataset}/{scene}/external.tsv"
    group:
        GROUP
    resources:
        mem_mb=memory_for(bytes_per_sample=4, bytes_per_pixel=200 + 10 * len(SETTINGS.external)),
        runtime=minutes_for(0.05),
    params:
        maps=lambda wildcards: SETTINGS.external_json(wildcards.dataset, wildcards.scene),
        scene="{dataset}/{scene}",
        bad=BAD_THRESHOLDS,
        dates=dates_of(external_inputs),
        code=code_digest("sepi.external"),
    message:
        "{wildcards.dataset}/{wildcards.scene}: maps of external methods"
    shell:
        command(
            "sepi.external --light-field {input.light_field:q} --truth {input.truth:q} --maps {params.maps:q} "
            "--scene {params.scene:q} {params.bad:q} --output {output.maps:q} 2> {log:q}"
        )
