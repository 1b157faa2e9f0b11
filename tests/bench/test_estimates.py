"""The comparison of what jobs took with what they asked a cluster for."""

from pathlib import Path

import pytest
from click.testing import CliRunner

from bench.__main__ import main
from bench.estimates import jobs_below
from sepi.errors import SepiError

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
    result = CliRunner().invoke(main, ["estimates", str(written(tmp_path, *jobs))])
    assert result.exit_code == 0, result.output
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in result.output.strip().splitlines()[2:]]
    assert rows == [["initial", "2", "90.0", "50%", "900", "90%"]]


@pytest.mark.parametrize("text", ["s\tmax_rss\n3.0\t9.0", "", f"{HEADER}\n3.0\t9.0\tinitial\t{{"])
def test_other_files_are_refused(tmp_path: Path, text: str) -> None:
    (tmp_path / "job.tsv").write_text(text)
    with pytest.raises(SepiError, match="--benchmark-extended"):
        jobs_below(tmp_path)
