# Path-traced scenes: one file for each, from which ingest makes a light field for each level of noise.

from sepi.extensions.rendered.catalogue import RENDERED
from sepi.extensions.rendered.dataset import render_file
from sepi.workflow.datasets import Scene
from sepi.workflow.rendered_scenes import DATASET

RENDERING = SETTINGS.apart[DATASET]


def without_renderer(wildcards):
    """No input; ends the run before any job if the renderer is missing."""
    if find_spec("mitsuba") is None and not os.path.exists(placed(render_file(wildcards.world))):
        sys.exit("sepi: rendered scenes need the package mitsuba: pip install 'sepi[render]'")
    return []


def rendered_files():
    """All files of the report on rendered scenes."""
    if not SETTINGS.scenes_apart:
        sys.exit("sepi: config.rendered.scenes: names no scene; leave the key out for all scenes")
    return report_files(DATASET)


def of_render(ask):
    """Function of wildcards: memory or time of a render of this size."""
    size = RENDERING.size
    return lambda wildcards, attempt: attempt * ask(Scene(DATASET, "", None, (), RENDERING.views**2, size, size))


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
        code=lambda wildcards: code_digest(
            "sepi.extensions.rendered.rendering", f"sepi.extensions.rendered.worlds.{wildcards.world}"
        ),
    message:
        "rendered/{wildcards.world}: rendering"
    shell:
        command(
            "sepi.extensions.rendered.command {wildcards.world:q} {params.flags} --threads {threads} "
            "--output {output:q} 2> {log:q}"
        )


# The rendered scenes in every level of noise: tables by property, page and images
rule rendered:
    input:
        lambda wildcards: rendered_files(),
    message:
        "all rendered scenes are made"
