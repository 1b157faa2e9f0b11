# What a reader looks at, below reports/: tables beside the published figures, and pictures of every scene.

from sepi.report.plan import TABLES, Plan
from sepi.report.published import FOLDER as PUBLISHED

VARIANT_CHOICES = {name: variant.choices for name, variant in SETTINGS.variants.items()}
PLAN = Plan(Path("results"), {name: SETTINGS.scenes_of(name) for name in SETTINGS.datasets}, VARIANT_CHOICES)


def report_files():
    """Every table but the ablation of ``best``, and the folder of pictures of every configured scene."""
    tables = [f"reports/{table}.{ending}" for table in TABLES if table != "ablation_best" for ending in ("csv", "md")]
    return tables + [f"reports/maps/{dataset}/{scene}" for dataset, scene in SETTINGS.scenes]


def ablation_files():
    """The paper's table 4, and the ablation of ``best``."""
    return [f"reports/{table}.{ending}" for table in ("table4_ablation", "ablation_best") for ending in ("csv", "md")]


def plan_of_scene(wildcards):
    """The plan for one scene alone, so that another scene in the configuration does not redraw it."""
    return Plan(PLAN.results, {wildcards.dataset: [wildcards.scene]}, VARIANT_CHOICES).to_json()


# One of the tables 1 to 4, the ablation of best, its confidence, the scores after each stage, or the run times; each
# from the files it needs and no others.
rule table:
    input:
        measured=lambda wildcards: PLAN.table_inputs(wildcards.table),
        published=sorted(PUBLISHED.glob("*.csv")),
    output:
        data="reports/{table}.csv",
        page="reports/{table}.md",
    log:
        "logs/{table}.log",
    benchmark:
        "benchmarks/{table}.tsv"
    wildcard_constraints:
        table="|".join(TABLES),
    threads: 1
    resources:
        mem_mb=500,
    params:
        plan=PLAN.to_json(),
        code=lambda wildcards: code_digest("sepi.report.tables"),
    message:
        "table {wildcards.table}"
    shell:
        "python -m sepi.report.tables --results results --plan {params.plan:q} --table {wildcards.table} "
        "--output reports 2> {log:q}"


# Pictures of a scene: centre view, ground truth, each stage and variant, errors, masks, and all on overview.png.
rule maps:
    input:
        lambda wildcards: PLAN.map_inputs(wildcards.dataset, wildcards.scene),
    output:
        folder=directory("reports/maps/{dataset}/{scene}"),
    log:
        "logs/{dataset}/{scene}/maps.log",
    benchmark:
        "benchmarks/{dataset}/{scene}/maps.tsv"
    threads: 1
    resources:
        mem_mb=memory_for(bytes_per_sample=4, bytes_per_pixel=1000),
    params:
        plan=plan_of_scene,
        code=lambda wildcards: code_digest("sepi.report.figures"),
    message:
        "{wildcards.dataset}/{wildcards.scene}: pictures"
    shell:
        "python -m sepi.report.figures --results results --plan {params.plan:q} "
        "--dataset {wildcards.dataset:q} --scene {wildcards.scene:q} --output {output.folder:q} 2> {log:q}"
