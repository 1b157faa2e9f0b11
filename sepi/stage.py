"""What every stage has in common: the maps that travel from stage to stage, and the command that a rule calls.

A stage module defines ``CHOICES``: for each choice that a variant may name, a parameter model and a pure function
``(light_field, previous, parameters, progress) -> StageMaps``. The Python API, the command line and the workflow's
rules all call that function.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, ClassVar, NamedTuple, Self

import numpy as np
import numpy.typing as npt
from pydantic import BaseModel, ConfigDict, Field

from sepi.errors import SepiError
from sepi.lightfield import BoolMap, FloatMap, LightField

Progress = Callable[[float], None]
"""Called with the fraction done, 0..1."""


def no_progress(_: float) -> None:
    """For callers who do not watch."""


class Needs(NamedTuple):
    """What a choice takes that takes more than its stage usually does, by the size of the light field.

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
    """Parameters of one choice of a stage: frozen, unknown keys refused, each with a default and a description."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    needs: ClassVar[Needs] = Needs()
    """What the workflow asks a cluster for beyond the usual."""

    def settled(self, light_field: LightField) -> Self:
        """These parameters with what follows from a light field of known disparity range filled in."""
        return self

    @property
    def files(self) -> tuple[str, ...]:
        """Files that the choice reads beside the light field."""
        return ()


class NoParameters(Parameters):
    """A choice that has nothing to set."""


class OcclusionMarginParameters(Parameters):
    """Which surfaces hide a pixel from a view."""

    occlusion_margin: float = Field(
        0.15, ge=0, description="by how much an occluder must be nearer, pixels per view step"
    )


@dataclass(frozen=True)
class CostVolume:
    """What each candidate disparity costs each pixel, for a later stage that chooses among all of them.

    Attributes
    ----------
    disparities : ndarray, shape (K,), float32
        The candidates, rising and uniform, pixels per view step.
    costs : ndarray, shape (K, H, W), float16
        Finite, less is better. Half precision, since every scene's file holds one; make costs range over about 0..1.

    Raises
    ------
    SepiError
        If the shapes or dtypes are not as above.
    """

    disparities: FloatMap
    costs: npt.NDArray[np.float16]

    def __post_init__(self) -> None:
        if self.costs.ndim != 3 or self.costs.dtype != np.float16 or self.disparities.shape != self.costs.shape[:1]:
            raise SepiError(
                f"cost volume: expected (K,) disparities and (K, H, W) costs of float16, got {self.disparities.shape} "
                f"and {self.costs.shape} of {self.costs.dtype}"
            )


@dataclass(frozen=True)
class StageMaps:
    """What a stage hands on.

    Attributes
    ----------
    disparity : ndarray, shape (H, W), float32
        Pixels per view step.
    confidence : ndarray, shape (H, W), float32
        0..1.
    extra : mapping of str to ndarray, shape (H, W)
        Maps of this stage and of those before it (``occluded``, ``view_subset``, ``superpixels``, ...).
    subset_names : tuple of str
        What the values of the map ``view_subset`` stand for, from 0 on; empty without such a map.
    cost_volume : CostVolume or None
        Of a data cost that a later stage regularises; that stage hands on none.
    """

    disparity: FloatMap
    confidence: FloatMap
    extra: Mapping[str, npt.NDArray[Any]] = field(default_factory=dict)
    subset_names: tuple[str, ...] = ()
    cost_volume: CostVolume | None = None

    def all(self) -> dict[str, npt.NDArray[Any]]:
        """Every map by name."""
        return {"disparity": self.disparity, "confidence": self.confidence, **self.extra}

    def mask(self, name: str) -> BoolMap:
        """A boolean map of an earlier stage; empty where that stage was switched off."""
        if name in self.extra:
            return self.extra[name].astype(bool)
        return np.zeros(self.disparity.shape, bool)

    def updated(self, disparity: FloatMap, confidence: FloatMap, **extra: npt.NDArray[Any]) -> StageMaps:
        """These maps with a new disparity and confidence and further maps."""
        return replace(self, disparity=disparity, confidence=confidence, extra={**self.extra, **extra})

    def without_costs(self) -> StageMaps:
        """These maps without the cost volume: what is handed on where nobody will choose among its candidates."""
        return replace(self, cost_volume=None)


StageFunction = Callable[[LightField, StageMaps | None, Any, Progress], StageMaps]


@dataclass(frozen=True)
class Choice:
    """One choice of a stage.

    Attributes
    ----------
    parameters : type
        Model of its parameters.
    run : callable
        The stage function.
    """

    parameters: type[Parameters]
    run: StageFunction


def none(
    light_field: LightField, previous: StageMaps | None, parameters: NoParameters, progress: Progress
) -> StageMaps:
    """The choice of a stage that is switched off: the maps of the stage before as they are."""
    return require_previous(previous)


def require_previous(previous: StageMaps | None) -> StageMaps:
    """The maps of the stage before, for a stage that cannot be the first.

    Raises
    ------
    SepiError
        If there are none.
    """
    if previous is None:
        raise SepiError("this stage refines a depth map: the maps of the stage before it are missing")
    return previous


def require_costs(previous: StageMaps | None) -> tuple[StageMaps, CostVolume]:
    """The maps of the stage before and their cost volume, for a stage that chooses among its candidates.

    Raises
    ------
    SepiError
        If there is none.
    """
    before = require_previous(previous)
    if before.cost_volume is None:
        raise SepiError(
            "this stage chooses among the candidates of a cost volume, and the stages before it hand on none; see "
            "docs/reproduce/compared.md for those that do"
        )
    return before, before.cost_volume


def relative_confidence(confidence: FloatMap) -> FloatMap:
    """Confidence relative to the scene's best (95th percentile), 0..1: noise lowers the confidence of all pixels."""
    best = float(np.percentile(confidence, 95))
    if best <= 0:
        return np.zeros_like(confidence)
    return np.asarray(np.clip(confidence / np.float32(best), 0, 1), np.float32)
