# Files of pages, tables and images, and the inputs that they are made from.

from sepi.report.plan import COMPARISON, PUBLISHED

PARTS_OF_BEST = multiext("reports/report_parts", ".json", ".csv") if SETTINGS.report.parts_of_best else []
# folder of the charts
CHARTS = "reports/figures"


def folder_of(plan):
    """Folder of a report's page and tables."""
    return f"reports/{'' if plan.report == PARTS else plan.report}".rstrip("/")


def table_files(plan, endings=("csv", "md", "tex")):
    """Tables of a report, each as CSV, Markdown and LaTeX."""
    return [f"{folder_of(plan)}/{table}.{ending}" for table in plan.tables for ending in endings]


def number_files(plan):
    """Files of a report's numbers."""
    return multiext(f"reports/report{plan.ending}", ".json", ".csv")


def figure_files(names):
    """Charts, each as PNG and PDF."""
    return [file for name in names for file in multiext(f"{CHARTS}/{name}", ".png", ".pdf")]


def as_chart(name):
    """Files of a chart for a rule's output, with their text in Snakemake's own report."""
    caption = f"captions/{name.removesuffix('_best')}.rst"
    return report(multiext(f"{CHARTS}/{name}", ".png", ".pdf"), caption=caption, category="Charts")


def report_files(name=""):
    """Files of a report: page if there is one, numbers, tables, and images of every scene."""
    plan = REPORTS[name]
    folder = folder_of(plan)
    page = [f"{folder}/index.html"] if SETTINGS.has_page else []
    pictures = [f"{folder}/maps/{dataset}/{scene}" for dataset, scene in plan.pictured]
    return [*page, *number_files(plan), *table_files(plan), *pictures]


def all_files():
    """Files of the main report, its charts, and the parts of ``best`` if the configuration asks for them."""
    charts = figure_files(REPORTS[""].charts)
    return list(dict.fromkeys([*report_files(), *charts, *(ablation_files() if PARTS_OF_BEST else [])]))


def ablation_files():
    """Files of the paper's table 4, and of the ablation of ``best``."""
    paper = [file for file in table_files(PLANS[""]) if Path(file).stem == "table4_ablation"]
    return [*paper, *table_files(PLANS[PARTS]), *figure_files(["ablation", *PLANS[PARTS].charts])]


def every_file():
    """All files of all reports."""
    return [*all_files(), *ablation_files(), *(file for name in REPORTS if name for file in report_files(name))]


def pages_of_scenes(wildcards):
    """Inputs of a page: a file for each scene."""
    return [f"reports/{wildcards.report}page/{dataset}/{scene}.json" for dataset, scene in plan_of(wildcards).pictured]


def plan_of_scene(wildcards):
    """Plan for one scene, so that a change of other scenes in the configuration does not redraw it."""
    return replace(plan_of(wildcards), scenes={wildcards.dataset: [wildcards.scene]}).to_json()


def external_inputs(wildcards):
    """External maps that exist; a map that appears later is a new input, so the scene's maps are read again."""
    files = SETTINGS.external_files(wildcards.dataset, wildcards.scene)
    return [own_file(file) for file in files.values() if os.path.isfile(file) and os.access(file, os.R_OK)]


def folder_of_output(wildcards, output):
    """Folder of a job's outputs."""
    return os.path.dirname(output[0])
