"""Parts shared by all stages: parameters, maps, and the contract of a choice.

A stage module defines ``CHOICES``: for each choice that a variant may name, a parameter model and a pure function
``(light_field, previous, parameters, progress) -> StageMaps``. The Python API, the command line and the workflow's
rules call this function.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, ClassVar, NamedTuple, Self

import numpy as np
import numpy.typing as npt
from pydantic import BaseModel, ConfigDict, Field

from sepi.errors import SepiError
from sepi.lightfield import BoolMap, DisparityRange, FloatMap, LightField

REACH = 4.0
"""View steps from the reference view to the farthest along an axis, for a stage function; that of 9x9 views."""

CLOSE = 0.07
"""Largest error whose probability is the confidence of maps with error bars, pixels per view step of :data:`REACH`."""

SIGMA, LOW, HIGH = ERROR_BARS = "sigma", "low", "high"
"""Names of the error bars: standard deviation, and bounds of the interval of 90 %."""

LIGHT_DEVIATION = "light_deviation"
"""Map from stage to stage: standard deviation of the disparity of planes by a region's light; 0 elsewhere."""

Progress = Callable[[float], None]
"""Called with the fraction done, 0..1."""


def part_of(progress: Progress, number: int, count: float) -> Progress:
    """Progress of one of ``count`` equal steps, given how many are done before it."""
    return lambda fraction: progress((number + fraction) / count)


def no_progress(_: float) -> None:
    """Ignore progress, for callers who do not show it.

    Parameters
    ----------
    _ : float
        The fraction done, 0..1.

    Examples
    --------
    A stage called by itself, without progress and with all fractions collected:

    >>> from sepi import initial
    >>> from sepi.scenes import render
    >>> from sepi.stage import no_progress
    >>> light_field, parameters = render("dots", size=64, views=3), initial.CHOICES["sepi"].parameters()
    >>> maps = initial.sepi(light_field, None, parameters, no_progress)
    >>> told = []
    >>> maps = initial.sepi(light_field, None, parameters, told.append)
    >>> told == sorted(told), told[-1]
    (True, 1.0)
    """


class Needs(NamedTuple):
    """Memory and time of a choice beyond what its stage usually needs, by the size of the light field.

    Attributes
    ----------
    bytes_per_sample, bytes_per_pixel : float
        Memory for each pixel of each view, and for each pixel of one view.
    bytes_per_candidate : float
        Memory for each pixel of one view and each candidate beyond the usual number of them.
    seconds_per_megasample : float
        Time on one core for a million pixels of all views, with the usual number of candidates.
    """

    bytes_per_sample: float = 0.0
    bytes_per_pixel: float = 0.0
    bytes_per_candidate: float = 0.0
    seconds_per_megasample: float = 0.0


class Parameters(BaseModel):
    """Parameters of one choice of a stage: frozen, unknown keys refused, each with a default and a description.

    This is a pydantic model. Each field has a default, bounds, and a description that names its unit; ``config.yaml``
    shows them.

    Raises
    ------
    pydantic.ValidationError
        If a field is unknown or a value not allowed. For users, :func:`sepi.variants.stage_parameters` turns this into
        a :class:`sepi.SepiError` of one line.

    Examples
    --------
    >>> from pydantic import Field
    >>> from sepi.stage import Parameters
    >>> class BlurParameters(Parameters):
    ...     radius: int = Field(2, ge=1, description="half width of the window, pixels")
    >>> BlurParameters(radius=3)
    BlurParameters(radius=3)
    >>> BlurParameters(radius=0)  # doctest: +IGNORE_EXCEPTION_DETAIL
    Traceback (most recent call last):
    ValidationError: 1 validation error for BlurParameters
    """

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, defer_build=True)

    needs: ClassVar[Needs] = Needs()
    """Memory and time that the workflow requests beyond the usual."""

    def settled(self, light_field: LightField) -> Self:
        """These parameters with values that depend on the light field filled in, for the record of the maps.

        Parameters
        ----------
        light_field : LightField
            With a known disparity range.

        Returns
        -------
        model of the same class
            For a sweep, with the number of candidates.
        """
        return self

    @property
    def files(self) -> tuple[str, ...]:
        """Files that the choice reads beside the light field."""
        return ()


class NoParameters(Parameters):
    """No parameters."""


class OcclusionMarginParameters(Parameters):
    """Parameters of the occlusion of a pixel in a view."""

    occlusion_margin: float = Field(0.15, ge=0, description="how much nearer an occluder must be, pixels per view step")


