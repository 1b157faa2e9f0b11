# Occluded regions (paper, section IV-B): depth from the unoccluded half of the views, or none, which is no job.
rule occlusion:
    input:
        light_field="results/{dataset}/{scene}/lightfield.h5",
        previous=file_before("occlusion"),
    output:
        maps="results/{dataset}/{scene}/stages/{initial}/{occlusion}/occlusion.h5",
        timing="results/{dataset}/{scene}/stages/{initial}/{occlusion}/occlusion.time.json",
    log:
        "logs/{dataset}/{scene}/{initial}/{occlusion}/occlusion.log",
    benchmark:
        "benchmarks/{dataset}/{scene}/{initial}/{occlusion}/occlusion.tsv"
    wildcard_constraints:
        occlusion=choices_that_run("occlusion"),
    threads: threads_for
    resources:
        mem_mb=memory_for(bytes_per_sample=18, bytes_per_pixel=1400),
    params:
        parameters=parameters_of("occlusion"),
        code=code_digest(*stage_modules("occlusion")),
    message:
        "{wildcards.dataset}/{wildcards.scene}: occlusion ({wildcards.initial}, {wildcards.occlusion})"
    shell:
        "python -m sepi.occlusion --light-field {input.light_field:q} --previous {input.previous:q} "
        "--choice {wildcards.occlusion} --parameters {params.parameters:q} --threads {threads} "
        "--output {output.maps:q} --timing {output.timing:q} 2> {log:q}"
