"""What stands between two examples of the gallery: each begins as in a fresh process, and all look alike."""

from __future__ import annotations

from typing import Any

import matplotlib as mpl

from sepi.variants import STAGES

_BUILT_IN = {stage: dict(choices) for stage, choices in STAGES.items()}


def reset(gallery_conf: dict[str, Any], fname: str) -> None:
    """Set what an example may have changed back: matplotlib's settings, and the choices of the stages."""
    mpl.rcdefaults()
    # white in the dark, too: axes and labels are black, also in a downloaded notebook
    mpl.rcParams.update({"font.size": 11, "savefig.bbox": "tight", "figure.facecolor": "white"})
    for stage, choices in _BUILT_IN.items():
        STAGES[stage].clear()
        STAGES[stage].update(choices)
