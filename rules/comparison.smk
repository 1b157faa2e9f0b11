# The compared methods, computed on every scene beside this project's variants and the published figures: below
# reports/comparison/ the same page, tables and pictures as below reports/, of another set of variants.


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
    localrule: True
    params:
        folder=folder_of_output,
        code=code_digest("sepi.report.tables"),
    message:
        "tables of the compared methods"


use rule maps as comparison_maps with:
    input:
        lambda wildcards: COMPARISON.map_inputs(wildcards.dataset, wildcards.scene),
    output:
        **page_of_scene("reports/comparison"),
        folder=report(
            directory("reports/comparison/maps/{dataset}/{scene}"),
            patterns=["{name,overview}.png"],
            caption="captions/maps.rst",
            category="Comparison",
            subcategory="{dataset}/{scene}",
        ),
    log:
        "logs/{dataset}/{scene}/comparison_maps.log",
    benchmark:
        "benchmarks/{dataset}/{scene}/comparison_maps.tsv"
    params:
        results=results_folder,
        plan=lambda wildcards: plan_of_scene(wildcards, COMPARISON),
        pixels=pixels_of,
        page=page_flags,
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
    localrule: True
    params:
        parts=[],
        scenes=folder_of_scenes,
        code=code_digest("sepi.report.page"),
    message:
        "page of the compared methods"
