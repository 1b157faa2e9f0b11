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
        text=lambda wildcards: plan_of(wildcards).to_json(),
    message:
        "plan of the report"
    template_engine:
        "jinja2"


# All numbers of a report in one table with facts about the scenes beside it, and what is made of them alone: tables,
# and charts in print quality. The parts of variant best have files of their own, since `all` does not run those variants.
for plan in PLANS.values():
    scenes_of_plan = [SETTINGS.scene(*pair) for pair in plan.pairs]

    rule:
        name:
            f"numbers{plan.ending}"
        input:
            plan=f"reports/page/plan{plan.ending}.json",
            measured=lambda wildcards, plan=plan: plan.number_inputs(),
            published=sorted(PUBLISHED.glob("*.csv")),
        output:
            report(table_files(plan, ["csv"]), caption="captions/tables.rst", category="Tables"),
            table_files(plan, ["md", "tex"]),
            charts=[file for name in plan.charts for file in as_chart(name)],
            numbers=number_files(plan),
        log:
            f"logs/report{plan.ending}.log",
        benchmark:
            f"benchmarks/report{plan.ending}.tsv"
        resources:
            # light fields are read one by one
            mem_mb=600 + max((scene.samples for scene in scenes_of_plan), default=0) * 8 // 2**20,
            runtime=5 + sum(scene.minutes(0.1) for scene in scenes_of_plan) // 5,
        params:
            results=placed(RESULTS),
            tables=folder_of_output,
            charts=lambda wildcards: placed(CHARTS),
            code=code_digest("sepi.report.tables"),
        message:
            "numbers, tables and charts of the report"
        shell:
            command(
                "sepi.report.tables --results {params.results:q} --plan {input.plan:q} --output {output.numbers[0]:q} "
                "--tables {params.tables:q} --charts {params.charts:q} 2> {log:q}"
            )


# Images of a scene: reference view, ground truth, each stage and variant, errors, masks, external methods' maps, and
# all on a sheet (overview); the method at single pixels (pixels); and the scene for the page.
rule maps:
    input:
        lambda wildcards: plan_of(wildcards).map_inputs(wildcards.dataset, wildcards.scene),
    output:
        **({"page": "reports/{report}page/{dataset}/{scene}.json"} if SETTINGS.has_page else {}),
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
    resources:
        mem_mb=memory_for(bytes_per_sample=4, bytes_per_pixel=1000),
        runtime=minutes_for(0.05, 15),
    params:
        results=placed(RESULTS),
        plan=plan_of_scene,
        pixels=lambda wildcards: json.dumps(SETTINGS.report.pixels.get(f"{wildcards.dataset}/{wildcards.scene}", [])),
        page=lambda wildcards, output: ["--page", output.page] if SETTINGS.has_page else [],
        code=lambda wildcards: code_digest("sepi.report.figures", *added("scenes").values()),
    message:
        "{wildcards.dataset}/{wildcards.scene}: images"
    shell:
        command(
            "sepi.report.figures --results {params.results:q} --plan {params.plan:q} "
            "--pixels {params.pixels:q} --output {output.folder:q} {params.page:q} 2> {log:q}"
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
    resources:
        mem_mb=100,
        runtime=1,
    message:
        "{wildcards.dataset}/{wildcards.scene}: complete"
