# Path-traced scenes: one file for each, from which ingest makes a light field for each level of noise.


include: "targets.smk"


rule render:
    input:
        without_renderer,
    output:
        render_file("{world}"),
    log:
        "logs/renders/{world}.log",
    benchmark:
        "benchmarks/renders/{world}.tsv"
    wildcard_constraints:
        world="|".join(RENDERED),
    threads: 8
    resources:
        mem_mb=of_render(lambda scene: scene.memory_mb(bytes_per_sample=80, bytes_per_pixel=1000)),
        runtime=of_render(lambda scene: scene.minutes(2 * RENDERING.samples)),
    params:
        flags=f"--set size={RENDERING.size} --set 'grid=[{RENDERING.views},{RENDERING.views}]' "
        f"--set samples={RENDERING.samples}",
        code=lambda wildcards: code_digest(
            "sepi.extensions.rendered.rendering", f"sepi.extensions.rendered.worlds.{wildcards.world}"
        ),
    message:
        "rendered/{wildcards.world}: rendering"
    shell:
        command(
            "sepi.extensions.rendered.commands {wildcards.world:q} {params.flags} --threads {threads} "
            "--output {output:q} 2> {log:q}"
        )


# The rendered scenes in every level of noise: tables by property, page and images
rule rendered:
    input:
        lambda wildcards: report_files(DATASET),
    message:
        "all rendered scenes are made"
