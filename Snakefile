# Light field depth by stitched epipolar plane images: from light fields to the paper's tables.
#
#   snakemake all         tables, figures and maps of every configured dataset
#   snakemake scenes      the files of each scene, without the tables and the page that need all scenes
#   snakemake ablation    the paper's table 4, Wang's occlusion stage, noise uncorrected, and the parts of variant best
#   snakemake comparison  the methods that the paper compares with, computed on the same scenes
#   snakemake rendered    path-traced scenes in several levels of noise: rendered, computed, scored by property
#   snakemake -- FILE     one file: results/DATASET/SCENE/VARIANT/disparity.pfm
#
# docs/reproduce/workflow.md explains targets and why jobs run again, docs/reproduce/configure.md the configuration.


configfile: f"{workflow.current_basedir}/config.yaml"


include: "rules/package.smk"
include: "rules/common.smk"
include: "rules/targets.smk"
include: "rules/ingest.smk"
include: "rules/truth.smk"
include: "rules/initial.smk"
include: "rules/occlusion.smk"
include: "rules/textureless.smk"
include: "rules/optimize.smk"
include: "rules/export.smk"
include: "rules/evaluate.smk"
include: "rules/external.smk"
include: "rules/report.smk"
include: "rules/run.smk"


for path in ADDED_RULES:

    include: path


# Tables and figures, and the maps of variant best, of the paper's, and of the user's variants
rule all:
    input:
        all_files(),
        result_files(LISTED_MAPS),
    message:
        "all tables, figures and maps are made"


# The files that `all` makes of every scene. Scenes are independent here, so `--batch scenes=1/10` plans a tenth of them
rule scenes:
    input:
        [SCENE_COMPLETE.format(dataset=dataset, scene=scene) for dataset, scene in PLAN.pairs],
    message:
        "all scenes are made"


# Table 4, the ablation of variant best, and the maps of the variants in both
rule ablation:
    input:
        ablation_files(),
        result_files([name for name in VARIANTS if name not in added("variants")]),
    message:
        "all ablations are made"


# The compared methods on every scene: tables, page, images, and maps
rule comparison:
    input:
        report_files(COMPARISON),
        result_files(compared_methods()),
    message:
        "all compared methods are computed"


onsuccess:
    run_ended_well()


onerror:
    run_failed()
