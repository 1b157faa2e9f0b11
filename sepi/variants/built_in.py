"""The built-in variants: a choice for each stage.

``sepi depth`` uses ``best``, ``fast`` takes half its time, and ``paper`` is the method as published. The others are
rows of the ablations. Extensions add more.
"""

from __future__ import annotations

from typing import Any

UNCORRECTED = "no_noise_correction"
"""The paper's method without the correction of costs for noise; not a column of the paper's tables."""

ENTRIES: dict[str, dict[str, Any]] = {
    "paper": {"initial": "sepi", "occlusion": "half_sepi", "textureless": "lti", "optimize": "wls"},
    "no_sepi": {"base": "paper", "initial": "structure_tensor"},
    "no_occlusion": {"base": "paper", "occlusion": "none"},
    "no_textureless": {"base": "paper", "textureless": "none"},
    "no_occlusion_no_textureless": {"base": "paper", "occlusion": "none", "textureless": "none"},
    "wang": {"base": "paper", "occlusion": "wang"},
    UNCORRECTED: {"base": "paper", "initial": {"correct_noise": False}, "occlusion": {"correct_noise": False}},
    "best": {
        "initial": "semi_global",
        "occlusion": "visibility",
        "textureless": "uniform_planes",
        "optimize": "second_order",
    },
    # few views, candidates and rounds
    "fast": {
        "initial": "semi_global",
        # in a single pass, the mean reference takes a tenth longer and gains next to nothing
        "occlusion": {"choice": "visibility", "passes": 1, "views": 25, "sampling": 2, "mean_noise": 1},
        "textureless": {"choice": "uniform_planes", "views": 9},
        # with so few views, faint detail in noise does more harm than good
        "optimize": {"choice": "second_order", "views": 25, "solves": 1, "least_noise": 0},
    },
}
"""Name to entry of each variant, see :data:`sepi.variants.VARIANT_ENTRIES`."""

DEFAULT_VARIANT = "best"
"""Variant of ``sepi depth``."""

_COLOURS_ALONE = {"use_detail": False, "colour_scale": 0.0164}


def _edges_without(part: str) -> dict[str, Any]:
    return {"occlusion": {part: False}, "textureless": {"edges": False}}


# what each leaves out or takes from the paper, and what differs
_PARTS: dict[str, tuple[str, dict[str, Any]]] = {
    "best_paper_initial": ("the paper's initial depth", {"initial": "sepi"}),
    # colours alone need a smaller scale than together with detail
    "best_no_detail": (
        "colours alone, no detail",
        {"initial": {"use_detail": False}, "occlusion": _COLOURS_ALONE, "optimize": _COLOURS_ALONE},
    ),
    "best_no_denoising": (
        "no denoising of the views",
        {stage: {"denoising": 0} for stage in ("initial", "occlusion", "textureless", "optimize")},
    ),
    "best_no_mean": ("noisy views compared with the reference view", {"occlusion": {"mean_noise": 1}}),
    "best_half_sepi": ("half-SEPIs, no visibility", {"occlusion": "half_sepi"}),
    "best_no_gaps": ("surfaces seen through gaps as matched", {"occlusion": {"gaps": False}}),
    "best_no_specks": ("single pixels and small holes as matched", {"occlusion": {"speck_area": 0, "hole_area": 0}}),
    "best_no_shares": ("edges decided without shares of the views", _edges_without("use_shares")),
    "best_no_mixture": ("edges decided without colours of the reference view", _edges_without("use_mixture")),
    "best_no_lines": ("edges decided pixel by pixel", _edges_without("use_lines")),
    "best_no_light": ("planes of uniform regions by their border alone", {"textureless": {"light": False}}),
    "best_no_planes": ("no planes in uniform regions", {"textureless": "none"}),
    "best_no_refinements": ("no Gauss-Newton before smoothing in noise", {"optimize": {"noisy_refinements": 0}}),
    "best_no_surfaces": ("windows across depth steps and colours", {"optimize": {"one_surface": False}}),
    "best_no_smoothing": ("Gauss-Newton, no smoothing", {"optimize": {"refinements": 3, "solves": 0}}),
    "best_wls": ("the paper's global optimisation", {"optimize": "wls"}),
}
ENTRIES |= {name: {"base": "best", **differences} for name, (_, differences) in _PARTS.items()}

PARTS_OF_BEST: dict[str, str] = {"best": "all parts"} | {name: told for name, (told, _) in _PARTS.items()}
"""Rows of the ablation of ``best``, and what each leaves out or takes from the paper."""
