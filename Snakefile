# Light field depth by stitched epipolar plane images: from light fields to the paper's tables.
#
#   snakemake all         tables, figures and maps of every configured dataset
#   snakemake ablation    the five columns of the paper's table 4, and Wang's occlusion stage
#   snakemake -- FILE     one file: results/DATASET/SCENE/VARIANT/disparity.pfm
#
# docs/workflow.md explains targets, configuration and what makes a job run again.


configfile: f"{workflow.basedir}/config.yaml"


include: "rules/common.smk"
include: "rules/ingest.smk"
include: "rules/initial.smk"
include: "rules/occlusion.smk"
include: "rules/textureless.smk"
include: "rules/optimize.smk"
include: "rules/export.smk"
include: "rules/evaluate.smk"
include: "rules/report.smk"


# Tables and figures, and the maps of the paper's method and of variants that the user added
rule all:
    default_target: True
    input:
        report_files(),
        result_files(["paper", *SETTINGS.own_variants]),
    message:
        "all tables, figures and maps are made"


# Table 4 and the maps of all its variants, the text's comparison with Wang et al. included
rule ablation:
    input:
        ablation_files(),
        result_files(VARIANTS),
    message:
        "all ablations are made"


onsuccess:
    print_warnings()
    print_written([*report_files(), *ablation_files()], result_files(SETTINGS.variants))