@dataclass(frozen=True)
class CostVolume:
    """Costs of all candidate disparities at each pixel, for a later stage that chooses among them.

    Attributes
    ----------
    disparities : ndarray, shape (K,), float32
        The candidates, rising and uniform, pixels per view step.
    costs : ndarray, shape (K, H, W), float16
        Finite; less is better. Half precision saves space in files, so costs should lie in about 0..1.

    Raises
    ------
    SepiError
        If the shapes or dtypes are not as above.

    Examples
    --------
    Costs of three candidates at 2 x 2 pixels, and the disparities of least cost:

    >>> import numpy as np
    >>> from sepi.stage import CostVolume
    >>> costs = np.array([[[0.1, 0.9], [0.9, 0.9]], [[0.9, 0.1], [0.9, 0.1]], [[0.9, 0.9], [0.1, 0.9]]])
    >>> volume = CostVolume(np.array([-1, 0, 1], np.float32), costs.astype(np.float16))
    >>> volume.disparities[volume.costs.argmin(axis=0)].tolist()
    [[-1.0, 0.0], [1.0, 0.0]]
    """

    disparities: FloatMap
    costs: npt.NDArray[np.float16]

    def __post_init__(self) -> None:
        if self.costs.ndim != 3 or self.costs.dtype != np.float16 or self.disparities.shape != self.costs.shape[:1]:
            raise SepiError(
                f"cost volume: expected (K,) disparities and (K, H, W) costs of float16, got {self.disparities.shape} "
                f"and {self.costs.shape} of {self.costs.dtype}"
            )


Entry = dict[str, Any]
"""Record of one stage: ``stage``, ``choice`` and ``parameters``."""


def entry(stage: str, choice: str, parameters: Parameters, light_field: LightField) -> Entry:
    """The record of a stage that ran with these parameters on a light field of known disparity range."""
    settled = parameters.settled(light_field)
    return {"stage": stage, "choice": choice, "parameters": settled.model_dump(mode="json")}


@dataclass(frozen=True)
class MadeBy:
    """Record of final maps: the variant's name (may be empty), its stages except ``none`` in order, disparity range."""

    variant: str
    history: tuple[Entry, ...]
    disparity_range: DisparityRange


@dataclass(frozen=True)
class StageMaps:
    """Disparity, confidence and further maps, as stages and :func:`sepi.estimate_depth` return them.

    Attributes
    ----------
    disparity : ndarray, shape (H, W), float32
        Pixels per view step.
    confidence : ndarray, shape (H, W), float32
        0..1.
    extra : mapping of str to ndarray, shape (H, W)
        Maps of this stage and of those before it (``occluded``, ``view_subset``, ``superpixels``, ...), and after the
        last stage of most variants the error bars ``sigma``, ``low`` and ``high``.
    subset_names : tuple of str
        Names for the values of the map ``view_subset``, from 0; empty without such a map.
    cost_volume : CostVolume or None
        Costs that a later stage regularises; that stage returns None.
    made_by : MadeBy or None
        Record that :func:`sepi.estimate_depth` adds.

    Examples
    --------
    >>> import sepi
    >>> from sepi.scenes import render
    >>> light_field = render("curved_occluders", size=64, views=3)
    >>> maps = sepi.estimate_depth(light_field, "paper")
    >>> list(maps.all())[:5]
    ['disparity', 'confidence', 'occlusion_candidates', 'occluded', 'view_subset']
    >>> maps.subset_names[:5]
    ('full', 'left', 'right', 'up', 'down')
    >>> used = maps.extra["view_subset"]  # the views from which each pixel's depth was estimated
    >>> bool((used[maps.mask("occluded")] != maps.subset_names.index("full")).all())
    True

    A map from another program, to be written or refined like one of this package:

    >>> import numpy as np
    >>> other = sepi.StageMaps(light_field.ground_truth, np.ones(light_field.shape, np.float32))
    >>> len(sepi.write_result("other", light_field, other))
    7
    """

    disparity: FloatMap
    confidence: FloatMap
    extra: Mapping[str, npt.NDArray[Any]] = field(default_factory=dict)
    subset_names: tuple[str, ...] = ()
    cost_volume: CostVolume | None = None
    made_by: MadeBy | None = None

    def all(self) -> dict[str, npt.NDArray[Any]]:
        """All maps by name.

        Returns
        -------
        dict of str to ndarray, shape (H, W)
            ``disparity`` and ``confidence`` first, then ``extra``.
        """
        return {"disparity": self.disparity, "confidence": self.confidence, **self.extra}

    @property
    def sigma(self) -> FloatMap | None:
        """Standard deviation of the disparity (H, W), float32, pixels per view step; None without error bars."""
        return self.extra.get(SIGMA)

    @property
    def low(self) -> FloatMap | None:
        """Lower bound (H, W), float32, of the interval that holds the disparity with a probability of 90 %."""
        return self.extra.get(LOW)

    @property
    def high(self) -> FloatMap | None:
        """Upper bound (H, W), float32, of the interval that holds the disparity with a probability of 90 %."""
        return self.extra.get(HIGH)

    def mask(self, name: str) -> BoolMap:
        """A boolean map of an earlier stage.

        Parameters
        ----------
        name : str
            ``"occluded"``, ``"textureless"``, ``"unknown"``, ...

        Returns
        -------
        ndarray, shape (H, W), bool
            All False if there is no such map, for example because its stage was switched off.
        """
        if name in self.extra:
            return self.extra[name].astype(bool)
        return np.zeros(self.disparity.shape, bool)

    def updated(self, disparity: FloatMap, confidence: FloatMap, **extra: npt.NDArray[Any]) -> StageMaps:
        """These maps with a new disparity and confidence and further maps, for a stage to return.

        Parameters
        ----------
        disparity, confidence : ndarray, shape (H, W), float32
            Pixels per view step; 0..1.
        **extra : ndarray, shape (H, W)
            Maps to add; they replace maps of the same name.

        Returns
        -------
        StageMaps
        """
        return replace(self, disparity=disparity, confidence=confidence, extra={**self.extra, **extra})

    def without_costs(self) -> StageMaps:
        """These maps without the cost volume, for stages after which nothing uses the costs.

        Returns
        -------
        StageMaps
        """
        return replace(self, cost_volume=None)


