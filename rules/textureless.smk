# Textureless regions (paper, section IV-C, Eq. 6-7): superpixels filled from their reliable edges, or none, which is no job.
rule textureless:
    input:
        light_field="results/{dataset}/{scene}/lightfield.h5",
        previous=file_before("textureless"),
    output:
        maps="results/{dataset}/{scene}/stages/{initial}/{occlusion}/{textureless}/textureless.h5",
        timing="results/{dataset}/{scene}/stages/{initial}/{occlusion}/{textureless}/textureless.time.json",
    log:
        "logs/{dataset}/{scene}/{initial}/{occlusion}/{textureless}/textureless.log",
    benchmark:
        "benchmarks/{dataset}/{scene}/{initial}/{occlusion}/{textureless}/textureless.tsv"
    wildcard_constraints:
        textureless=choices_that_run("textureless"),
    threads: threads_for
    resources:
        mem_mb=memory_for(bytes_per_sample=17, bytes_per_pixel=500),
    params:
        parameters=parameters_of("textureless"),
        code=code_digest(*stage_modules("textureless")),
    message:
        "{wildcards.dataset}/{wildcards.scene}: textureless regions ({wildcards.initial}, {wildcards.occlusion}, {wildcards.textureless})"
    shell:
        "python -m sepi.textureless --light-field {input.light_field:q} --previous {input.previous:q} "
        "--choice {wildcards.textureless} --parameters {params.parameters:q} --threads {threads} "
        "--output {output.maps:q} --timing {output.timing:q} 2> {log:q}"
