# The Python package whose commands the rules call. It must be installed where Snakemake runs, in this workflow's
# version; a checkout contains it, a workflow used as a module may not.

import os
import sys
from importlib.metadata import PackageNotFoundError, version
from importlib.util import find_spec
from pathlib import Path

# version of the package that these rules need
VERSION = "0.1.0"


def package_problem(folder):
    """Problem of the installed package for a workflow in this folder, in one line; empty if there is none."""
    found = find_spec("sepi")
    if found is None:
        return f"the Python package is not installed where Snakemake runs; pip install sepi=={VERSION}"
    try:
        installed = version("sepi")
    except PackageNotFoundError:
        # a source tree that is not installed has no version
        return ""
    beside = found.origin is not None and Path(found.origin).parents[1] == Path(folder)
    if beside or installed == VERSION:
        return ""
    return (
        f"the workflow in {folder} is of version {VERSION}, the installed package of version {installed}; "
        f"pip install sepi=={VERSION}, or take version {installed} of the workflow"
    )


# jobs that read the rules belong to a run that has checked this
if "SEPI_WORKFLOW_PROCESS" not in os.environ:
    PROBLEM = package_problem(os.path.dirname(str(workflow.current_basedir)))
    if PROBLEM:
        sys.exit(f"sepi: {PROBLEM}")
