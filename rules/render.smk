# Path-traced scenes (sepi.rendered): one file for each, from which ingest makes a light field for each level of noise.


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
        flags=f"--size {RENDERING.size} --views {RENDERING.views} --samples {RENDERING.samples}",
        code=lambda wildcards: code_digest(*render_modules(wildcards.world)),
    message:
        "rendered/{wildcards.world}: rendering"
    shell:
        command(
            "sepi.rendered.command {wildcards.world:q} {params.flags} --threads {threads} --output {output:q} 2> {log:q}"
        )
