"""The panels of a scene: views of its maps for the pictures, their sheet, and the page."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy.typing as npt

from sepi.io.scores import Evaluation
from sepi.lightfield import FloatMap, LightField
from sepi.matching.unknown import UNKNOWN
from sepi.report.plan import BEST_VARIANT, MAIN_VARIANT
from sepi.scoring.scores import OWN_BAD_PIXEL, WHOLE_MAP
from sepi.stage import StageMaps
from sepi.variants import compared_methods

Kind = Literal["picture", "disparity", "error", "change", "confidence", "sigma", "grey", "mask", "outline"]
"""How a panel is drawn: the reference view; a map on the scale of disparity; an error (a map minus another); a change
(how much larger the error of a map is than that of another); a map from 0 to 1; the logarithm of a standard deviation;
a map in grey; a mask, or borders between labels, over the view."""


@dataclass(frozen=True)
class Panel:
    """A picture of one or two maps.

    Attributes
    ----------
    key : str
        Unique name in the scene, and the path of its picture below the scene's folder.
    title, group : str
        The group is the heading above the panel.
    kind : Kind
    values : ndarray, shape (H, W), or None
        Map, mask or labels; None for the reference view.
    minus : ndarray, shape (H, W), or None
        The map that an error or a change subtracts.
    ground_truth : ndarray, shape (H, W), or None
        The truth for both maps of a change.
    confidence : ndarray, shape (H, W), or None
        Shown beside the value of a pixel.
    bars : StageMaps or None
        Maps with error bars, which are shown there, too.
    no_interval : str
        Text in place of an interval that the page does not hold; empty: there is none.
    note : str
        Text below the panel.
    ends : (str, str) or None
        Words for the low and the high end of the scale; None: those of the kind.
    precise : bool
        Whether the page holds the map in fine steps.
    in_page : bool
        Whether the panel is on the page and on the sheet.
    """

    key: str
    title: str
    group: str
    kind: Kind
    values: npt.NDArray[Any] | None = None
    minus: FloatMap | None = None
    ground_truth: FloatMap | None = None
    confidence: FloatMap | None = None
    bars: StageMaps | None = None
    no_interval: str = ""
    note: str = ""
    ends: tuple[str, str] | None = None
    precise: bool = False
    in_page: bool = True


@dataclass(frozen=True)
class SceneResults:
    """Results of a scene that the report shows.

    Attributes
    ----------
    light_field : LightField
    maps : mapping of str to mapping of str to StageMaps
        Variant to stage to maps, in order.
    evaluations : mapping of str to Evaluation
        Evaluation of each variant's final map.
    detailed : list of str
        Variants whose stages are all on the page.
    external : mapping of str to Evaluation
        External methods' maps, or their problems.
    """

    light_field: LightField
    maps: Mapping[str, Mapping[str, StageMaps]]
    evaluations: Mapping[str, Evaluation]
    detailed: list[str]
    external: Mapping[str, Evaluation] = field(default_factory=dict)

    def final(self, variant: str) -> StageMaps:
        """The maps after the last stage."""
        return list(self.maps[variant].values())[-1]

    @property
    def variants(self) -> list[str]:
        """All variants, detailed ones first."""
        return [*self.detailed, *(name for name in self.maps if name not in self.detailed)]


def panels_of(results: SceneResults) -> list[Panel]:
    """All panels of a scene, in the order of the page; errors and changes need ground truth."""
    stages = [list(_stage_panels(results, variant)) for variant in results.variants]
    external = list(_external_panels(results))
    return [
        *_scene_panels(results),
        *itertools.chain(*stages),
        *_error_panels(results, "Signed errors", [panels[-1] for panels in stages]),
        *external,
        *_error_panels(results, "Errors of external methods", external),
        *_change_panels(results),
        *(panel for variant in results.variants for panel in _detail_panels(results, variant)),
    ]


def first_final(panels: list[Panel]) -> str:
    """Key of the first final map: that of the first variant shown in detail."""
    return next(panel.key for panel in panels if panel.kind == "disparity" and panel.confidence is not None)


def note_of(evaluation: Evaluation) -> str:
    """Scores of a final map in one line, and a second for the user's thresholds; empty without ground truth."""
    if not evaluation.scores:
        return ""
    scores = evaluation.scores["paper"][WHOLE_MAP]
    own = sorted((float(name.removeprefix(OWN_BAD_PIXEL)), name) for name in scores if name.startswith(OWN_BAD_PIXEL))
    usual = f"MSE {scores['mse100']:.2f}, Q25 {scores['q25']:.2f}, BadPix 0.07 {scores['badpix007']:.1f} %"
    return ",\n".join(filter(None, [usual, ", ".join(f"BadPix {one:g} {scores[name]:.1f} %" for one, name in own)]))


