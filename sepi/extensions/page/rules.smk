# What makes up the page
TEMPLATES = sorted(Path(find_spec("sepi.extensions.page").origin).with_name("templates").iterdir())


# Page of a report: all numbers, tables and scenes in one file
rule page:
    input:
        numbers=lambda wildcards: number_files(plan_of(wildcards)),
        published=sorted(PUBLISHED.glob("*.csv")),
        parts=lambda wildcards: [] if wildcards.report else PARTS_OF_BEST,
        scenes=pages_of_scenes,
        templates=TEMPLATES,
    output:
        report("reports/{report}index.html", caption="caption.rst", category="Page"),
    log:
        "logs/{report}page.log",
    benchmark:
        "benchmarks/{report}page.tsv"
    localrule: True
    resources:
        mem_mb=1000,
    params:
        parts=lambda wildcards, input: ["--parts", input.parts[0]] if input.parts else [],
        scenes=lambda wildcards, output: f"{folder_of_output(wildcards, output)}/page",
        code=code_digest("sepi.extensions.page.page"),
    message:
        "page of the report"
    shell:
        command(
            "sepi.extensions.page.page --numbers {input.numbers[0]:q} {params.parts:q} "
            "--scenes {params.scenes:q} --output {output:q} 2> {log:q}"
        )
