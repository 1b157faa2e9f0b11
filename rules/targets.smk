# Files of pages, tables and images, and the inputs that they are made from.

from sepi.report.plan import COMPARISON, PUBLISHED

PARTS_OF_BEST = multiext("reports/report_parts", ".json", ".csv") if SETTINGS.report.parts_of_best else []
# folder of the charts
CHARTS = "reports/figures"
# ending of a file of numbers to the folder of its tables, and its plan
NUMBERS = {plan.ending: (f"reports/{'' if name == PARTS else name}".rstrip("/"), plan) for name, plan in PLANS.items()}


def table_files(which, endings=("csv", "md", "tex")):
    """Tables of a file of numbers, each as CSV, Markdown and LaTeX."""
    folder, plan = NUMBERS[which]
    return [f"{folder}/{table}.{ending}" for table in plan.tables for ending in endings]


def figure_files(names):
    """Charts, each as PNG and PDF."""
    return [file for name in names for file in multiext(f"{CHARTS}/{name}", ".png", ".pdf")]


def as_chart(name):
    """Files of a chart for a rule's output, with their text in Snakemake's own report."""
    caption = f"captions/{name.removesuffix('_best')}.rst"
    return report(multiext(f"{CHARTS}/{name}", ".png", ".pdf"), caption=caption, category="Charts")


def flags_of_charts(wildcards, output):
    """Folder of the charts of a report that has some, as flags of the command that draws them."""
    return ["--charts", os.path.dirname(output.charts[0])] if output.charts else []


def report_files(name=""):
    """Files of a report: page if there is one, numbers, tables, and images of every scene."""
    plan = REPORTS[name]
    folder, _ = NUMBERS[plan.ending]
    page = [f"{folder}/index.html"] if SETTINGS.has_page else []
    pictures = [f"{folder}/maps/{dataset}/{scene}" for dataset, scene in plan.pictured]
    return [*page, *multiext(f"reports/report{plan.ending}", ".json", ".csv"), *table_files(plan.ending), *pictures]


def all_files():
    """Files of the main report, its charts, and the parts of ``best`` if the configuration asks for them."""
    charts = figure_files(REPORTS[""].charts)
    return list(dict.fromkeys([*report_files(), *charts, *(ablation_files() if PARTS_OF_BEST else [])]))


def ablation_files():
    """Files of the paper's table 4, and of the ablation of ``best``."""
    paper = [file for file in table_files("") if Path(file).stem == "table4_ablation"]
    return [*paper, *table_files(f"_{PARTS}"), *figure_files(["ablation", *PLANS[PARTS].charts])]


def every_file():
    """All files of all reports."""
    return [*all_files(), *ablation_files(), *(file for name in REPORTS if name for file in report_files(name))]


def measured_files(which):
    """Function of wildcards: inputs of a file of numbers."""
    return lambda wildcards: plan_of(which).number_inputs()


def scenes_of(which):
    """Scenes of a file of numbers."""
    return [SETTINGS.scene(*pair) for pair in plan_of(which).pairs]


def page_of_scene():
    """The page's file for a scene, as an output of the rule that draws its images; empty without a page."""
    return {"page": "reports/{report}page/{dataset}/{scene}.json"} if SETTINGS.has_page else {}


def page_flags(wildcards, output):
    """The page's file for a scene, as flags of the command that draws its images."""
    return ["--page", output.page] if SETTINGS.has_page else []


def pages_of_scenes(wildcards):
    """Inputs of a page: a file for each scene."""
    return [
        f"reports/{wildcards.report}page/{dataset}/{scene}.json" for dataset, scene in report_of(wildcards).pictured
    ]


def plan_of_scene(wildcards):
    """Plan for one scene, so that a change of other scenes in the configuration does not redraw it."""
    return replace(report_of(wildcards), scenes={wildcards.dataset: [wildcards.scene]}).to_json()


def pixels_of(wildcards):
    """Pixels of a scene that the configuration asks for, as JSON."""
    return json.dumps(SETTINGS.report.pixels.get(f"{wildcards.dataset}/{wildcards.scene}", []))


def external_inputs(wildcards):
    """External maps that exist; a map that appears later is a new input, so the scene's maps are read again."""
    files = SETTINGS.external_files(wildcards.dataset, wildcards.scene)
    return [own_file(file) for file in files.values() if os.path.isfile(file) and os.access(file, os.R_OK)]


def folder_of_output(wildcards, output):
    """Folder of a job's outputs."""
    return os.path.dirname(output[0])


def folder_of_scenes(wildcards, output):
    """Folder beside a page with a file for each scene."""
    return os.path.join(os.path.dirname(output[0]), "page")
