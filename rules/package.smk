# The Python package whose commands the rules call. It must be installed where Snakemake runs, in this workflow's
# version; a checkout contains it, a workflow used as a module may not.

import os
import sys
from contextlib import suppress
from importlib.metadata import PackageNotFoundError, version
from importlib.util import find_spec
from pathlib import Path

# version of the package that these rules need
VERSION = "0.1.0"

# jobs that read the rules belong to a run that has checked this
if "SEPI_WORKFLOW_PROCESS" not in os.environ:
    PACKAGE, CHECKOUT = find_spec("sepi"), os.path.dirname(str(workflow.current_basedir))
    if PACKAGE is None or PACKAGE.origin is None:
        sys.exit(f"sepi: the Python package is not installed where Snakemake runs; pip install sepi=={VERSION}")
    # a source tree that is not installed has no version
    with suppress(PackageNotFoundError):
        if version("sepi") != VERSION and Path(PACKAGE.origin).parents[1] != Path(CHECKOUT):
            sys.exit(
                f"sepi: the workflow in {CHECKOUT} is of version {VERSION}, the installed package of version "
                f"{version('sepi')}; pip install sepi=={VERSION}, or take version {version('sepi')} of the workflow"
            )
