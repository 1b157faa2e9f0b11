"""Runs a script, with warnings as errors, and fails with those of the claims after it that its names deny.

Scenes that another process of the tests has drawn are not drawn again.
"""

import runpy
import sys
import warnings
from pathlib import Path

sys.path.append(str(Path(__file__).parents[1]))

import remembered_scenes

import sepi.scenes

sepi.scenes.render = remembered_scenes.remembered(sepi.scenes.render)
warnings.simplefilter("error")
# where there is a display that pyplot.show() cannot use
warnings.filterwarnings("ignore", "FigureCanvasAgg is non-interactive")
names = runpy.run_path(sys.argv[1], run_name="__main__")
wrong = [claim for claim in sys.argv[2:] if not eval(claim, dict(names))]
sys.exit("not so: " + "; ".join(wrong) if wrong else 0)
