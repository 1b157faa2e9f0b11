# The final maps of a variant in a folder, as `sepi depth` writes them. Masks, and depth in metres if the camera is
# known, lie beside the files that are named here.


rule export:
    input:
        light_field=SCENE.light_field,
        maps=final_file,
    output:
        [SCENE.variant("{variant}") / name for name in RESULT_FILES],
    log:
        "logs/{dataset}/{scene}/{variant}/export.log",
    benchmark:
        "benchmarks/{dataset}/{scene}/{variant}/export.tsv"
    group:
        GROUP
    resources:
        mem_mb=memory_for(bytes_per_sample=4, bytes_per_pixel=300),
        runtime=minutes_for(0.05),
    params:
        folder=folder_of_output,
        code=code_digest("sepi.export"),
    message:
        "{wildcards.dataset}/{wildcards.scene}: maps of variant {wildcards.variant}"
    shell:
        command(
            "sepi.export --light-field {input.light_field:q} --maps {input.maps:q} "
            "--variant {wildcards.variant:q} --output {params.folder:q} 2> {log:q}"
        )
