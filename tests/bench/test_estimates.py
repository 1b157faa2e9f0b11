"""The comparison of what jobs took with what they asked a cluster for."""

from pathlib import Path

from error_lines import done

from bench.__main__ import main

HEADER = "s\tmax_rss\trule_name\tresources"


def written(folder: Path, *jobs: str) -> Path:
    for number, job in enumerate(jobs):
        (folder / f"{number}.tsv").write_text(f"{HEADER}\n{job}\n")
    return folder


def test_the_worst_job_of_a_rule_is_told(tmp_path: Path) -> None:
    """A cluster ends the job that asked for too little, not the average one."""
    jobs = [
        "30.0\t500.0\tinitial\t{'runtime': 1, 'mem_mb': 1000}",
        "90.0\t900.0\tinitial\t{'runtime': 10, 'mem_mb': 1000}",
        # too short to be measured, and of a rule that states no time
        "0.3\t9.0\tscene\t{'runtime': 1, 'mem_mb': 100}",
        "5.0\t9.0\tcharts\t{'mem_mb': 1000}",
    ]
    result = done("estimates", written(tmp_path, *jobs), of=main)
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in result.output.strip().splitlines()[2:]]
    assert rows == [["initial", "2", "90.0", "50%", "900", "90%"]]
