# Global optimisation (paper, section IV-D, Eq. 8-12): weighted least squares over the whole map, or none, which is no job.
rule optimize:
    input:
        light_field="results/{dataset}/{scene}/lightfield.h5",
        previous=file_before("optimize"),
    output:
        maps="results/{dataset}/{scene}/stages/{initial}/{occlusion}/{textureless}/{optimize}/optimize.h5",
        timing="results/{dataset}/{scene}/stages/{initial}/{occlusion}/{textureless}/{optimize}/optimize.time.json",
    log:
        "logs/{dataset}/{scene}/{initial}/{occlusion}/{textureless}/{optimize}/optimize.log",
    benchmark:
        "benchmarks/{dataset}/{scene}/{initial}/{occlusion}/{textureless}/{optimize}/optimize.tsv"
    wildcard_constraints:
        optimize=choices_that_run("optimize"),
    threads: threads_for
    resources:
        mem_mb=memory_for(bytes_per_sample=30, bytes_per_pixel=1500),
    params:
        parameters=parameters_of("optimize"),
        code=code_digest(*stage_modules("optimize")),
    message:
        "{wildcards.dataset}/{wildcards.scene}: global optimisation ({wildcards.initial}, {wildcards.occlusion}, {wildcards.textureless}, {wildcards.optimize})"
    shell:
        "python -m sepi.optimize --light-field {input.light_field:q} --previous {input.previous:q} "
        "--choice {wildcards.optimize} --parameters {params.parameters:q} --threads {threads} "
        "--output {output.maps:q} --timing {output.timing:q} 2> {log:q}"
