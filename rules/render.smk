# Path-traced scenes (sepi.rendered): one file for each, of which ingest makes a light field for each level of noise.

from importlib.util import find_spec

from sepi.workflow.datasets import Scene
from sepi.workflow.rendered_scenes import DATASET
from sepi.workflow.result_paths import render_file

RENDERING = SETTINGS.rendered


def without_renderer(wildcards):
    """No input; where the renderer is missing, that is told before any job, rather than after hours of others."""
    if find_spec("mitsuba") is None and not os.path.exists(placed(render_file(wildcards.world))):
        sys.exit("sepi: rendered scenes need the package mitsuba: pip install 'sepi[render]'")
    return []


def rendered_files():
    """All that is made of the rendered scenes."""
    if not SETTINGS.rendered_scenes:
        sys.exit("sepi: config.rendered.scenes names none; leave the key out for all")
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
        mem_mb=of_render(lambda scene: scene.memory_mb(bytes_per_sample=20, bytes_per_pixel=2000)),
        runtime=of_render(lambda scene: scene.minutes(0.6 * RENDERING.samples)),
    params:
        flags=f"--size {RENDERING.size} --views {RENDERING.views} --samples {RENDERING.samples}",
        code=lambda wildcards: code_digest(*render_modules(wildcards.world)),
    message:
        "rendered/{wildcards.world}: rendering"
    shell:
        command(
            "sepi.rendered.command {wildcards.world:q} {params.flags} --threads {threads} --output {output:q} 2> {log:q}"
        )
