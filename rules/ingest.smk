# Light fields: any format in, one HDF5 file out (views, disparity range and its source).
# The inputs are the files of the views: a changed or new file is read again.
rule ingest:
    input:
        files=source_files("files"),
    output:
        light_field=SCENE.light_field,
    log:
        "logs/{dataset}/{scene}/ingest.log",
    benchmark:
        "benchmarks/{dataset}/{scene}/ingest.tsv"
    group:
        GROUP
    threads: threads_for
    resources:
        mem_mb=of_source(memory_for(bytes_per_sample=12, copies=3), memory_for(bytes_per_sample=24)),
        runtime=of_source(minutes_for(0.2), minutes_for(1)),
    params:
        source=ingest_source,
        disparity_range=ingest_range,
        dates=dates_of(source_files("files")),
        code=lambda wildcards: code_digest("sepi.ingest", scene_of(wildcards).reader),
    message:
        "{wildcards.dataset}/{wildcards.scene}: reading the light field"
    shell:
        command(
            "sepi.ingest {params.source:q} {params.disparity_range:q} --threads {threads} "
            "--output {output.light_field:q} 2> {log:q}"
        )
