"""What the Snakemake workflow catalog looks at: its file, the instructions, and Snakemake's own linter."""

import os
import re
from pathlib import Path

import pytest
from snakemake_runs import run_snakemake
from workflow_copy import REPOSITORY

# each job is a command of the package that the rules themselves import: it is there where Snakemake runs
ALLOWED = {"Specify a conda environment or container for each rule."}


@pytest.mark.workflow
def test_snakemakes_linter_finds_nothing_else(tmp_path: Path) -> None:
    """It finds what makes a workflow hard to read or to run elsewhere; the catalog shows what it says."""
    words = ["--snakefile", str(REPOSITORY / "Snakefile"), "--lint", "--", "all"]
    result = run_snakemake(words, tmp_path, os.environ | {"PYTHONPATH": str(REPOSITORY)})
    checked = set(re.findall(r"^Lints for rule (\w+)", result.stdout, re.MULTILINE))
    assert {"ingest", "optimize", "page"} <= checked, result.stdout
    assert set(re.findall(r"^ +\* (.+):$", result.stdout, re.MULTILINE)) == ALLOWED, result.stdout
