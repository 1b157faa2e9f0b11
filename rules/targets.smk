# What the page, the tables and the pictures consist of, and what they are made of.

from dataclasses import replace

from sepi.report.plan import COMPARISON_TABLES, PARTS_TABLES, TABLES, TEMPLATES
from sepi.report.published import FOLDER as PUBLISHED

MAIN_TABLES = [table for table in TABLES if table not in PARTS_TABLES]
PARTS = "reports/report_parts.json" if SETTINGS.report.parts_of_best else []
COMPARISON_REPORT = "reports/comparison"


def table_files(tables):
    """Each of the tables as CSV, Markdown and LaTeX."""
    return [f"reports/{table}.{ending}" for table in tables for ending in ("csv", "md", "tex")]


def figure_files(names):
    """Each of the charts as PNG and PDF."""
    return [f"reports/figures/{name}.{ending}" for name in names for ending in ("png", "pdf")]


def pages(folder):
    """The page below a folder of the report, if there is to be one."""
    return [f"{folder}/index.html"] if SETTINGS.has_page else []


def page_of_scene(folder):
    """What the page needs of a scene, as an output of the rule that draws its pictures; nothing without a page."""
    return {"page": f"{folder}/page/{{dataset}}/{{scene}}.json"} if SETTINGS.has_page else {}


def page_flags(wildcards, output):
    """The page's part of a scene, as words for the command that draws its pictures."""
    return ["--page", output.page] if SETTINGS.has_page else []


def report_files():
    """Page if there is one, numbers, all tables and charts but those of the parts of ``best``, pictures of every scene."""
    pictures = [f"reports/maps/{dataset}/{scene}" for dataset, scene in SETTINGS.scenes]
    charts = figure_files(["ablation", "time_and_memory"])
    parts = ablation_files() if PARTS else []
    tables = table_files(MAIN_TABLES)
    return list(dict.fromkeys([*pages("reports"), "reports/report.json", *tables, *charts, *parts, *pictures]))


def ablation_files():
    """The paper's table 4, and the ablation of ``best``."""
    return [*table_files(["table4_ablation", *PARTS_TABLES]), *figure_files(["ablation", "ablation_best"])]


def measured_files(which):
    """What one of the files of numbers is collected from."""
    plan, parts = plan_of(which)
    return plan.number_inputs(parts)


def plan_of_scene(wildcards, plan=PLAN):
    """A plan for one scene alone, so that another scene in the configuration does not redraw it."""
    return replace(plan, scenes={wildcards.dataset: [wildcards.scene]}).to_json()


def pixels_of(wildcards):
    """The pixels of a scene that the configuration asks for, as JSON."""
    return json.dumps(SETTINGS.report.pixels.get(f"{wildcards.dataset}/{wildcards.scene}", []))


def comparison_files():
    """The page of the comparison, its numbers and tables, and pictures of every scene."""
    tables = [f"{COMPARISON_REPORT}/{table}.{ending}" for table in COMPARISON_TABLES for ending in ("csv", "md", "tex")]
    pictures = [f"{COMPARISON_REPORT}/maps/{dataset}/{scene}" for dataset, scene in SETTINGS.scenes]
    return [*pages(COMPARISON_REPORT), f"reports/report{COMPARISON_ENDING}.json", *tables, *pictures]


def external_inputs(wildcards):
    """The maps that are there: one that appears later is a new input, and the scene's maps are read again."""
    files = SETTINGS.external_files(wildcards.dataset, wildcards.scene)
    return [own_file(file) for file in files.values() if os.path.isfile(file) and os.access(file, os.R_OK)]


def names_like(target):
    """Names of rules, and of files that are made, of which one may be meant by a target that nothing makes."""
    rules = [rule.name for rule in workflow.rules]
    scene = tuple(Path(target).parts[1:3])
    if scene in SETTINGS.scenes:
        known = PLAN.files(*scene)
        return [*rules, *result_files(SETTINGS.variants, [scene]), *map(str, (known.light_field, known.scores()))]
    return [*rules, *report_files(), *ablation_files(), *comparison_files()]


def folder_of_output(wildcards, output):
    """The folder that a job's files go into."""
    return os.path.dirname(output[0])


def folder_of_scenes(wildcards, output):
    """The folder beside a page that has a file for each of its scenes."""
    return os.path.join(os.path.dirname(output[0]), "page")


def results_folder(wildcards):
    """The folder that commands look for results in."""
    return placed(RESULTS)