StageFunction = Callable[[LightField, StageMaps | None, Any, Progress], StageMaps]


@dataclass(frozen=True)
class Choice:
    """One choice of a stage.

    Attributes
    ----------
    parameters : type
        Model of its parameters, a subclass of :class:`Parameters`.
    function : callable
        The stage function ``(light_field, previous, parameters, progress) -> StageMaps``. It gets a light field with a
        known disparity range, in view steps as :meth:`run` sets them, and the maps of the stage before (None for the
        first stage). It calls ``progress`` with the fraction done, 0..1. It returns maps with ``disparity`` and
        ``confidence`` of shape (H, W), float32, and others that its docstring lists. It changes none of its arguments,
        reads no ground truth and writes no file. It raises :class:`~sepi.errors.SepiError` if the range is unknown, or
        maps to refine are missing.
    own_steps : bool
        Whether the function gets the light field's own view steps, as added choices do.

    Examples
    --------
    A new choice for the last stage, a median filter:

    >>> import cv2
    >>> from pydantic import Field
    >>> from sepi import estimate_depth
    >>> from sepi.variants import STAGES, VARIANT_ENTRIES, variant_from
    >>> from sepi.scenes import render
    >>> from sepi.stage import Choice, Parameters, require_previous
    >>> class MedianParameters(Parameters):
    ...     size: int = Field(3, ge=3, le=5, description="side of the window, pixels; odd")
    >>> def median(light_field, previous, parameters, progress):
    ...     before = require_previous(previous)
    ...     return before.updated(cv2.medianBlur(before.disparity, parameters.size), before.confidence)
    >>> STAGES["optimize"]["median"] = Choice(MedianParameters, median)
    >>> entries = {"mine": {"base": "paper", "optimize": {"choice": "median", "size": 5}}}
    >>> variant = variant_from("mine", {**VARIANT_ENTRIES, **entries}, "my variants")
    >>> light_field = render("dots", size=64, views=3)
    >>> estimate_depth(light_field, variant).disparity.shape
    (64, 64)
    >>> del STAGES["optimize"]["median"]
    """

    parameters: type[Parameters]
    function: StageFunction
    own_steps: bool = False

    def run(
        self, light_field: LightField, previous: StageMaps | None, parameters: Parameters, progress: Progress
    ) -> StageMaps:
        """Maps of the stage function, run in view steps with the farthest view :data:`REACH` away.

        So thresholds in pixels per view step mean the same for all light fields, and the unit of positions does not
        change the maps.

        Parameters
        ----------
        light_field : LightField
        previous : StageMaps or None
            In the light field's own view steps, like the returned maps.
        parameters : Parameters
        progress : callable

        Returns
        -------
        StageMaps
        """
        factor = 1.0 if self.own_steps or light_field.reach == 0 else REACH / light_field.reach
        if factor == 1:
            return self.function(light_field, previous, parameters, progress)
        given = None if previous is None else _rescaled(previous, 1 / factor)
        found = self.function(_respaced(light_field, factor), given, parameters, progress)
        # unchanged maps must not be rounded again
        return previous if previous is not None and found is given else _rescaled(found, factor)


