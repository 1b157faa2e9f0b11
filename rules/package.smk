# The Python package whose commands the rules call: it must be installed where Snakemake runs, in this workflow's version. A
# checkout brings its own; a module from elsewhere does not.

import os
import sys
from importlib.metadata import PackageNotFoundError, version
from importlib.util import find_spec
from pathlib import Path

# of the package that these rules are written for
VERSION = "0.1.0"


def package_problem(folder):
    """What is wrong with the installed package for a workflow in this folder, in one line; empty where nothing is."""
    found = find_spec("sepi")
    if found is None:
        return f"the Python package is not installed where Snakemake runs; pip install sepi=={VERSION}"
    try:
        installed = version("sepi")
    except PackageNotFoundError:
        # a bare source tree, whose version nobody knows
        return ""
    beside = found.origin is not None and Path(found.origin).parents[1] == Path(folder)
    if beside or installed == VERSION:
        return ""
    return (
        f"the workflow in {folder} is of version {VERSION}, the installed package of version {installed}; "
        f"pip install sepi=={VERSION}, or take version {installed} of the workflow"
    )


# a job of the workflow that looks at the rules is of a run that has asked this
if "SEPI_WORKFLOW_PROCESS" not in os.environ:
    PROBLEM = package_problem(os.path.dirname(str(workflow.current_basedir)))
    if PROBLEM:
        sys.exit(f"sepi: {PROBLEM}")
