# Reports, below reports/: a page of everything, numbers, tables, charts, and images of every scene.


# Scenes and variants of the numbers. For thousands of scenes they are too long for a command line, and so for a rule
# with a shell command
rule plan:
    input:
        source_file("rules/plan.json.j2"),
    output:
        "reports/page/plan{which}.json",
    log:
        "logs/plan{which}.log",
    localrule: True
    params:
        # functions, so that braces in names are not wildcards
        text=lambda wildcards: plan_of(wildcards.which).to_json(),
    message:
        "plan of the report"
    template_engine:
        "jinja2"


# All numbers of the report in one table, and facts about the scenes beside it. The parts of variant best have files of
# their own (report_parts), since `all` does not run those variants.
rule numbers:
    input:
        plan="reports/page/plan{which}.json",
        measured=lambda wildcards: measured_files(wildcards.which),
    output:
        numbers=multiext("reports/report{which}", ".json", ".csv"),
    log:
        "logs/report{which}.log",
    benchmark:
        "benchmarks/report{which}.tsv"
    threads: 1
    resources:
        # light fields are read one by one
        mem_mb=lambda wildcards: 500 + max(scene.samples for scene in scenes_of(wildcards.which)) * 8 // 2**20,
        runtime=lambda wildcards: 5 + sum(scene.minutes(0.1) for scene in scenes_of(wildcards.which)) // 5,
    params:
        results=results_folder,
        code=code_digest("sepi.report.numbers"),
    message:
        "numbers of the report"
    shell:
        command(
            "sepi.report.numbers --results {params.results:q} --plan {input.plan:q} "
            "--output {output.numbers[0]:q} 2> {log:q}"
        )


# Tables of each report, and of the parts of variant best, which have their own file of numbers
for which in TABLES:

    rule:
        name:
            f"tables{which}"
        input:
            numbers=multiext(f"reports/report{which}", ".json", ".csv"),
            published=sorted(PUBLISHED.glob("*.csv")),
        output:
            report(
                [file for file in table_files(which) if file.endswith(".csv")],
                caption="captions/tables.rst",
                category="Tables",
            ),
            [file for file in table_files(which) if not file.endswith(".csv")],
        log:
            f"logs/tables{which}.log",
        benchmark:
            f"benchmarks/tables{which}.tsv"
        localrule: True
        threads: 1
        params:
            folder=folder_of_output,
            code=code_digest("sepi.report.tables"),
        message:
            "tables"
        shell:
            command("sepi.report.tables --numbers {input.numbers[0]:q} --output {params.folder:q} 2> {log:q}")


# Charts of the numbers, in print quality
rule charts:
    input:
        numbers=multiext("reports/report", ".json", ".csv"),
        published=sorted(PUBLISHED.glob("*.csv")),
    output:
        report(multiext("reports/figures/ablation", ".png", ".pdf"), caption="captions/ablation.rst", category="Charts"),
        report(
            multiext("reports/figures/time_and_memory", ".png", ".pdf"), caption="captions/time.rst", category="Charts"
        ),
        report(
            multiext("reports/figures/error_bars", ".png", ".pdf"),
            caption="captions/error_bars.rst",
            category="Charts",
        ),
    log:
        "logs/charts.log",
    benchmark:
        "benchmarks/charts.tsv"
    localrule: True
    threads: 1
    params:
        folder=folder_of_output,
        code=code_digest("sepi.report.charts"),
    message:
        "charts"
    shell:
        command(
            "sepi.report.charts --numbers {input.numbers[0]:q} --chart ablation --chart time_and_memory --chart error_bars "
            "--output {params.folder:q} 2> {log:q}"
        )


# Chart of the parts of variant best
rule parts_chart:
    input:
        numbers=multiext("reports/report_parts", ".json", ".csv"),
    output:
        report(
            multiext("reports/figures/ablation_best", ".png", ".pdf"),
            caption="captions/ablation.rst",
            category="Charts",
        ),
    log:
        "logs/parts_chart.log",
    benchmark:
        "benchmarks/parts_chart.tsv"
    localrule: True
    threads: 1
    params:
        folder=folder_of_output,
        code=code_digest("sepi.report.charts"),
    message:
        "chart of the parts of best"
    shell:
        command(
            "sepi.report.charts --numbers {input.numbers[0]:q} --chart ablation_best --output {params.folder:q} 2> {log:q}"
        )


# Images of a scene: reference view, ground truth, each stage and variant, errors, masks, external methods' maps, and
# all on a sheet (overview); the method at single pixels (pixels); and the scene for the page.
rule maps:
    input:
        lambda wildcards: report_of(wildcards).map_inputs(wildcards.dataset, wildcards.scene),
    output:
        **page_of_scene(),
        folder=report(
            directory("reports/{report}maps/{dataset}/{scene}"),
            patterns=["{name,overview}.png"],
            caption="captions/maps.rst",
            category="Scenes",
            subcategory="{report}{dataset}/{scene}",
        ),
    log:
        "logs/{dataset}/{scene}/{report}maps.log",
    benchmark:
        "benchmarks/{dataset}/{scene}/{report}maps.tsv"
    group:
        GROUP
    threads: 1
    resources:
        mem_mb=memory_for(bytes_per_sample=4, bytes_per_pixel=1000),
        runtime=minutes_for(0.05, 15),
    params:
        results=results_folder,
        plan=plan_of_scene,
        pixels=pixels_of,
        page=page_flags,
        code=lambda wildcards: code_digest("sepi.report.figures", *added("scenes").values()),
    message:
        "{wildcards.dataset}/{wildcards.scene}: images"
    shell:
        command(
            "sepi.report.figures --results {params.results:q} --plan {params.plan:q} "
            "--dataset {wildcards.dataset:q} --scene {wildcards.scene:q} --pixels {params.pixels:q} "
            "--output {output.folder:q} {params.page:q} 2> {log:q}"
        )


# All outputs of a single scene, with an empty file as the target
rule scene:
    input:
        pictures="reports/maps/{dataset}/{scene}",
        maps=lambda wildcards: result_files(LISTED_MAPS, [(wildcards.dataset, wildcards.scene)]),
    output:
        touch(SCENE_COMPLETE),
    group:
        GROUP
    threads: 1
    resources:
        mem_mb=100,
        runtime=1,
    message:
        "{wildcards.dataset}/{wildcards.scene}: complete"