def _scene_panels(results: SceneResults) -> Iterator[Panel]:
    group, ground_truth = "Scene", results.light_field.ground_truth
    yield Panel("reference_view", "reference view", group, "picture")
    if ground_truth is not None:
        yield Panel("ground_truth", "ground truth", group, "disparity", ground_truth, precise=True)
    for region, mask in results.evaluations[MAIN_VARIANT].regions.items():
        yield Panel(f"{region}_ground_truth", f"{region}, for scoring", group, "mask", mask)


def _stage_panels(results: SceneResults, variant: str) -> Iterator[Panel]:
    """Disparity after every stage for detailed variants; the final map for others."""
    detailed, stages = variant in results.detailed, results.maps[variant]
    of_others = "Compared methods" if variant in compared_methods() else "Other variants"
    group = f"Stages of {variant}" if detailed else of_others
    for number, (stage, found) in enumerate(stages.items(), start=1):
        final = number == len(stages)
        yield Panel(
            f"{variant}/{number}_{stage}",
            f"{variant}: final" if final else f"{variant} {number}: {stage}",
            group,
            "disparity",
            found.disparity,
            confidence=found.confidence if final and detailed else None,
            bars=found if final and detailed and found.sigma is not None else None,
            no_interval="" if detailed or found.sigma is None else "not on this page",
            note=note_of(results.evaluations[variant]) if final else "",
            precise=final and detailed,
            in_page=final or detailed,
        )


def _external_panels(results: SceneResults) -> Iterator[Panel]:
    for method, found in results.external.items():
        if found.disparity is not None:
            key, title, note = f"external/{method}/disparity", f"{method} (external)", note_of(found)
            yield Panel(key, title, "External methods", "disparity", found.disparity, note=note)


def _error_panels(results: SceneResults, group: str, finals: Iterable[Panel]) -> Iterator[Panel]:
    """Panels of the errors of final maps, beside these."""
    ground_truth = results.light_field.ground_truth
    for found in finals if ground_truth is not None else ():
        key, title = f"{found.key.rpartition('/')[0]}/error", f"{found.title.removesuffix(': final')}: error"
        sure, note = found.confidence, found.note
        yield Panel(key, title, group, "error", found.values, ground_truth, confidence=sure, note=note)


def _change_panels(results: SceneResults) -> Iterator[Panel]:
    """Panels of where one variant is less or more accurate than another.

    They compare the paper's method with its reductions, and the best variant with the paper's method.
    """
    ground_truth = results.light_field.ground_truth
    for variant in results.variants if ground_truth is not None else ():
        if variant != MAIN_VARIANT:
            better, worse = (variant, MAIN_VARIANT) if variant == BEST_VARIANT else (MAIN_VARIANT, variant)
            group, note = "What each part improves and degrades", "red: improved, blue: degraded"
            maps = results.final(worse).disparity, results.final(better).disparity, ground_truth
            yield Panel(f"{variant}/change", f"{better} beside {worse}", group, "change", *maps, note=note)


def _detail_panels(results: SceneResults, variant: str) -> Iterator[Panel]:
    """Confidence, error bars, superpixels, and the pixels detected as occluded and textureless."""
    final, shown = results.final(variant), variant in results.detailed
    kinds: dict[str, tuple[str, Kind]] = {
        # the detected pixels differ from the region that is scored
        "occluded": ("occluded, detected", "mask"),
        "textureless": ("textureless, detected", "mask"),
        UNKNOWN: ("unknown to all views", "mask"),
        "superpixels": ("superpixels", "outline"),
        "lti": ("local texture intensity (LTI)", "grey"),
    }
    group = f"Masks and confidence of {variant}"
    yield Panel(f"{variant}/confidence", f"{variant}: confidence", group, "confidence", final.confidence, in_page=shown)
    if final.sigma is not None:
        title = f"{variant}: standard deviation"
        yield Panel(f"{variant}/sigma", title, group, "sigma", final.sigma, in_page=shown)
    for name, (title, kind) in kinds.items():
        if name in final.extra and (name != UNKNOWN or final.mask(name).any()):
            values = final.mask(name) if kind == "mask" else final.extra[name]
            yield Panel(f"{variant}/{name}", f"{variant}: {title}", group, kind, values, in_page=shown)
