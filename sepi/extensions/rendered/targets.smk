# Files of the rendered scenes, and what a render needs.

from sepi.extensions.rendered.worlds import RENDERED
from sepi.extensions.rendered.dataset import render_file
from sepi.workflow.datasets import Scene
from sepi.workflow.rendered_scenes import DATASET

RENDERING = SETTINGS.apart[DATASET]


def without_renderer(wildcards):
    """No input; ends the run before any job if the renderer is missing."""
    if find_spec("mitsuba") is None and not os.path.exists(placed(render_file(wildcards.world))):
        sys.exit("sepi: rendered scenes need the package mitsuba: pip install 'sepi[render]'")
    return []


def of_render(ask):
    """Function of wildcards: memory or time of a render of this size."""
    size = RENDERING.size
    return lambda wildcards, attempt: attempt * ask(Scene(DATASET, "", None, (), RENDERING.views**2, size, size))