def _respaced(light_field: LightField, factor: float) -> LightField:
    """The light field with baselines multiplied by ``factor``, without ground truth."""
    known = light_field.disparity_range
    if known is not None:
        known = replace(known, minimum=known.minimum / factor, maximum=known.maximum / factor)
    positions = light_field.baselines * factor
    return replace(light_field, positions=positions, disparity_range=known, ground_truth=None)


def _rescaled(maps: StageMaps, factor: float) -> StageMaps:
    """Maps with disparities multiplied by ``factor``."""
    unit, volume = np.float32(factor), maps.cost_volume
    if volume is not None:
        volume = replace(volume, disparities=volume.disparities * unit)
    extra = {
        name: values * unit if name in (*ERROR_BARS, LIGHT_DEVIATION) else values for name, values in maps.extra.items()
    }
    return replace(maps, disparity=maps.disparity * unit, extra=extra, cost_volume=volume)


def none(
    light_field: LightField, previous: StageMaps | None, parameters: NoParameters, progress: Progress
) -> StageMaps:
    """The maps of the stage before, unchanged: the choice of a stage that is switched off."""
    return require_previous(previous)


def require_previous(previous: StageMaps | None) -> StageMaps:
    """The maps of the stage before, for a stage that cannot be the first.

    Parameters
    ----------
    previous : StageMaps or None
        Argument of the stage function.

    Returns
    -------
    StageMaps

    Raises
    ------
    SepiError
        If it is None.

    Examples
    --------
    The first line of a stage function that refines a map:

    >>> from sepi.stage import require_previous
    >>> def unsure(light_field, previous, parameters, progress):
    ...     before = require_previous(previous)
    ...     return before.updated(before.disparity, 0.5 * before.confidence)
    >>> unsure(None, None, None, None)
    Traceback (most recent call last):
    sepi.errors.SepiError: this stage refines a depth map: the maps of the stage before it are missing
    """
    if previous is None:
        raise SepiError("this stage refines a depth map: the maps of the stage before it are missing")
    return previous


def require_costs(previous: StageMaps | None) -> tuple[StageMaps, CostVolume]:
    """The maps of the stage before and their cost volume, for a stage that chooses among its candidates.

    Parameters
    ----------
    previous : StageMaps or None
        Argument of the stage function.

    Returns
    -------
    before : StageMaps
    volume : CostVolume
        Cost volume of ``before``.

    Raises
    ------
    SepiError
        If one of them is missing.

    Examples
    --------
    A stage that takes the candidate of least cost at each pixel, and returns no costs:

    >>> import numpy as np
    >>> from sepi.extensions.methods.costs import disparity_of, least_costs
    >>> from sepi.stage import CostVolume, StageMaps, require_costs
    >>> def cheapest(light_field, previous, parameters, progress):
    ...     before, volume = require_costs(previous)
    ...     disparity = disparity_of(volume, least_costs(volume))
    ...     return before.updated(disparity, before.confidence).without_costs()
    >>> volume = CostVolume(np.arange(3, dtype=np.float32), np.float16([[[0.9]], [[0.1]], [[0.9]]]))
    >>> before = StageMaps(np.zeros((1, 1), np.float32), np.ones((1, 1), np.float32), cost_volume=volume)
    >>> cheapest(None, before, None, None).disparity.tolist()
    [[1.0]]
    """
    before = require_previous(previous)
    if before.cost_volume is None:
        raise SepiError(
            "this stage needs a cost volume, but the stage before it returns none; docs/reproduce/compared.md names "
            "the choices that return one"
        )
    return before, before.cost_volume


def relative_confidence(confidence: FloatMap) -> FloatMap:
    """Confidence relative to the scene's best (95th percentile), 0..1: noise lowers the confidence of all pixels."""
    best = float(np.percentile(confidence, 95))
    if best <= 0:
        return np.zeros_like(confidence)
    return np.asarray(np.clip(confidence / np.float32(best), 0, 1), np.float32)
