"""Runs a script, with warnings as errors, and fails with those of the claims after it that its names deny."""

import runpy
import sys
import warnings

warnings.simplefilter("error")
# where there is a display that pyplot.show() cannot use
warnings.filterwarnings("ignore", "FigureCanvasAgg is non-interactive")
names = runpy.run_path(sys.argv[1], run_name="__main__")
wrong = [claim for claim in sys.argv[2:] if not eval(claim, dict(names))]
sys.exit("not so: " + "; ".join(wrong) if wrong else 0)
