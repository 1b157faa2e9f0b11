"""Names of before, so that an error can say what they are called now."""

RENAMED = {
    # keys of the configuration, datasets, formats
    "hci_old_root": "hci_2013_root",
    "hci_old": "hci_2013",
    "hci-old": "hci-2013",
    # parameters
    "accuracy": "rtol",
    "alpha_discontinuity": "boundary_step",
    "alpha_radius": "clean_radius",
    "bend": "second_difference_threshold",
    "candidates": "num_disparities",
    "contradiction": "behind_penalty",
    "cover": "occlusion_margin",
    "depth_step": "discontinuity_threshold",
    "hidden_weight": "occluded_view_weight",
    "least_agreement": "min_inlier_ratio",
    "least_area": "min_area",
    "longest_step": "max_update",
    "mixture": "alpha_threshold",
    "mixture_contrast": "alpha_contrast",
    "mixture_reach": "clean_radius",
    "mixture_step": "boundary_step",
    "most_steps": "max_iterations",
    "share_step": "boundary_step",
    "side_step": "side_margin",
    "solve_accuracy": "rtol",
    "step_weight": "discontinuity_weight",
    "trials": "ransac_iterations",
    # choices that are now another one with parameters that a variant overrides
    "gauss_newton": "second_order with refinements: 3, solves: 0",
    "second_order_colours": "second_order with use_detail: false, colour_scale: 0.0164",
    "semi_global_colours": "semi_global with use_detail: false",
    "visibility_colours": "visibility with use_detail: false, colour_scale: 0.0164",
    "visibility_unmixed": "visibility with use_mixture: false",
}
"""Old name to the new one, which is the first word where more has to be said."""


def new_name(name: str, known: list[str]) -> str | None:
    """What an old name is called now, if that is among the known; of ``hci_old/buddha`` the first part is looked up."""
    head, slash, rest = name.partition("/")
    new = RENAMED.get(head)
    return None if new is None or f"{new.split()[0]}{slash}{rest}" not in known else f"{new}{slash}{rest}"
