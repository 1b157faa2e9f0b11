"""The panels of a scene in the report: reference view, ground truth, stages, variants, errors, masks, other methods'
maps.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from sepi.evaluate import WHOLE_MAP
from sepi.io.scores import Evaluation
from sepi.lightfield import FloatMap, LightField
from sepi.report.plan import BEST_VARIANT, MAIN_VARIANT
from sepi.report.plots.pictures import centre_picture, disparity_limits, outlines
from sepi.report.web.viewer import Viewer
from sepi.stage import StageMaps

# titles of what a variant took for a region, which need not be the region that is scored
_DETECTED = {"occluded": "occluded, detected", "textureless": "textureless, detected"}


@dataclass(frozen=True)
class SceneResults:
    """Everything that is shown of a scene.

    Attributes
    ----------
    light_field : LightField
    maps : mapping of str to mapping of str to StageMaps
        Variant to stage to maps; every stage of the compared variants, of the others the last one at least.
    evaluations : mapping of str to Evaluation
        Of each variant's final map.
    compared : list of str
        Variants of which every stage is shown.
    imported : mapping of str to (ndarray (H, W), Evaluation)
        Other methods' maps.
    problems : mapping of str to str
        Other methods without a map, and why.
    """

    light_field: LightField
    maps: Mapping[str, Mapping[str, StageMaps]]
    evaluations: Mapping[str, Evaluation]
    compared: list[str]
    imported: Mapping[str, tuple[FloatMap, Evaluation]] = field(default_factory=dict)
    problems: Mapping[str, str] = field(default_factory=dict)

    def final(self, variant: str) -> StageMaps:
        """The maps after the last stage."""
        return list(self.maps[variant].values())[-1]


def viewer_of(results: SceneResults) -> Viewer:
    """The viewer of a scene, all its panels in it."""
    light_field = results.light_field
    viewer = Viewer(
        light_field.shape,
        disparity_limits(light_field),
        centre_picture(light_field),
        light_field.camera,
        light_field.from_centre,
    )
    ground_truth = _add_scene(viewer, results)
    confidence = _add_stages(viewer, results)
    finals = _add_finals(viewer, results, confidence, ground_truth)
    _add_imported(viewer, results, ground_truth)
    _add_changes(viewer, finals, ground_truth)
    _add_details(viewer, results, confidence)
    return viewer


def note_of(evaluation: Evaluation) -> str | None:
    """The scores of a final map in one line; None without ground truth."""
    if not evaluation.scores:
        return None
    scores = evaluation.scores["paper"][WHOLE_MAP]
    return f"MSE {scores['mse100']:.2f}, Q25 {scores['q25']:.2f}, BadPix 0.07 {scores['badpix007']:.1f} %"


def _add_scene(viewer: Viewer, results: SceneResults) -> int | None:
    """Reference view, ground truth and its regions; the ground truth's number."""
    group = "Scene"
    viewer.panel(group, "centre", "reference view", "picture")
    if results.light_field.ground_truth is None:
        return None
    ground_truth = viewer.map(results.light_field.ground_truth, "final")
    viewer.panel(group, "ground_truth", "ground truth", "disparity", map=ground_truth)
    for region, mask in results.evaluations[MAIN_VARIANT].regions.items():
        viewer.panel(group, f"{region}-ground-truth", f"{region}, for scoring", "mask", map=viewer.mask(mask))
    return ground_truth


def _add_stages(viewer: Viewer, results: SceneResults) -> dict[str, int]:
    """Disparity after every stage of the compared variants; the number of each one's confidence."""
    confidence = {}
    for variant in results.compared:
        stages = results.maps[variant]
        confidence[variant] = viewer.map(results.final(variant).confidence, "confidence")
        last = list(stages)[-1]
        for number, (stage, found) in enumerate(stages.items(), start=1):
            viewer.panel(
                f"Stages of {variant}",
                f"{variant}/{stage}",
                f"{variant} {number}: {stage}{', final' if stage == last else ''}",
                "disparity",
                map=viewer.map(found.disparity, "final" if stage == last else "other"),
                confidence=confidence[variant] if stage == last else None,
            )
    return confidence


def _add_finals(
    viewer: Viewer, results: SceneResults, confidence: Mapping[str, int], ground_truth: int | None
) -> dict[str, int]:
    """Final maps of all variants, and their errors; the number of each map."""
    finals = {
        variant: viewer.map(results.final(variant).disparity, "final" if variant in results.compared else "other")
        for variant in [*results.compared, *(name for name in results.maps if name not in results.compared)]
    }
    for variant, number in finals.items():
        more = {"map": number, "confidence": confidence.get(variant), "note": note_of(results.evaluations[variant])}
        if variant not in results.compared:
            viewer.panel("Other variants", variant, variant, "disparity", **more)
        if ground_truth is not None:
            viewer.panel("Signed errors", f"{variant}/error", f"{variant}: error", "error", minus=ground_truth, **more)
    return finals


def _add_imported(viewer: Viewer, results: SceneResults, ground_truth: int | None) -> None:
    for method, (disparity, evaluation) in results.imported.items():
        number = viewer.imported(disparity)
        note = note_of(evaluation)
        group = "Other methods, imported"
        viewer.panel(group, f"imported/{method}", f"{method} (imported)", "disparity", map=number, note=note)
        if ground_truth is not None:
            key, title = f"imported/{method}/error", f"{method} (imported): error"
            viewer.panel("Errors of other methods", key, title, "error", map=number, minus=ground_truth, note=note)


def _add_changes(viewer: Viewer, finals: Mapping[str, int], ground_truth: int | None) -> None:
    """Where a variant is farther from the ground truth, and where nearer, than the one it is compared with."""
    if ground_truth is None:
        return
    for variant in finals:
        if variant != MAIN_VARIANT:
            better, worse = compared_pair(variant)
            viewer.panel(
                "What parts mend and harm",
                f"{variant}/change",
                f"{better} beside {worse}",
                "change",
                map=finals[worse],
                minus=finals[better],
                ground_truth=ground_truth,
            )


def compared_pair(variant: str) -> tuple[str, str]:
    """The method with a part, and the one without: the paper's beside its reductions, the best beside the paper's."""
    return (BEST_VARIANT, MAIN_VARIANT) if variant == BEST_VARIANT else (MAIN_VARIANT, variant)


def _add_details(viewer: Viewer, results: SceneResults, confidence: Mapping[str, int]) -> None:
    """Confidence, and what the compared variants took for occluded and textureless."""
    for variant in results.compared:
        group = f"Masks and confidence of {variant}"
        key = f"{variant}/confidence"
        viewer.panel(group, key, f"{variant}: confidence", "confidence", map=confidence[variant])
        final = results.final(variant)
        for region, title in _DETECTED.items():
            if region in final.extra:
                number = viewer.mask(final.mask(region))
                viewer.panel(group, f"{variant}/mask/{region}", f"{variant}: {title}", "mask", map=number)
        if "superpixels" in final.extra:
            # thinned out first: lines of one pixel would break
            number = viewer.kept_mask(outlines(viewer.thinned(final.extra["superpixels"])))
            viewer.panel(group, f"{variant}/superpixels", f"{variant}: superpixels", "outline", map=number)
        if "lti" in final.extra:
            title = f"{variant}: local texture intensity (LTI)"
            viewer.panel(group, f"{variant}/lti", title, "grey", map=viewer.map(final.extra["lti"]))
