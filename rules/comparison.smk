# The compared methods, computed on every scene beside this project's variants and the published figures: below
# reports/comparison/ the same page, tables and pictures as below reports/, of another set of variants.

from sepi.report.plan import COMPARISON_TABLES

COMPARISON_REPORT = "reports/comparison"


def comparison_files():
    """The page of the comparison, its numbers and tables, and pictures of every scene."""
    tables = [f"{COMPARISON_REPORT}/{table}.{ending}" for table in COMPARISON_TABLES for ending in ("csv", "md", "tex")]
    pictures = [f"{COMPARISON_REPORT}/maps/{dataset}/{scene}" for dataset, scene in SETTINGS.scenes]
    return [f"{COMPARISON_REPORT}/index.html", f"reports/report{COMPARISON_ENDING}.json", *tables, *pictures]


use rule tables as comparison_tables with:
    input:
        f"reports/report{COMPARISON_ENDING}.json",
    output:
        report(
            expand("reports/comparison/{table}.csv", table=COMPARISON_TABLES),
            caption="captions/tables.rst",
            category="Comparison",
        ),
        expand("reports/comparison/{table}.{ending}", table=COMPARISON_TABLES, ending=["md", "tex"]),
    log:
        "logs/comparison_tables.log",
    benchmark:
        "benchmarks/comparison_tables.tsv"
    params:
        folder=COMPARISON_REPORT,
        code=code_digest("sepi.report.tables"),
    message:
        "tables of the compared methods"


use rule maps as comparison_maps with:
    input:
        lambda wildcards: COMPARISON.map_inputs(wildcards.dataset, wildcards.scene),
    output:
        folder=report(
            directory("reports/comparison/maps/{dataset}/{scene}"),
            patterns=["{name,overview}.png"],
            caption="captions/maps.rst",
            category="Comparison",
            subcategory="{dataset}/{scene}",
        ),
        page="reports/comparison/page/{dataset}/{scene}.json",
    log:
        "logs/{dataset}/{scene}/comparison_maps.log",
    benchmark:
        "benchmarks/{dataset}/{scene}/comparison_maps.tsv"
    params:
        plan=lambda wildcards: plan_of_scene(wildcards, COMPARISON),
        pixels=pixels_of,
        code=lambda wildcards: code_digest("sepi.report.figures"),
    message:
        "{wildcards.dataset}/{wildcards.scene}: pictures of the compared methods"


use rule page as comparison_page with:
    input:
        numbers=f"reports/report{COMPARISON_ENDING}.json",
        graph="reports/page/rules.svg",
        scenes=[f"reports/comparison/page/{dataset}/{scene}.json" for dataset, scene in SETTINGS.scenes],
        templates=TEMPLATES,
    output:
        report("reports/comparison/index.html", caption="captions/page.rst", category="Comparison"),
    log:
        "logs/comparison_page.log",
    benchmark:
        "benchmarks/comparison_page.tsv"
    params:
        parts="",
        code=code_digest("sepi.report.page"),
    message:
        "page of the compared methods"
