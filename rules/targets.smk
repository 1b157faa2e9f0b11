# What the pages, the tables and the pictures consist of, and what they are made of.

from importlib.util import find_spec

from sepi.report.plan import COMPARISON, PARTS_TABLES, TEMPLATES
from sepi.report.published import FOLDER as PUBLISHED
from sepi.workflow.datasets import Scene
from sepi.workflow.rendered_scenes import DATASET
from sepi.workflow.result_paths import render_file

RENDERING = SETTINGS.rendered

PARTS = "reports/report_parts.json" if SETTINGS.report.parts_of_best else []
# what ends the name of a file of numbers, to the folder and the tables that are made of it
TABLES = {plan.ending(): (f"reports/{name}".rstrip("/"), plan.tables()) for name, plan in REPORTS.items()}
TABLES[PARTS_ENDING] = ("reports", PARTS_TABLES)


def table_files(which):
    """The tables of one of the files of numbers, each as CSV, Markdown and LaTeX."""
    folder, tables = TABLES[which]
    return [f"{folder}/{table}.{ending}" for table in tables for ending in ("csv", "md", "tex")]


def figure_files(names):
    """Each of the charts as PNG and PDF."""
    return [f"reports/figures/{name}.{ending}" for name in names for ending in ("png", "pdf")]


def report_files(name=""):
    """What lies in the folder of a report: page if there is one, numbers, tables, and pictures of every scene."""
    plan = REPORTS[name]
    folder, _ = TABLES[plan.ending()]
    page = [f"{folder}/index.html"] if SETTINGS.has_page else []
    pictures = [f"{folder}/maps/{dataset}/{scene}" for dataset, scene in plan.pictured]
    return [*page, f"reports/report{plan.ending()}.json", *table_files(plan.ending()), *pictures]


def all_files():
    """The main report, its charts, and the parts of ``best`` if they are asked for."""
    charts = figure_files(["ablation", "time_and_memory", "error_bars"])
    return list(dict.fromkeys([*report_files(), *charts, *(ablation_files() if PARTS else [])]))


def ablation_files():
    """The paper's table 4, and the ablation of ``best``."""
    paper = [file for file in table_files("") if Path(file).stem == "table4_ablation"]
    return [*paper, *table_files(PARTS_ENDING), *figure_files(["ablation", "ablation_best"])]


def every_file():
    """All of every report."""
    return [*all_files(), *ablation_files(), *(file for name in REPORTS if name for file in report_files(name))]


def measured_files(which):
    """What one of the files of numbers is collected from."""
    plan, parts = plan_of(which)
    return plan.number_inputs(parts)


def scenes_of(which):
    """The scenes of one of the files of numbers."""
    return [SETTINGS.scene(*pair) for pair in plan_of(which)[0].pairs]


def page_of_scene():
    """What the page needs of a scene, as an output of the rule that draws its pictures; nothing without a page."""
    return {"page": "reports/{report}page/{dataset}/{scene}.json"} if SETTINGS.has_page else {}


def page_flags(wildcards, output):
    """The page's part of a scene, as words for the command that draws its pictures."""
    return ["--page", output.page] if SETTINGS.has_page else []


def pages_of_scenes(wildcards):
    """What a page is made of, by scene."""
    return [
        f"reports/{wildcards.report}page/{dataset}/{scene}.json" for dataset, scene in report_of(wildcards).pictured
    ]


def plan_of_scene(wildcards):
    """A plan for one scene alone, so that another scene in the configuration does not redraw it."""
    return replace(report_of(wildcards), scenes={wildcards.dataset: [wildcards.scene]}).to_json()


def pixels_of(wildcards):
    """The pixels of a scene that the configuration asks for, as JSON."""
    return json.dumps(SETTINGS.report.pixels.get(f"{wildcards.dataset}/{wildcards.scene}", []))


def external_inputs(wildcards):
    """The maps that are there: one that appears later is a new input, and the scene's maps are read again."""
    files = SETTINGS.external_files(wildcards.dataset, wildcards.scene)
    return [own_file(file) for file in files.values() if os.path.isfile(file) and os.access(file, os.R_OK)]


def folder_of_output(wildcards, output):
    """The folder that a job's files go into."""
    return os.path.dirname(output[0])


def folder_of_scenes(wildcards, output):
    """The folder beside a page that has a file for each of its scenes."""
    return os.path.join(os.path.dirname(output[0]), "page")


def results_folder(wildcards):
    """The folder that commands look for results in."""
    return placed(RESULTS)


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
